"""The truth: rooms (pymunk), corridors (SUMO), doors, and the facts derived from them."""
