"""The scene of a run: what does not change while it goes on. Kept beside the log, which tells the rest.

``scene.json`` has the format `SCENE_FORMAT`; lengths in metres, headings in radians. ``holding`` are the predicates of
what is in a hand, each with where robot and object stand in its facts; ``effects`` those of what is done to
objects. Each object has those of its facts that hold at the start.
"""

import json
from pathlib import Path
from typing import Any

from clo_fleet.clo.task import fact_text
from clo_fleet.study.atomic import write_whole
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import World
from clo_fleet.world.vocabulary import vocabulary

__all__ = ["SCENE_FORMAT", "scene", "write_scene"]

SCENE_FORMAT = "clo-fleet/scene/2"


def scene(world: World) -> dict[str, Any]:
    """The building, the robots and the objects of a world as plain data for JSON."""
    building, words = world.map, vocabulary(world)
    done = sorted(filter(words.is_effect, words.beginning))
    return {
        "format": SCENE_FORMAT,
        "world": world.name,
        "map": building.name,
        "rooms": [{"id": room.id, "outline": room.outline, "obstacles": room.obstacles} for room in building.rooms],
        "doors": [
            {
                "id": door.id,
                "rooms": door.rooms,
                "position": door.position,
                "heading": door.heading,
                "width": door.width,
            }
            for door in building.doors
        ],
        "corridors": [
            {
                "id": corridor.id,
                "shape": corridor.shape,
                "one_way": corridor.one_way,
                "single_lane": corridor.single_lane,
            }
            for corridor in building.corridors
        ],
        "robots": [
            {"id": robot.id, "radius": robot.radius, "goals": [fact_text(goal) for goal in robot.goals]}
            for robot in sorted(world.robots, key=lambda robot: robot.id)
        ],
        "objects": [
            {
                "id": item.id,
                "radius": item.radius,
                "prepared": item.prepared,
                "facts": [fact_text(fact) for fact in done if item.id in fact[1:]],
            }
            for item in sorted(world.objects, key=lambda item: item.id)
        ],
        "holding": words.orders(SensorKind.HOLDING),
        "effects": sorted(words.effects),
    }


def write_scene(world: World, path: Path) -> None:
    """Write ``scene.json``, whole or not at all."""
    write_whole(path, (json.dumps(scene(world), separators=(",", ":")) + "\n").encode())
