"""Chance without state: a random number is a hash of the run's seed and of what it is for (DECISIONS 10)."""

import hashlib

__all__ = ["uniform", "varied"]


def uniform(seed: int, what: str) -> float:
    """A number in [0, 1), the same for the same seed and ``what``.

    >>> uniform(7, "radio/1") == uniform(7, "radio/1") != uniform(7, "radio/2")
    True
    """
    return int.from_bytes(hashlib.sha256(f"{seed}/{what}".encode()).digest()[:8], "big") / 2**64


def varied(value: float, spread: float, seed: int, what: str) -> float:
    """A value within +-``spread`` (a fraction) of ``value``, the same for the same seed and ``what``."""
    return value * (1.0 + spread * (2.0 * uniform(seed, what) - 1.0))
