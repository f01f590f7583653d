"""``clo-fleet make-map``: make a building of corridors with rooms."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from clo_fleet.commands.arguments import count
from clo_fleet.commands.exit_codes import REACHED

if TYPE_CHECKING:
    from clo_fleet.world.model import BuildingMap

__all__ = ["HELP", "command", "options"]

FORMS, PLANS = ("grid", "ring", "line"), ("hospital", "warehouse", "campus")
HELP = "make a building: a grid, a ring or a line of corridors with rooms, or one of those in maps/"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("form", choices=(*FORMS, *PLANS))
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for the map")
    parser.add_argument("--columns", type=count, default=4, help="of a grid (default: 4)")
    parser.add_argument("--rows", type=count, default=3, help="of a grid (default: 3)")
    parser.add_argument("--rooms", type=count, default=6, help="of a ring or a line (default: 6)")
    parser.add_argument("--spacing-m", type=float, default=12.0, metavar="M", help="from room to room (default: 12)")
    parser.add_argument("--room-m", type=float, default=5.0, metavar="M", help="width and depth (default: 5)")
    parser.add_argument("--two-lane", action="store_true", help="corridors with a lane for each direction")
    parser.add_argument("--name", help="of a grid, ring or line; default: such as grid-4x3")
    parser.add_argument("--force", action="store_true", help="overwrite a map of that name")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.sim.map_folder import write_building
    from clo_fleet.world.places import zones

    building, path = write_building(_building(chosen), chosen.out, force=chosen.force)
    number = len(zones(building))
    where = f"{number} zone{'s' * (number > 1)}"
    print(f"{path}: {len(building.rooms)} rooms, {len(building.corridors)} corridors in {where},")
    print(
        f"  {len(building.spawn_points)} spawn points, {building.spawn_points[0].id} to {building.spawn_points[-1].id}"
    )
    return REACHED


def _building(chosen: argparse.Namespace) -> "BuildingMap":
    from clo_fleet.world.buildings import Measures, grid, line, ring
    from clo_fleet.world.floor_plans import campus, hospital, warehouse

    if chosen.form in PLANS:
        return {"hospital": hospital, "warehouse": warehouse, "campus": campus}[chosen.form]()
    measures = Measures(spacing=chosen.spacing_m, room=chosen.room_m, two_lane=chosen.two_lane)
    if chosen.form == "grid":
        return grid(chosen.columns, chosen.rows, measures, name=chosen.name)
    return {"ring": ring, "line": line}[chosen.form](chosen.rooms, measures, name=chosen.name)
