"""unified-planning's environments: several in one process, in spite of the parts that know the global one only.

In unified-planning 1.3 the reader makes the variables of an effect for all objects in the global environment, and the
grounder behind the plan validator makes ground actions there, whatever environment the problem has; an assertion then
refuses them. Problems need environments of their own, though: in one where two things may have one name, as PDDL
allows, and where nothing that was read earlier changes the order of anything.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import unified_planning.environment

__all__ = ["as_global"]


@contextmanager
def as_global(environment: Any) -> Iterator[None]:
    """Has the environment stand for the global one meanwhile."""
    before = unified_planning.environment.GLOBAL_ENVIRONMENT
    unified_planning.environment.GLOBAL_ENVIRONMENT = environment
    try:
        yield
    finally:
        unified_planning.environment.GLOBAL_ENVIRONMENT = before
