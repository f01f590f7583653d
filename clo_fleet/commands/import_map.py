"""``clo-fleet import-map``: make a map of a building that others drew."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "make a map of an Open-RMF building"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("building", type=Path, metavar="FILE.building.yaml")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for the map")
    parser.add_argument("--level", help="which level, if there are several")
    parser.add_argument("--force", action="store_true", help="overwrite a map of that name")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.bridges.open_rmf import import_to_folder

    imported, path = import_to_folder(chosen.building, chosen.out, level=chosen.level, force=chosen.force)
    building = imported.building
    print(f"{path}: {len(building.rooms)} rooms, {len(building.doors)} doors, {len(building.corridors)} corridors,")
    print(f"  {len(building.spawn_points)} spawn points; the building has {imported.cells} cells;")
    print(f"  a pixel is {imported.scale_m_per_px:.5f} m")
    for skipped in imported.skipped:
        print(f"  left out: {skipped}")
    return REACHED
