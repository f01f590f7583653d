"""Plan repair at home in unified-planning: after ``register()`` there is ``PlanRepairer(name="clo")``.

| here                        | unified-planning                                                   |
|-----------------------------|--------------------------------------------------------------------|
| the present                 | the initial values of the problem                                  |
| what is left of a plan      | the `SequentialPlan` given to `repair`                             |
| `clo_fleet.clo.repair`      | the operation mode `plan_repairer`                                 |
| `Repaired`                  | `SOLVED_SATISFICING`, with the story in `metrics`, `log_messages`  |
| `Refused`                   | `UNSOLVABLE_PROVEN` or `UNSOLVABLE_INCOMPLETELY`, or `fallback`    |

Importing this loads unified-planning no more than importing clo_fleet does: `register` does it, which takes seconds.
"""

from typing import Any

__all__ = ["NAME", "register"]

NAME = "clo"
_ENGINE = ("clo_fleet.bridges.unified_planning.engine", "CloRepairer")


def register(environment: Any = None) -> None:
    """Make the engine ``clo`` known to an environment of unified-planning; a second time changes nothing.

    Args:
        environment: a ``unified_planning.environment.Environment``; without one, the global environment, which the
            functions of ``unified_planning.shortcuts`` use.
    """
    from unified_planning.environment import get_environment

    factory = get_environment(environment).factory
    if NAME not in factory.engines:
        factory.add_engine(NAME, *_ENGINE)
