"""The worlds of a soak: any building, 2 to 20 robots, and people and faults that cross their plans.

The number of a world says all about it, its strategy too: the same number always gives the same world.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.sim.map_folder import write_building
from clo_fleet.testing.buildings import corridor_with_rooms, rooms_in_a_row, shipped_map
from clo_fleet.world import buildings
from clo_fleet.world.chance import uniform
from clo_fleet.world.free_spots import free_spots
from clo_fleet.world.model import BuildingMap, World
from clo_fleet.world.random_worlds import CrowdedError, random_world
from clo_fleet.world.world_writing import write_world

__all__ = ["SoakWorld", "write_soak_world"]

T = TypeVar("T")

UNTIL = 400.0  # [s] the longest that a run may last
NAMES = tuple("abcdefgh")
SHIPPED = ("hello", "three_rooms", "office")
FAULTS: Mapping[str, Mapping[str, object]] = MappingProxyType(  # kind -> what its section wants beside its rate
    {
        "object_moved": {},
        "object_taken": {"for_s": ()},
        "object_prepared": {},
        "object_dropped": {},
        "robot_slowed": {"for_s": (), "to_share": 0.1},
        "robot_broken": {"for_s": ()},
        "sensor_blinded": {"for_s": ()},
        "radio_lost": {"for_s": ()},
        "skill_fails": {"skill": ""},
        "planner_killed": {},
        "planner_slowed": {"for_s": (), "by_s": 4},
        "door_closed": {"for_s": ()},
        "corridor_closed": {"for_s": ()},
    }
)
KINDS = ("row", "row", "corridor", "corridor", "shipped", "grid", "ring", "line")


@dataclass(frozen=True, slots=True)
class SoakWorld:
    """A world of a soak, as a file. ``robots``: how many; ``strategy``: with which it is to be run."""

    number: int
    path: Path
    building: str
    robots: int
    strategy: str


@dataclass(frozen=True, slots=True)
class _Draw:
    """Draws for one world."""

    number: int

    def one(self, what: str, choices: Sequence[T]) -> T:
        """One of the choices."""
        return choices[int(uniform(self.number, f"soak/{what}") * len(choices))]

    def between(self, what: str, least: float, most: float) -> float:
        """A number, to two digits."""
        return round(least + uniform(self.number, f"soak/{what}") * (most - least), 2)

    def chance(self, what: str, share: float) -> bool:
        """Whether something is so that is so in such a share of worlds."""
        return uniform(self.number, f"soak/{what}") < share


def write_soak_world(number: int, folder: Path) -> SoakWorld:
    """Write world ``number`` with its map and network into the folder, as ``world.yaml``.

    Raises:
        NetconvertMissingError: without the extra ``maps``.
    """
    draw = _Draw(number)
    folder.mkdir(parents=True, exist_ok=True)
    building, map_file = _building(draw, folder)
    world = _varied(draw, _cast(draw, building))
    path = folder / "world.yaml"
    write_world(world, path, map_file)
    with path.open("a", encoding="utf-8") as file:
        file.write("\n".join(_settings(draw)) + "\n")
    return SoakWorld(number, path, building.name, len(world.robots), _strategy(draw))


def _building(draw: _Draw, folder: Path) -> tuple[BuildingMap, Path]:
    kind = draw.one("kind", KINDS)
    size = int(draw.between("size", 2, 7))
    match kind:
        case "shipped":
            building = shipped_map(draw.one("map", SHIPPED))
            assert building.network is not None
            source = building.network.with_name(f"{building.name}.yaml")
            for file in (source, building.network):
                shutil.copyfile(file, folder / file.name)
            return building, folder / source.name
        case "row":
            building = rooms_in_a_row(*NAMES[:size])
        case "corridor":
            building = corridor_with_rooms(NAMES[:size], closet="closet" if draw.chance("closet", 0.5) else "")
        case "grid":
            building = buildings.grid(max(2, size // 2), draw.one("rows", (2, 3)))
        case "ring":
            building = buildings.ring(max(3, size))
        case _:
            building = buildings.line(size)
    return write_building(building, folder, force=True)


def _cast(draw: _Draw, building: BuildingMap) -> World:
    """Robots and objects with goals: fewer where there is no room for so many."""
    robots = 2 + int(19 * uniform(draw.number, "soak/robots") ** 1.5)
    objects = int(draw.between("objects", 0, 9))
    try:
        return random_world(building, robots=robots, objects=objects, seed=draw.number, name=f"soak-{draw.number}")
    except CrowdedError:
        most = sum(int(0.8 * len(spots)) for spots in free_spots(building).values())
        robots = max(2, min(robots, most // 2))
        objects = max(0, min(objects, most - robots))
        return random_world(building, robots=robots, objects=objects, seed=draw.number, name=f"soak-{draw.number}")


def _varied(draw: _Draw, world: World) -> World:
    """Quick and slow robots; some objects are prepared already."""
    robots = tuple(
        replace(robot, max_speed=draw.between(f"{robot.id}/speed", 0.4, 1.4)) if draw.chance("speeds", 0.5) else robot
        for robot in world.robots
    )
    objects = tuple(replace(item, prepared=draw.chance(f"{item.id}/prepared", 0.2)) for item in world.objects)
    return replace(world, robots=robots, objects=objects, until=UNTIL)


def _settings(draw: _Draw) -> list[str]:
    """The rest of the world file."""
    settings: dict[str, dict[str, object]] = {
        "perception": {"mode": draw.one("mode", ("sight", "sight", "full")), "range_m": draw.between("range", 3, 20)},
        "radio": {
            "facts": draw.one("facts", ("true", "true", "false")),
            "loss": draw.one("loss", (0, 0, 0.3)),
            "delay_s": draw.one("delay", (0, 0, 0.5, 3)),
        },
        "planning": {"fixed_s": draw.one("fixed", (0, 0, 0.4, 5)), "partly": draw.one("partly", ("true", "false"))},
        "skills": {
            "spread": draw.one("spread", (0, 0.3)),
            "speed_spread": draw.one("speed-spread", (0, 0.2)),
            "partner_wait_s": draw.one("patience", (5, 60)),
        },
    }
    lines = [
        f"{section}: {{{', '.join(f'{key}: {value}' for key, value in keys.items())}}}"
        for section, keys in settings.items()
    ]
    faults = {kind: _fault(draw, kind) for kind in FAULTS if draw.chance(kind, 0.25)}
    return [*lines, "faults:", *(f"  {kind}: {{{keys}}}" for kind, keys in faults.items())] if faults else lines


def _fault(draw: _Draw, kind: str) -> str:
    """How often it happens, and whatever else its section wants."""
    keys = {"per_hour": draw.between(f"{kind}/rate", 20, 200), **FAULTS[kind]}
    if "for_s" in keys:
        shortest = draw.between(f"{kind}/for", 1, 30)
        keys["for_s"] = [shortest, round(4 * shortest, 2)]
    if "skill" in keys:
        keys["skill"] = draw.one(f"{kind}/skill", ("move", "prepare", "grasp", "place", "give"))
    return ", ".join(f"{key}: {value}" for key, value in keys.items())


def _strategy(draw: _Draw) -> str:
    return draw.one("strategy", ("clo", "clo", "clo-improve", *STRATEGIES))
