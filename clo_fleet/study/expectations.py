"""What a world file expects of its runs, held against a result.

The table ``expected`` maps a path into ``result.json`` to the value it should have, as text. A path may begin with a
strategy's name and a colon; it then concerns runs with that strategy only::

    expected: {outcome: goals_reached, "clo: robots.r1.executed": 3, "clo: helps.0.fact": (holding r1 o2)}
"""

import json
from typing import Any

from clo_fleet.study.result import RunResult
from clo_fleet.world.model import World

__all__ = ["disappointments"]


def disappointments(world: World, result: RunResult) -> tuple[str, ...]:
    """What is not as the world's file expects, a sentence each."""
    values = json.loads(result.to_json())
    found = []
    for key, expected in world.expected:
        strategy, _, path = key.rpartition(": ")
        if strategy not in ("", result.strategy):
            continue
        actual = _at(values, path)
        if str(actual) != expected:
            found.append(f"{path} is {actual}, expected {expected}")
    return tuple(found)


def _at(values: Any, path: str) -> Any:
    """The value at a dotted path; ``missing`` where there is none."""
    for part in path.split("."):
        if isinstance(values, dict) and part in values:
            values = values[part]
        elif isinstance(values, list) and part.isdecimal() and int(part) < len(values):
            values = values[int(part)]
        else:
            return "missing"
    return values
