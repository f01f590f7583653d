"""For planners' processes: importing unified-planning in less than half the time.

unified-planning imports ConfigSpace, and that all of SciPy's statistics, for one method that nobody calls here.
"""

import sys
from types import ModuleType

__all__ = ["stand_in_for_config_space"]


def stand_in_for_config_space() -> None:
    """What is imported from now on in this process finds an empty ConfigSpace."""
    empty = ModuleType("ConfigSpace")
    empty.ConfigurationSpace = object  # type: ignore[attr-defined]
    sys.modules["ConfigSpace"] = empty
