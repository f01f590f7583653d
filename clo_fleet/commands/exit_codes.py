"""What the command's exit code says."""

__all__ = ["BAD_INPUT", "INTERRUPTED", "OTHER_OUTCOME", "REACHED"]

REACHED = 0  # what was asked for is done; a run reached its goals
OTHER_OUTCOME = 1  # done, with another outcome
BAD_INPUT = 2  # files or options that cannot be used
INTERRUPTED = 130  # Ctrl-C
