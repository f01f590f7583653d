"""Mishaps: which actions fail because something slips, jams or breaks off, by rules that begin at their time.

A mishap strikes once an action is under way. The skill is stopped as if it had been cancelled, so nothing is left half
done, and the action counts as failed. What can be stopped no more, such as a robot in a doorway, goes on.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from clo_fleet.world.chance import uniform
from clo_fleet.world.disturbances import SkillFails
from clo_fleet.world.model import RobotId

__all__ = ["Mishaps"]


@dataclass(slots=True)
class _Rule:
    """A rule and how many actions it has been asked about."""

    fails: SkillFails
    asked: int = 0

    def strikes(self, robot: RobotId, skill: str, time: float, seed: int, number: int) -> bool:
        fails = self.fails
        if skill != fails.skill or fails.robot not in (None, robot) or (fails.until is not None and time > fails.until):
            return False
        self.asked += 1
        if self.asked < fails.nth or (fails.times is not None and self.asked >= fails.nth + fails.times):
            return False
        return fails.chance >= 1.0 or uniform(seed, f"skill_fails/{number}/{self.asked}") < fails.chance


class Mishaps:
    """All rules in force, in the order in which they came."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._rules: list[_Rule] = []

    def add(self, fails: SkillFails) -> None:
        """From now on this rule is in force."""
        self._rules.append(_Rule(fails))

    def strikes(self, robot: RobotId, skill: str, time: float) -> bool:
        """Whether the action that the robot begins now is to fail; every rule counts it."""
        struck = [rule.strikes(robot, skill, time, self._seed, number) for number, rule in enumerate(self._rules)]
        return any(struck)

    def state(self) -> list[dict[str, Any]]:
        """Plain data."""
        return [{"fails": asdict(rule.fails), "asked": rule.asked} for rule in self._rules]

    def restore(self, state: list[Mapping[str, Any]]) -> None:
        """Take up what ``state()`` gave."""
        self._rules = [_Rule(SkillFails(**rule["fails"]), rule["asked"]) for rule in state]
