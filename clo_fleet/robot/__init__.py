"""The robot: skills, steering, avoidance, senses."""
