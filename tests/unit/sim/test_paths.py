"""What paths in a room promise."""

import itertools
import math
import random

import pytest

from clo_fleet.sim.paths import MARGIN, RoomPaths
from clo_fleet.sim.walls import Area, free_space
from clo_fleet.world.model import BuildingMap, Door, DoorId, Point, Room, RoomId

RADIUS = 0.3
HALL = Area(((0, 0), (10, 0), (10, 8), (0, 8)))
PILLARS = Area(HALL.outline, (((4, 2), (4, 6), (6, 6), (6, 2)),))


def length(path: tuple[Point, ...], start: Point) -> float:
    """The length of a path from its start."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise((start, *path)))


def points(path: tuple[Point, ...] | None) -> list[float]:
    """All coordinates of a path that must exist, in a row."""
    assert path is not None
    return [coordinate for point in path for coordinate in point]


def gap(path: tuple[Point, ...], start: Point, point: Point) -> float:
    """The least distance of a path from a point."""

    def to_segment(a: Point, b: Point) -> float:
        dx, dy = b[0] - a[0], b[1] - a[1]
        squared = dx * dx + dy * dy
        share = ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / squared if squared else 0.0
        share = min(1.0, max(0.0, share))
        return math.dist(point, (a[0] + share * dx, a[1] + share * dy))

    return min(to_segment(a, b) for a, b in itertools.pairwise((start, *path)))


def test_a_free_line_is_the_path() -> None:
    """With nothing in the way the path is its goal alone."""
    assert RoomPaths((HALL,)).path((1, 1), (9, 7), RADIUS) == ((9, 7),)


def test_a_path_goes_round_an_obstacle_the_shorter_way() -> None:
    """The path keeps its distance from the pillar and is within 2 % of the shortest."""
    path = RoomPaths((PILLARS,)).path((2, 3.5), (8, 3.5), RADIUS)
    assert path is not None
    corners: list[Point] = [(4, 2), (6, 2), (4, 6), (6, 6)]
    assert min(gap(path, (2, 3.5), corner) for corner in corners) >= RADIUS + 0.03
    assert max(y for _, y in path) <= 3.5
    taut = 2 * math.hypot(2, 1.5 + RADIUS + MARGIN) + 2
    assert length(path, (2, 3.5)) == pytest.approx(taut, rel=0.02)


def test_a_path_goes_round_discs() -> None:
    """Every disc is missed by the robot's radius and more, at little extra length."""
    discs = [((5.0, 4.0), 0.3), ((5.0, 3.0), 0.12), ((3.0, 4.2), 0.12)]
    path = RoomPaths((HALL,)).path((1, 4), (9, 4), RADIUS, discs)
    assert path is not None
    assert path[-1] == (9.0, 4.0)
    for centre, size in discs:
        assert gap(path, (1, 4), centre) >= size + RADIUS + MARGIN - 1e-5
    assert length(path, (1, 4)) < 8.5


def test_adding_only_the_discs_that_are_met_loses_nothing() -> None:
    """Among 30 random discs every path found misses all of them, and is as long in a mirrored room."""
    rng = random.Random(7)
    discs = [((rng.uniform(1.5, 8.5), rng.uniform(0.5, 7.5)), 0.12) for _ in range(30)]
    mirrored = [((10 - x, y), size) for (x, y), size in discs]
    path = RoomPaths((HALL,)).path((0.5, 4), (9.5, 4), RADIUS, discs)
    other = RoomPaths((HALL,)).path((9.5, 4), (0.5, 4), RADIUS, mirrored)
    assert path is not None
    assert other is not None
    assert min(gap(path, (0.5, 4), centre) - size for centre, size in discs) >= RADIUS + MARGIN - 1e-5
    assert length(path, (0.5, 4)) == pytest.approx(length(other, (9.5, 4)))


def test_no_way_is_none() -> None:
    """Two separate floors, a closed row of discs, or a goal in a wall: there is no path."""
    apart = RoomPaths((HALL, Area(((20, 0), (25, 0), (25, 5), (20, 5)))))
    assert apart.path((1, 1), (22, 2), RADIUS) is None
    row = [((5.0, 0.5 * k), 0.12) for k in range(17)]
    assert RoomPaths((HALL,)).path((1, 1), (9, 7), RADIUS, row) is None
    assert RoomPaths((HALL,)).path((1, 1), (9.9, 7), RADIUS) is None
    assert RoomPaths((Area(((0, 0), (0.5, 0), (0.5, 5), (0, 5))),)).path((0.2, 1), (0.2, 4), RADIUS) is None


def test_a_start_too_close_to_something_first_moves_to_the_nearest_free_point() -> None:
    """A robot that stands in the margin of a wall or a disc still gets a path."""
    paths = RoomPaths((HALL,))
    assert points(paths.path((0.1, 4), (9, 4), RADIUS)) == pytest.approx([RADIUS + MARGIN, 4, 9, 4])
    path = paths.path((1, 4), (9, 4), RADIUS, [((0.8, 4.0), 0.3)])
    assert path is not None
    assert math.dist(path[0], (0.8, 4.0)) >= 0.6 + MARGIN - 1e-5


def test_a_path_may_end_within_reach_of_its_goal() -> None:
    """With ``within`` it ends as soon as the goal is that near, even if the goal itself is not free."""
    paths = RoomPaths((HALL,))
    assert points(paths.path((1, 4), (9, 4), RADIUS, within=0.9)) == pytest.approx([8.1, 4])
    assert points(paths.path((1, 4), (9.95, 4), RADIUS, within=0.9)) == pytest.approx([9.05, 4])
    assert paths.path((1, 4), (1.5, 4), RADIUS, within=0.9) == ((1, 4),)


def test_nearest_free_points_are_free() -> None:
    """A free point is its own nearest; another moves just out of what blocks it."""
    paths = RoomPaths((PILLARS,))
    assert paths.nearest_free((1, 1), RADIUS) == (1, 1)
    moved = paths.nearest_free((5, 2.5), RADIUS)
    assert moved == pytest.approx((5, 2 - RADIUS - MARGIN))
    assert moved is not None
    assert paths.path((1, 1), moved, RADIUS) is not None


def test_paths_lead_through_doors_that_are_wide_enough() -> None:
    """A point beyond a door is a goal for a small robot, and none for one that does not fit."""
    room = Room(RoomId("l1"), ((0, 0), (6, 0), (6, 5), (0, 5)))
    door = Door(id=DoorId("d1"), rooms=(room.id,), position=(6, 2.5), heading=0.0, width=0.8)
    paths = RoomPaths(free_space(BuildingMap(name="m", rooms=(room,), doors=(door,)), room.id))
    assert paths.path((1, 1), (6.4, 2.5), RADIUS) is not None
    assert paths.path((1, 1), (6.4, 2.5), 0.4) is None


def test_equal_questions_have_equal_answers() -> None:
    """A fresh graph and a cached one give the same path, to the last bit."""
    discs = [((5.0, 1.0), 0.3), ((2.0, 4.0), 0.2)]
    paths = RoomPaths((PILLARS,))
    first = paths.path((1, 4), (9, 4), RADIUS, discs)
    assert paths.path((1, 4), (9, 4), RADIUS, discs) == first
    assert RoomPaths((PILLARS,)).path((1, 4), (9, 4), RADIUS, discs) == first
