"""Standing out of the way: a robot that has nothing to drive to keeps the doors free for others.

It stays where it is, also if others push it a little, unless that is in front of a door; then it goes to the
nearest free place that is not. In a room too small for that it goes to the corner that is furthest from where others
come in.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.robot.doorway import inward, way_in
from clo_fleet.robot.skill import Under
from clo_fleet.robot.steering import Steering, off_line
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import in_front
from clo_fleet.world.model import Point, RobotSpec, RoomId

__all__ = ["StandAside"]

ROOM = 0.2  # [m] between a robot's rim and the floor in front of a door
LEAVE = 0.1  # [m] it goes on a little further than it must, lest it starts anew at the next touch
AROUND = 6.0  # [m] in which it looks for a place
SNUG = 0.05  # [m] about it in a room that has no better place
BETTER = 0.15  # [m] further from where others come in: worth a move in a room that has no place out of their way
RENEW = 3.0  # [s] after which it looks for another one, if it has not got there


@dataclass(slots=True)
class StandAside:
    """Keeps one robot out of the way. ``spot``: where it is going; ``None``: it stands well."""

    spot: Point | None = None
    chosen_at: float = -math.inf
    steering: Steering = field(default_factory=Steering)

    def step(self, site: Site, spec: RobotSpec, time: float) -> Under:
        """What the robot wants to do; nothing if it stands well, or is in the corridors."""
        room = site.floor(spec.id)
        if room is None:
            return Under()
        if (back := inward(site, spec, room)) is not None:
            return Under(back, direct=True)
        here = site.pose(spec.id).point
        needed = spec.radius + ROOM + (0.0 if self.spot is None else LEAVE)
        if not any(in_front(door, room, here, needed) for door in site.premises.doors_of(room)):
            self.spot = None
            return Under()
        if self.spot is None or time - self.chosen_at >= RENEW:
            self.spot, self.chosen_at = _place(site, spec, room, here), time
        velocity = self.steering.velocity(site, spec, room, self.spot, time)
        return Under(velocity, direct=self.steering.pushes)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "spot": list(self.spot) if self.spot else None,
            "chosen_at": self.chosen_at if math.isfinite(self.chosen_at) else None,
            "steering": self.steering.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What ``state()`` was taken from."""
        return cls(
            spot=(state["spot"][0], state["spot"][1]) if state["spot"] else None,
            chosen_at=-math.inf if state["chosen_at"] is None else state["chosen_at"],
            steering=Steering.from_state(state["steering"]),
        )


def _place(site: Site, spec: RobotSpec, room: RoomId, here: Point) -> Point:
    """Where to stand, or where it stands already if nothing is better."""
    for margin in (ROOM + LEAVE, SNUG):
        free = site.rooms.free_spot(here, spec.radius + margin, room, within=AROUND)
        if free is not None:
            return free
    ways = [way_in(door, room, spec.radius) for door in site.premises.doors_of(room)]
    others = [site.pose(other).point for other in site.bodies_in(room) if other != spec.id]

    def away(point: Point) -> float:
        return min(off_line(point, *way) for way in ways)

    corners = (
        site.premises.paths(room).nearest_free(corner, spec.radius) for corner in site.premises.rooms[room].outline
    )
    free_corners = [
        corner
        for corner in corners
        if corner is not None and all(math.dist(corner, other) > 2 * spec.radius + SNUG for other in others)
    ]
    best = max(free_corners, key=away, default=here)
    return best if away(best) > away(here) + BETTER else here
