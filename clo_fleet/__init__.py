"""A fleet of robots that repair their plans when others help them, in simulated rooms and corridors."""

__all__ = ["__version__"]

__version__ = "0.1.0"
