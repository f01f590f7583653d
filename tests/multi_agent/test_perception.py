"""What robots look at while they work together, and what that costs."""

from dataclasses import replace

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.events import Event, Sensed
from clo_fleet.world.model import ObjectId, ObjectSpec, Perception, PerceptionMode, World
from clo_fleet.world.world_file import read_world

THREE_ROOMS = read_world(shipped("worlds") / "three_rooms.yaml")
MIDDLE = next(room for room in THREE_ROOMS.map.rooms if room.id == "l1")


def cluttered(world: World) -> World:
    """The world with ten more objects in its middle room, which nobody needs."""
    spots = [(22.6 + 0.6 * (n % 10), 0.5) for n in range(10)]
    clutter = [ObjectSpec(id=ObjectId(f"x{n}"), room=MIDDLE.id, position=spot) for n, spot in enumerate(spots)]
    return replace(world, objects=(*world.objects, *clutter))


def finished(
    world: World, perception: Perception, planners: PlannerPool
) -> tuple[RunResult, list[tuple[float, Event]]]:
    """The world run to its end: the result, and what happened when."""
    with Run(replace(world, perception=perception), planners=planners) as run:
        result = run.finish()
        return result, [(time, event) for _, time, event in run.log]


def test_a_robot_that_looks_at_its_watch_set_only_does_the_same_and_looks_at_less(fleet_planners: PlannerPool) -> None:
    """The causal links say what is worth looking at: in clutter under a third of the facts, and the same run."""
    world = cluttered(THREE_ROOMS)
    (all_, seen), (few, watched) = (finished(world, Perception(mode), fleet_planners) for mode in _MODES)
    assert seen == watched
    for robot, result in few.robots.items():
        assert result.facts_looked_at > 0
        assert result.facts_looked_at <= all_.robots[robot].facts_looked_at
    looked = [sum(robot.facts_looked_at for robot in result.robots.values()) for result in (all_, few)]
    assert looked[1] < looked[0] / 3


def test_where_looking_takes_time_who_looks_at_everything_knows_later(fleet_planners: PlannerPool) -> None:
    """With 0.2 s a fact, news of other rooms reach a robot that sees all of them later, and it still ends well."""
    known = []
    for look in (0.0, 0.2):
        result, log = finished(cluttered(THREE_ROOMS), Perception(PerceptionMode.FULL, look=look), fleet_planners)
        assert result.outcome == "goals_reached"
        sensed = [(time, event) for time, event in log if isinstance(event, Sensed) and event.robot == "r1"]
        known.append(next(time for time, event in sensed if event.fact == ("prepared", "o2")))
    assert known[0] < known[1]


_MODES = (PerceptionMode.SIGHT, PerceptionMode.WATCH)
