"""The root of every error that this package raises."""

__all__ = ["CloFleetError"]


class CloFleetError(Exception):
    """Something that a caller asked for cannot be done; subclasses say what and carry the facts."""
