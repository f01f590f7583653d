"""Buildings of any size in a line: `grid`, `ring` and `line` give a map with a room at every node.

```
grid(3, 2)                 ring(6)            line(3)

  +--#  +--#  +--#            #   #           #    #    #
  |     |     |             #-+---+-#         |    |    |
  +-----+-----+               |   |           +----+----+
  |     |     |             #-+---+-#
  +--#  +--#  +--#            #   #
```

All corridors are one zone that robots pass through; every room (#) hangs beside its node at a spur, so that nobody who
waits at a door blocks the way. In a room of 5 m x 5 m ten robots of radius 0.3 m have space, at its spawn points.
`clo_fleet.sim.map_folder.write_building` writes a building's files, as ``clo-fleet make-map`` does.
"""

import math
from dataclasses import dataclass

from clo_fleet.errors import CloFleetError
from clo_fleet.world.layout import DOOR_WIDTH, Layout
from clo_fleet.world.model import BuildingMap, Point

__all__ = ["MAX_ROOMS", "BuildingSizeError", "Measures", "grid", "line", "ring"]

MAX_ROOMS = 1024
SPACING = (10.0, 200.0)  # [m] at least and at most
SMALLEST_ROOM = 3.0  # [m]
JAMB = 0.1  # [m] of wall beside a door
MARGIN = 1.2  # [m] between a room and the next corridor's centre line: a lane, and a robot's radius to spare
BEND = (
    3.0  # [m] a grid's spurs leave the crossing diagonally, of which 1.8 m are crossing; here they turn to their doors
)
RUN_UP = 2.0  # [m] from there to the door


class BuildingSizeError(CloFleetError):
    """A building of such a size is not made.

    Attributes:
        what: which measure.
        value: as given.
        lowest, highest: what it may be.
    """

    def __init__(self, what: str, value: float, lowest: float, highest: float) -> None:
        super().__init__(what, value, lowest, highest)
        self.what, self.value, self.lowest, self.highest = what, value, lowest, highest

    def __str__(self) -> str:
        return f"{self.what}: got {self.value:g}, expected {self.lowest:g} to {self.highest:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """How large a building's parts are [m].

    Attributes:
        spacing: from node to node.
        room: width and depth of the rooms.
        two_lane: whether corridors have a lane for each direction; otherwise both share one, by turns. Spurs have two.
    """

    spacing: float = 12.0
    room: float = 5.0
    two_lane: bool = False


def grid(columns: int, rows: int, measures: Measures = Measures(), *, name: str | None = None) -> BuildingMap:
    """Corridors in ``columns`` by ``rows``, with a room upwards and to the right of each crossing.

    Raises:
        BuildingSizeError: if there would be less than 2 or more than `MAX_ROOMS` rooms, or they do not fit.
    """
    _check("columns", columns, 1, MAX_ROOMS)
    _check("rows", rows, 1, MAX_ROOMS // columns)
    _check("rooms", columns * rows, 2, MAX_ROOMS)
    _check_measures(measures, measures.spacing - BEND - RUN_UP - MARGIN)
    layout = Layout(name or f"grid-{columns}x{rows}")
    places = [(column, row) for row in range(rows) for column in range(columns)]
    for column, row in places:
        layout.node(f"node-{column}-{row}", (column * measures.spacing, row * measures.spacing))
    for column, row in places:
        for other in ((column + 1, row), (column, row + 1)):
            if other[0] < columns and other[1] < rows:
                layout.hall(f"node-{column}-{row}", f"node-{other[0]}-{other[1]}", single_lane=not measures.two_lane)
    for column, row in places:
        x, y = column * measures.spacing, row * measures.spacing
        room = f"room-{column}-{row}"
        wall = x + BEND + RUN_UP
        layout.room(room, (wall, y + BEND - DOOR_WIDTH / 2 - JAMB), (measures.room, measures.room))
        layout.door(room, (wall, y + BEND), f"node-{column}-{row}", via=[(x + BEND, y + BEND)])
    return layout.building()


def ring(rooms: int, measures: Measures = Measures(), *, name: str | None = None) -> BuildingMap:
    """A closed corridor with as many corners, and a room outside of each.

    Raises:
        BuildingSizeError: if there would be less than 3 or more than `MAX_ROOMS` rooms, or they do not fit.
    """
    _check("rooms", rooms, 3, MAX_ROOMS)
    radius = measures.spacing / 2 / math.sin(math.pi / rooms)
    angles = [math.tau * number / rooms for number in range(rooms)]
    nodes = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
    layout = _beside(name or f"ring-{rooms}", measures, nodes, angles)
    for number in range(rooms):
        layout.hall(f"node-{number}", f"node-{(number + 1) % rooms}", single_lane=not measures.two_lane)
    return layout.building()


def line(rooms: int, measures: Measures = Measures(), *, name: str | None = None) -> BuildingMap:
    """A straight corridor with rooms along it.

    Raises:
        BuildingSizeError: if there would be less than 2 or more than `MAX_ROOMS` rooms, or they do not fit.
    """
    _check("rooms", rooms, 2, MAX_ROOMS)
    nodes = [(number * measures.spacing, 0.0) for number in range(rooms)]
    layout = _beside(name or f"line-{rooms}", measures, nodes, [math.pi / 2] * rooms)
    for number in range(rooms - 1):
        layout.hall(f"node-{number}", f"node-{number + 1}", single_lane=not measures.two_lane)
    return layout.building()


def _beside(name: str, measures: Measures, nodes: list[Point], headings: list[float]) -> Layout:
    """Nodes with a room each, in the direction of its heading."""
    _check_measures(measures, measures.spacing - MARGIN)
    layout = Layout(name)
    for number, (node, heading) in enumerate(zip(nodes, headings, strict=True)):
        layout.node(f"node-{number}", node)
        layout.hang(f"room-{number}", f"node-{number}", heading, (measures.room, measures.room))
    return layout


def _check_measures(measures: Measures, largest_room: float) -> None:
    _check("spacing [m]", measures.spacing, *SPACING)
    _check("room size [m]", measures.room, SMALLEST_ROOM, largest_room)


def _check(what: str, value: float, lowest: float, highest: float) -> None:
    if not lowest <= value <= highest:  # which NaN is not either
        raise BuildingSizeError(what, value, lowest, highest)
