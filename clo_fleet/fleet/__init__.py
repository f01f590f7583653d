"""The team: radio, announcements, offers, and the loop of a mission."""
