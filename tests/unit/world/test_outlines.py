"""Measures of outlines, against shapely as the oracle."""

import math

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from clo_fleet.world.model import PlaceId, Point, Room, RoomId
from clo_fleet.world.outlines import (
    area,
    centroid,
    clearance,
    counter_clockwise,
    covers,
    outward_headings,
    wall_distance,
)

L_SHAPE: tuple[Point, ...] = ((0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5))
points = st.tuples(st.integers(-2, 16), st.integers(-2, 16)).map(lambda p: (p[0] / 2, p[1] / 2))


def outline_of(radii: list[int]) -> tuple[Point, ...]:
    """A star-shaped outline round (3, 3) with a corner in each direction."""
    step = math.tau / len(radii)
    return tuple((3 + r * math.cos(i * step), 3 + r * math.sin(i * step)) for i, r in enumerate(radii))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(1, 5), min_size=3, max_size=9), points)
def test_measures_agree_with_shapely(radii: list[int], point: Point) -> None:
    """Area, centroid, distance and cover of star-shaped outlines."""
    outline = outline_of(radii)
    polygon, dot = shapely.Polygon(outline), shapely.Point(point)
    assert area(outline) == pytest.approx(polygon.area)
    assert centroid(outline) == pytest.approx((polygon.centroid.x, polygon.centroid.y))
    distance = wall_distance(outline, point)
    assert distance == pytest.approx(polygon.exterior.distance(dot), abs=1e-9)
    if distance > 1e-9:
        assert covers(outline, point) == polygon.covers(dot)


@given(points)
def test_covers_is_exact_on_a_grid(point: Point) -> None:
    """Corners and edges of an outline with right angles belong to it."""
    assert covers(L_SHAPE, point) == shapely.Polygon(L_SHAPE).covers(shapely.Point(point))


def test_clockwise_outlines_are_turned_and_keep_their_first_corner() -> None:
    """Turning twice changes nothing."""
    turned = counter_clockwise(tuple(reversed(L_SHAPE)))
    assert turned[0] == L_SHAPE[-1]
    assert area(turned) == area(L_SHAPE) == 18
    assert counter_clockwise(turned) == turned


def test_a_door_looks_out_square_to_its_wall() -> None:
    """Also at the walls of a corner that points inwards."""
    assert outward_headings(L_SHAPE, (3, 0)) == pytest.approx((-math.pi / 2,))
    assert outward_headings(L_SHAPE, (4, 2.04)) == pytest.approx((math.pi / 2,))
    assert sorted(outward_headings(L_SHAPE, (0, 0))) == pytest.approx([-math.pi, -math.pi / 2]) or sorted(
        outward_headings(L_SHAPE, (0, 0))
    ) == pytest.approx([-math.pi / 2, math.pi])


def test_clearance_counts_walls_and_obstacles_and_is_negative_where_nothing_fits() -> None:
    """Outside the room or inside an obstacle the sign says so."""
    room = Room(RoomId(PlaceId("l1")), L_SHAPE, (((4, 0.5), (5, 0.5), (5, 1.5), (4, 1.5)),))
    assert clearance(room, (1, 1)) == 1
    assert clearance(room, (3.5, 1)) == 0.5
    assert clearance(room, (4.5, 1)) == -0.5
    assert clearance(room, (4, 4)) == -2
