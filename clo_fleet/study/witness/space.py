"""Invariants of space: one form for every robot, no jumps, nothing in walls, nobody in anybody.

The engines correct what they find, so bodies get a little into one another and into walls before they are pushed
apart: as far as they come in one of the physics' substeps.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from clo_fleet.fleet.mission import Mission
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import walls
from clo_fleet.study.witness.broken import BrokenInvariantError
from clo_fleet.world.model import ObjectId, Pose, RobotId, World

__all__ = ["Scene", "Space"]

SUBSTEPS = 4  # of a tick, in which contacts are solved
HAND_OVER = 0.06  # [m] a body this near to where its vehicle will be may become the vehicle
PUSHED = 0.03  # [m] in a tick, by others, beyond the way that a robot makes by itself
WALL = 0.025  # [m] half of a wall's thickness
TURNING = 0.02  # [m] of two vehicles: SUMO knows their places on lanes, and which lanes cross, but not their outlines
NEAR = 1.1  # [m] between centres: further apart no two robots of usual size touch


@dataclass(frozen=True, slots=True)
class Scene:
    """Where all robots are: as bodies, as vehicles, and all of them."""

    bodies: dict[RobotId, Pose]
    vehicles: dict[RobotId, Pose]
    poses: dict[RobotId, Pose]

    @classmethod
    def of(cls, mission: Mission) -> "Scene":
        """The scene as it is now."""
        bodies = mission.site.rooms.poses()
        vehicles = mission.site.corridors.poses() if mission.world.map.corridors else {}
        return cls(bodies, vehicles, bodies | vehicles)


class Space:
    """Looks at where everybody is."""

    def __init__(self, world: World, site: Site) -> None:
        self._world, self._site = world, site  # the site is made anew at checkpoints: as of the last look
        self._radius = {spec.id: spec.radius for spec in world.robots}
        self._top = {spec.id: max(spec.max_speed, site.max_speed(spec.id)) for spec in world.robots}
        self._last: dict[RobotId, Pose] = {}
        self._way: dict[RobotId, float] = {spec.id: self._top[spec.id] * site.tick for spec in world.robots}
        self._solid = shapely.STRtree([shapely.LineString(wall) for wall in walls(world.map)])
        self._rooms = shapely.STRtree([shapely.Polygon(room.outline) for room in world.map.rooms])
        self._blocks = shapely.STRtree([shapely.Polygon(block) for room in world.map.rooms for block in room.obstacles])
        self._near = max(NEAR, 2 * max(self._radius.values(), default=0.0) + 0.5)

    def look(self, scene: Scene, site: Site, time: float) -> None:
        """Check everything.

        Raises:
            BrokenInvariantError: for the first thing that is not so.
        """
        self._site = site
        for what, who in (
            *self._one_form(scene),
            *self._jumps(scene),
            *self._in_something_solid(scene),
            *self._overlaps(scene),
        ):
            raise BrokenInvariantError(what, who, time)

    def _one_form(self, scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Every robot is either a body or a vehicle, and every object in one hand, on one floor, or gone."""
        for robot in self._radius:
            if (robot in scene.bodies) is (robot in scene.vehicles):
                yield "both body and vehicle" if robot in scene.bodies else "neither body nor vehicle", (robot,)
        rooms = self._site.rooms
        hands: dict[ObjectId, list[RobotId]] = {spec.id: [] for spec in self._world.objects}
        for robot in self._radius:
            for item in rooms.carried(robot):
                hands[item].append(robot)
        for item, carriers in hands.items():
            carrier, position = rooms.carrier(item), self._site.rooms.item_position(item)
            if carriers != ([] if carrier is None else [carrier]):
                yield f"carried by {carriers} and by {carrier}", (item,)
            elif (position is None) is not (rooms.gone(item) or (carrier is not None and carrier in scene.vehicles)):
                yield f"at {position}, carried by {carrier}", (item,)
            elif carrier is not None and position is not None:
                apart = math.dist(position, scene.bodies[carrier].point)
                if apart >= self._radius[carrier]:
                    yield f"{apart:.2f} m from the middle of its carrier {carrier}", (item,)

    def _jumps(self, scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Nobody is further from where it was than it can drive in a tick, not even when it changes its form."""
        tick = self._site.tick
        for robot, pose in scene.poses.items():
            top = self._site.max_speed(robot)
            self._top[robot] = max(self._top[robot], top)
            before = self._last.get(robot, pose)
            way = math.dist(before.point, pose.point)
            may = min(max(top * tick, self._way[robot]), self._top[robot] * tick) + HAND_OVER + PUSHED
            if way > may:
                yield f"went {way:.3f} m in a tick, from {_at(before)} to {_at(pose)}; at most {may:.3f} m", (robot,)
            self._last[robot], self._way[robot] = pose, way

    def _in_something_solid(self, scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
        """No robot is in a wall or an obstacle, and no vehicle is in a room."""
        into = max(self._top.values(), default=0.0) * self._site.tick / SUBSTEPS
        names, points = _points(scene.bodies)
        if names:
            (rows, _), distances = self._solid.query_nearest(points, return_distance=True, all_matches=False)
            radii = np.array([self._radius[name] for name in names])[rows]
            for index in np.flatnonzero(distances <= radii + WALL - into).tolist():
                name = names[int(rows[index])]
                yield f"{distances[index]:.3f} m from a wall at {_at(scene.bodies[name])}", (name,)
            for row in self._blocks.query(points, predicate="within")[0].tolist():
                yield f"in an obstacle, at {_at(scene.bodies[names[row]])}", (names[row],)
        names, points = _points(scene.vehicles)
        for row, room in self._rooms.query(points, predicate="within").T.tolist() if names else ():
            yield f"a vehicle in room {self._world.map.rooms[room].id}", (names[row],)

    def _overlaps(self, scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
        """No two robots are in the same space, whatever their forms.

        A robot is a disc; as a vehicle it claims a box that is longer, but boxes may touch where corridors meet, and
        behind a robot that has just left its lane.
        """
        names, points = _points(scene.poses)
        for row, other in shapely.STRtree(points).query(points, predicate="dwithin", distance=self._near).T.tolist():
            if row < other:
                a, b = names[row], names[other]
                driving = a in scene.vehicles and b in scene.vehicles
                speed = self._top[a] + self._top[b]
                into = TURNING if driving else speed * self._site.tick / SUBSTEPS
                apart = math.dist(scene.poses[a].point, scene.poses[b].point)
                gap = apart - self._radius[a] - self._radius[b]
                if gap <= -into:
                    yield f"{-gap:.3f} m into one another, at {_at(scene.poses[a])} and {_at(scene.poses[b])}", (a, b)


def _points(poses: dict[RobotId, Pose]) -> tuple[list[RobotId], "np.ndarray[tuple[int], np.dtype[np.object_]]"]:
    return list(poses), shapely.points(np.array([pose.point for pose in poses.values()]).reshape(-1, 2))


def _at(pose: Pose) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"
