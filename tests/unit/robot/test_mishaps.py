"""Which actions mishaps strike."""

import json

from clo_fleet.robot.mishaps import Mishaps
from clo_fleet.world.disturbances import SkillFails
from clo_fleet.world.model import RobotId

R1, R2 = RobotId("r1"), RobotId("r2")


def struck(mishaps: Mishaps, count: int, robot: RobotId = R1, skill: str = "grasp", time: float = 1.0) -> list[bool]:
    """What becomes of so many actions one after another."""
    return [mishaps.strikes(robot, skill, time) for _ in range(count)]


def with_rule(rule: SkillFails, seed: int = 7) -> Mishaps:
    """Mishaps by one rule."""
    mishaps = Mishaps(seed)
    mishaps.add(rule)
    return mishaps


def test_a_rule_strikes_so_many_times_from_the_nth_on() -> None:
    """The actions before and after are spared."""
    mishaps = with_rule(SkillFails(time=0.0, skill="grasp", nth=2, times=2))
    assert struck(mishaps, 5) == [False, True, True, False, False]


def test_a_rule_counts_only_what_it_is_about() -> None:
    """Other robots, other skills and what comes after its end do not count."""
    mishaps = with_rule(SkillFails(time=0.0, skill="grasp", robot=R1, until=5.0))
    assert struck(mishaps, 1, robot=R2) == [False]
    assert struck(mishaps, 1, skill="place") == [False]
    assert struck(mishaps, 1, time=5.1) == [False]
    assert struck(mishaps, 2) == [True, False]


def test_chance_is_the_seeds() -> None:
    """About so many fail as the probability says; the same for the same seed, others for another."""
    rule = SkillFails(time=0.0, skill="grasp", times=None, chance=0.3)
    first, again, other = (struck(with_rule(rule, seed), 1000) for seed in (7, 7, 8))
    assert first == again != other
    assert 250 < sum(first) < 350


def test_what_was_counted_survives_a_round_trip() -> None:
    """A rule goes on counting where it was."""
    mishaps = with_rule(SkillFails(time=0.0, skill="grasp", nth=2))
    struck(mishaps, 1)
    other = Mishaps(7)
    other.restore(json.loads(json.dumps(mishaps.state())))
    assert struck(other, 2) == [True, False]
