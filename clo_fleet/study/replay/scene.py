"""The scene of a run: what does not change while it goes on. Kept beside the log, which tells the rest.

``scene.json`` has the format `SCENE_FORMAT`; lengths in metres, headings in radians.
"""

import json
import os
from pathlib import Path
from typing import Any

from clo_fleet.clo.task import fact_text
from clo_fleet.world.model import World

__all__ = ["SCENE_FORMAT", "scene", "write_scene"]

SCENE_FORMAT = "clo-fleet/scene/1"


def scene(world: World) -> dict[str, Any]:
    """The building, the robots and the objects of a world as plain data for JSON."""
    building = world.map
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
            {"id": item.id, "radius": item.radius, "prepared": item.prepared}
            for item in sorted(world.objects, key=lambda item: item.id)
        ],
    }


def write_scene(world: World, path: Path) -> None:
    """Write ``scene.json``, whole or not at all."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    draft.write_text(json.dumps(scene(world), separators=(",", ":")) + "\n", encoding="utf-8")
    draft.replace(path)
