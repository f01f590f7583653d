"""Worlds made by programs become files. What people write is read in `world_file`; this is the way back."""

import os
from dataclasses import fields
from pathlib import Path

from clo_fleet.clo.task import fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.world.model import ObjectSpec, RobotSpec, World
from clo_fleet.world.world_file import WORLD_FORMAT
from clo_fleet.world.yaml_file import write_yaml

__all__ = ["WorldNotWrittenError", "write_world"]


class WorldNotWrittenError(CloFleetError):
    """A world has something that is not written to files here, so that the file would be another world.

    Attributes:
        what: the fields that differ from their defaults.
    """

    def __init__(self, what: tuple[str, ...]) -> None:
        super().__init__(what)
        self.what = what

    def __str__(self) -> str:
        return f"a world with its own {', '.join(self.what)} cannot be written to a file"


def write_world(world: World, path: Path, map_file: Path) -> None:
    """Write a world to a file that reads back as the same world. A reader never sees half of it.

    Robots and objects with their places, goals and measures are written, the seed and the time limit; all else must be
    as it is by default.

    Args:
        world: what to write.
        path: the world file.
        map_file: the file of the world's map, which the world file names relative to itself.

    Raises:
        WorldNotWrittenError: if the world has more to it.
        FileWriteError: if the file cannot be written.
    """
    plain = World(
        name=world.name,
        map=world.map,
        robots=tuple(_plain_robot(robot) for robot in world.robots),
        objects=tuple(_plain_object(item) for item in world.objects),
        seed=world.seed,
        until=world.until,
    )
    if world != plain:
        raise WorldNotWrittenError(tuple(sorted(_differences(world, plain))))
    content: dict[str, object] = {
        "format": WORLD_FORMAT,
        "name": world.name,
        "map": Path(os.path.relpath(map_file.resolve(), path.parent.resolve())).as_posix(),
        "seed": world.seed,
        "until_s": world.until,
        "robots": {robot.id: _robot_entry(robot) for robot in world.robots},
    }
    if world.objects:
        content["objects"] = {item.id: _object_entry(item) for item in world.objects}
    write_yaml(path, content)


def _plain_robot(robot: RobotSpec) -> RobotSpec:
    return RobotSpec(
        id=robot.id,
        room=robot.room,
        pose=robot.pose,
        goals=robot.goals,
        radius=robot.radius,
        max_speed=robot.max_speed,
        max_acceleration=robot.max_acceleration,
    )


def _plain_object(item: ObjectSpec) -> ObjectSpec:
    return ObjectSpec(
        id=item.id,
        room=item.room,
        position=item.position,
        prepared=item.prepared,
        radius=item.radius,
        mass=item.mass,
    )


def _robot_entry(robot: RobotSpec) -> dict[str, object]:
    entry: dict[str, object] = {"room": robot.room, "at_m": list(robot.pose.point)}
    if robot.pose.heading:
        entry["heading_rad"] = robot.pose.heading
    measures = {"radius": "radius_m", "max_speed": "max_speed_m_s", "max_acceleration": "max_acceleration_m_s2"}
    return entry | {"goals": [fact_text(goal) for goal in robot.goals]} | _unusual(robot, measures)


def _object_entry(item: ObjectSpec) -> dict[str, object]:
    entry: dict[str, object] = {"room": item.room, "at_m": list(item.position)}
    return entry | _unusual(item, {"prepared": "prepared", "radius": "radius_m", "mass": "mass_kg"})


def _unusual(spec: RobotSpec | ObjectSpec, keys: dict[str, str]) -> dict[str, object]:
    """The keys and values of what is not as by default."""
    defaults = {field.name: field.default for field in fields(spec)}
    return {key: getattr(spec, name) for name, key in keys.items() if getattr(spec, name) != defaults[name]}


def _differences(world: World, plain: World) -> set[str]:
    """The names of the fields in which a world differs from what would be written of it."""
    pairs: list[tuple[World | RobotSpec | ObjectSpec, World | RobotSpec | ObjectSpec]] = [(world, plain)]
    pairs += zip(world.robots, plain.robots, strict=True)
    pairs += zip(world.objects, plain.objects, strict=True)
    names = {field.name for a, b in pairs for field in fields(a) if getattr(a, field.name) != getattr(b, field.name)}
    return names - {"robots", "objects"}
