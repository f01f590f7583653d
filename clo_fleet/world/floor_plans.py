"""The buildings that come with the package besides the hand-drawn ones: a hospital floor, a warehouse, a campus.

``clo-fleet make-map hospital|warehouse|campus -o maps`` writes them again. Each is an example of a `Layout`: nodes and
halls first, then rooms that hang beside them.
"""

import math
from itertools import pairwise

from clo_fleet.world.layout import SPUR, Layout
from clo_fleet.world.model import BuildingMap, Point

__all__ = ["campus", "hospital", "warehouse"]

RIGHT, UP, LEFT, DOWN = 0.0, math.pi / 2, math.pi, -math.pi / 2
AISLES, BAYS = "abcdefghij", 10  # of the warehouse: ten aisles with ten bays each
AISLE_PITCH, BAY_PITCH = 14.0, 5.0  # [m]
BAY = 3.2  # [m]


def hospital() -> BuildingMap:
    """A ring corridor of two lanes with wards outside; inside, two single-lane corridors with stores between them.

    ```
             ward-4     ward-5     ward-6 | isolation
          +----+----+------+------+----+----+
          |         |             |         |
    reception   pharmacy-+-supply-+-laundry  surgery
          |         |             |         |
          +----+----+------+------+----+----+
             ward-1     ward-2     ward-3
    ```

    The supply room has two doors, so that a way leads through it; the isolation room lies behind ward 6.
    """
    layout = Layout("hospital")
    width, depth = 40.0, 24.0
    places = {"a": 0.0, "b": 6.0, "c": 13.0, "d": 20.0, "e": 27.0, "f": 34.0, "g": width}
    for row, y in (("south", 0.0), ("north", depth)):
        for column, x in places.items():
            layout.node(f"{row}-{column}", (x, y))
    for name, x in (("west", 0.0), ("cross-c", 13.0), ("cross-e", 27.0), ("east", width)):
        layout.node(name, (x, depth / 2))
    for row in ("south", "north"):
        for one, other in zip("abcdef", "bcdefg", strict=True):
            layout.hall(f"{row}-{one}", f"{row}-{other}")
    for column, middle in (("a", "west"), ("c", "cross-c"), ("e", "cross-e"), ("g", "east")):
        for row in ("south", "north"):
            layout.hall(f"{row}-{column}", middle, single_lane=middle.startswith("cross"))
    for number, column in enumerate("bdf", start=1):
        layout.hang(f"ward-{number}", f"south-{column}", DOWN, (8, 6))
        layout.hang(f"ward-{number + 3}", f"north-{column}", UP, (8, 6))
    layout.room("isolation", (38, depth + SPUR), (5, 6))
    layout.door_between("ward-6", "isolation", (38, depth + SPUR + 3), width=1.2)
    layout.hang("reception", "west", LEFT, (8, 6))
    layout.hang("surgery", "east", RIGHT, (8, 6))
    layout.hang("pharmacy", "cross-c", LEFT, (6, 6))
    layout.hang("supply", "cross-c", RIGHT, (8, 7))
    layout.door("supply", (27 - SPUR, depth / 2), "cross-e")
    layout.hang("laundry", "cross-e", RIGHT, (6, 6))
    return layout.building()


def warehouse() -> BuildingMap:
    """A hundred bays in ten single-lane aisles between two main corridors of two lanes; docks and packing to the south.

    ```
      a1 +- a2   b1 +- b2  ...     bays 1, 3, ... to the left of their aisle, 2, 4, ... to the right,
         |          |              1 and 2 in the south
    =====+==========+=====         the main corridor; one more in the north
         |          |
       inbound    outbound  ...
    ```
    """
    layout = Layout("warehouse")
    levels = BAYS // 2
    top = (levels + 1) * BAY_PITCH + 1.0
    for number, aisle in enumerate(AISLES):
        x = number * AISLE_PITCH
        stops = [f"south-{aisle}", *(f"stop-{aisle}{level}" for level in range(1, levels + 1)), f"north-{aisle}"]
        heights = [0.0, *((level + 0.5) * BAY_PITCH for level in range(1, levels + 1)), top + BAY_PITCH / 2]
        for stop, y in zip(stops, heights, strict=True):
            layout.node(stop, (x, y))
        for one, other in pairwise(stops):
            layout.hall(one, other, single_lane=True)
        for level, stop in enumerate(stops[1:-1]):
            layout.hang(f"bay-{aisle}{2 * level + 1}", stop, LEFT, (BAY, BAY), spur=3.0)
            layout.hang(f"bay-{aisle}{2 * level + 2}", stop, RIGHT, (BAY, BAY), spur=3.0)
    for row in ("south", "north"):
        for one, other in pairwise(AISLES):
            layout.hall(f"{row}-{one}", f"{row}-{other}")
    for room, aisle in (("inbound", "b"), ("packing", "e"), ("charging", "g"), ("outbound", "i")):
        layout.hang(room, f"south-{aisle}", DOWN, (10, 6))
    return layout.building()


def campus() -> BuildingMap:
    """Three buildings round a plaza. Each has corridors of its own, and a lobby with a door to them and one outside.

    ```
                     north-1 + north-2
                     north-3 + north-4
                           lobby-north
                              |
     west-rooms + lobby-west -plaza-= lobby-east + east-rooms
    ```

    So from a room of one building to one of another a plan leads through both lobbies, and through three zones. The way
    to the east is a bridge with a single lane.
    """
    layout = Layout("campus")
    layout.node("plaza", (0, 0))
    for wing, heading in (("west", LEFT), ("north", UP), ("east", RIGHT)):
        _wing(layout, wing, heading)
        layout.hall("plaza", f"gate-{wing}", single_lane=wing == "east")
    return layout.building()


def _wing(layout: Layout, wing: str, heading: float) -> None:
    """A building of the campus: a lobby 15 m from the plaza, behind it a corridor with two rooms on each side."""

    def along(distance: float) -> Point:
        return (distance * math.cos(heading), distance * math.sin(heading))

    gate, lobby_depth = 15.0, 6.0
    back = gate + SPUR + lobby_depth
    stops = (back + SPUR + 2.0, back + SPUR + 12.0)
    layout.node(f"gate-{wing}", along(gate))
    layout.hang(f"lobby-{wing}", f"gate-{wing}", heading, (8.0, lobby_depth))
    for number, distance in enumerate(stops):
        layout.node(f"{wing}-hall-{number + 1}", along(distance))
        for side, turn in ((2 * number + 1, UP), (2 * number + 2, DOWN)):
            layout.hang(f"{wing}-{side}", f"{wing}-hall-{number + 1}", heading + turn, (6.0, 6.0))
    layout.door(f"lobby-{wing}", along(back), f"{wing}-hall-1")
    layout.hall(f"{wing}-hall-1", f"{wing}-hall-2")
