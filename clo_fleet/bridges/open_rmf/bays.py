"""Bays: small rooms made out of the hub, so that robots can act where the building's places are.

In this fleet robots prepare, grasp and place things in rooms only, yet many buildings have their dispensers and parking
places in the middle of the floor. So each such vertex gets a bay: a rectangle of free floor of at most 7 m2 at or near
the vertex, with a door onto the corridors. A bay's outline and walls are virtual: nothing stands there in the building,
but robots in the simulation do not drive through them. Bays keep clear of corridors, walls and each other.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import shapely
from shapely.affinity import rotate

from clo_fleet.bridges.open_rmf.cells import DOOR_WIDTHS, JAMB, mouth, rounded
from clo_fleet.bridges.open_rmf.corridors import DOORWAY, HALF_BAND, Ground, attached
from clo_fleet.bridges.open_rmf.lanes import Network
from clo_fleet.world.model import Door, DoorId, PlaceId, Point, Room, RoomId
from clo_fleet.world.outlines import outward_headings

__all__ = ["FOOTHOLD", "Bay", "Wish", "bay_at"]

SIDES = (1.3, 1.6, 2.0, 2.5, 3.0, 3.5, 4.0)  # [m] of the rectangles that are tried
LARGEST = 7.2  # [m2], such as 3 m x 2.4 m
REACH = 2.0  # [m] from the vertex to the middles of these
STEP = 0.2  # [m] between the middles
GROWTH = 0.05  # [m] by which good ones then grow
GAP = 0.05  # [m] between bays, and between bays and corridors
FOOTHOLD = 0.4  # [m] a robot's radius and some more
OTHERS = 0.75  # [m] round places that it must leave alone
ASIDE = 0.5  # [m] from a robot's middle to the way through a door, where it stands in nobody's way
STANDING = 1.0  # [m2] for robots to stand on are enough
STANDING_PRICE = 4.0  # [m2] of floor that each m2 of this counts for
AWAY_PRICE = 4.0  # [m2] of floor that each metre counts for that the bay is away from its vertex
YARD = 2.6  # [m] between a bay and the lanes, for its door's stub and for the next bay
YARD_PRICE = 1.5  # [m2] of floor that each metre of it counts for
HARM_PRICE = 4.0  # [m2] of floor that each m2 of harm to the corridors counts for
PASSAGE = 0.45  # [m] on both sides of a door's middle that must be free of walls; its jambs may be in them
TRIED = 8  # rectangles in each direction for which doors are tried
WALLS_NEAR = 3.0  # [m] walls that lend a bay their direction
LONG_WALL = 1.0  # [m]


@dataclass(frozen=True, slots=True)
class Bay:
    """A bay, its door, and the network that leads there."""

    room: Room
    door: Door
    network: Network
    ground: Ground


@dataclass(frozen=True, slots=True)
class _Frame:
    """The plane turned about a point, so that a bay's sides run along the axes."""

    origin: Point
    angle: float

    def turned(self, geometry: shapely.Geometry) -> shapely.Geometry:
        return rotate(geometry, -self.angle, origin=self.origin, use_radians=True)

    def back(self, geometry: shapely.Geometry) -> shapely.Geometry:
        return rotate(geometry, self.angle, origin=self.origin, use_radians=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """A bay as it should be.

    Attributes:
        room, door: ids.
        point: where it should be [m].
        direction: of the lane that comes here [rad].
        max_speed: of that lane [m/s].
        most_harm: that it may do to the corridors [m2].
        elsewhere: places that the bay must leave alone [m].
    """

    room: str
    door: str
    point: Point
    direction: float
    max_speed: float | None
    most_harm: float
    elsewhere: tuple[Point, ...] = ()


def bay_at(wish: Wish, network: Network, ground: Ground) -> Bay | None:
    """The best bay at or near a point, or ``None`` if there is no place for one.

    Good is a large bay at the point, whose door needs little change to the corridors. It is looked for on a grid of
    rectangles, the best of which grow as far as they can and are tried with doors in each side.
    """
    before = ground.harm(network)
    free = _free(wish, network, ground)
    ways = shapely.MultiLineString([network.line(way) for way in network.ways])
    candidates = []
    for angle in _angles(wish.point, wish.direction, ground.hub):
        frame = _Frame(wish.point, angle)
        turned, lanes = frame.turned(free), frame.turned(ways)
        boxes = sorted(_fitting(turned, wish.point), key=lambda box: (-_score(box, wish.point, lanes), box.bounds))
        rooms: dict[Room, shapely.Polygon] = {}
        for box in boxes:
            if len(rooms) < TRIED:
                grown = _grown(box, turned, lanes)
                rooms[_room(frame.back(grown), wish.room)] = grown
        candidates += [(_score(grown, wish.point, lanes), room) for room, grown in rooms.items()]
    best: tuple[float, Bay] | None = None
    for score, room in sorted(candidates, key=lambda item: (-item[0], item[1].outline)):
        if best is not None and score + STANDING_PRICE * STANDING <= best[0]:
            break
        for bay, harm in _with_doors(room, wish, network, ground):
            value = score - HARM_PRICE * (harm - before) + STANDING_PRICE * min(_standing(bay), STANDING)
            if harm - before < wish.most_harm and (best is None or value > best[0]):
                best = (value, bay)
    return best[1] if best else None


def _standing(bay: Bay) -> float:
    """How much floor there is for the middles of robots that stand in nobody's way [m2]."""
    floor = shapely.Polygon(bay.room.outline).buffer(-FOOTHOLD, join_style="mitre")
    return float(floor.difference(mouth(bay.door, -DOORWAY - ASIDE, DOORWAY, ASIDE)).area)


def _free(wish: Wish, network: Network, ground: Ground) -> shapely.Geometry:
    """The floor round a place that no corridor, room, doorway or other place needs."""
    lines = [shapely.LineString(network.line(way)).buffer(HALF_BAND + GAP, cap_style="flat") for way in network.ways]
    taken = [block.buffer(GAP, join_style="mitre") for block in ground.blocks()]
    taken += [shapely.Point(place).buffer(OTHERS) for place in wish.elsewhere]
    reach = shapely.Point(wish.point).buffer(REACH + max(SIDES))
    return ground.hub.intersection(reach).difference(shapely.union_all([*lines, *taken]))


def _angles(point: Point, direction: float, hub: shapely.Polygon) -> list[float]:
    """Directions for a bay: those of the lane and of long walls nearby, each quarter turn counting once [rad]."""
    wishes = [direction]
    for ring in (hub.exterior, *hub.interiors):
        corners = list(ring.simplify(0.05).coords)
        for a, b in pairwise(corners):
            near = shapely.LineString([a, b]).distance(shapely.Point(point)) < WALLS_NEAR
            if near and math.dist(a, b) >= LONG_WALL:
                wishes.append(math.atan2(b[1] - a[1], b[0] - a[0]))
    found: list[float] = []
    for wish in wishes:
        if all(abs(math.remainder(wish - angle, math.pi / 2)) > math.radians(2) for angle in found):
            found.append(wish)
    return found


def _fitting(free: shapely.Geometry, point: Point) -> list[shapely.Polygon]:
    """The rectangles round a point that fit into the free floor."""
    steps = round(REACH / STEP)
    offsets = [step * STEP for step in range(-steps, steps + 1)]
    middles = [(point[0] + dx, point[1] + dy) for dx in offsets for dy in offsets if math.hypot(dx, dy) <= REACH]
    bounds = [
        (x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)
        for x, y in middles
        for width in SIDES
        for depth in SIDES
        if width * depth <= LARGEST
    ]
    boxes = shapely.box(*zip(*bounds, strict=True))
    shapely.prepare(free)
    return list(boxes[shapely.covers(free, boxes)])


def _score(box: shapely.Polygon, point: Point, lanes: shapely.Geometry) -> float:
    """How good a rectangle is for a bay [m2]."""
    away = box.buffer(-FOOTHOLD, join_style="mitre").distance(shapely.Point(point))
    return float(box.area - AWAY_PRICE * away + YARD_PRICE * min(box.distance(lanes), YARD))


def _grown(box: shapely.Polygon, free: shapely.Geometry, lanes: shapely.Geometry) -> shapely.Polygon:
    """The rectangle made larger while it fits, and while it leaves a yard if there was one."""
    yard = YARD if box.distance(lanes) >= YARD else 0.0
    bounds = list(box.bounds)
    for side in range(4):
        while True:
            wider = [*bounds[:side], bounds[side] + (GROWTH if side > 1 else -GROWTH), *bounds[side + 1 :]]
            width, depth = wider[2] - wider[0], wider[3] - wider[1]
            fits = max(width, depth) <= max(SIDES) + 1e-9 and width * depth <= LARGEST
            larger = shapely.box(*wider)
            if not fits or not free.covers(larger) or larger.distance(lanes) < yard:
                break
            bounds = wider
    return shapely.box(*bounds)


def _room(box: shapely.Polygon, name: str) -> Room:
    corners = [rounded(corner) for corner in shapely.Polygon(box).normalize().exterior.coords[:-1]]
    outline = tuple(corners if shapely.LinearRing(corners).is_ccw else corners[::-1])
    return Room(RoomId(PlaceId(name)), outline)


def _with_doors(room: Room, wish: Wish, network: Network, ground: Ground) -> Iterator[tuple[Bay, float]]:
    """The room with a door in each of its sides, as far as the corridors can be led there; with their harm [m2]."""
    floor, others = shapely.Polygon(room.outline), ground.blocks()
    for a, b in zip(room.outline, room.outline[1:] + room.outline[:1], strict=True):
        width = next((width for width in DOOR_WIDTHS if width + 2 * JAMB <= math.dist(a, b)), None)
        if width is None:
            continue
        for share in _shares(a, b, width, wish.point):
            position = rounded((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
            heading = outward_headings(room.outline, position)[0]
            door = Door(id=DoorId(wish.door), rooms=(room.id,), position=position, heading=heading, width=width)
            opening, passage = mouth(door, 0.01, DOORWAY), mouth(door, 0.01, DOORWAY, PASSAGE - width / 2)
            if not ground.hub.covers(passage) or any(opening.intersects(block) for block in others):
                continue
            wider = ground.with_door(door, floor)
            found = attached(network, wider, door, wish.max_speed)
            if found is not None:
                yield Bay(room, door, found[0], wider), found[1]


def _shares(a: Point, b: Point, width: float, point: Point) -> list[float]:
    """Where along a wall a door is tried: in the middle, at both ends, and in front of the bay's place."""
    side = math.dist(a, b)
    margin = (width / 2 + JAMB) / side
    along = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / side**2
    return sorted({margin, 0.5, 1 - margin, min(max(along, margin), 1 - margin)})
