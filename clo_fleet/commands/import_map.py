"""``clo-fleet import-map``: make a map of a building or a network that others drew."""

import argparse
from collections.abc import Iterable
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "make a map of an Open-RMF building or a SUMO network"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("file", type=Path, metavar="FILE", help=".building.yaml, .net.xml[.gz], .nod.xml or .edg.xml")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for the map")
    parser.add_argument("--level", help="Open-RMF: which level, if there are several")
    parser.add_argument(
        "--room", action="append", default=[], metavar="NODE", help="SUMO: a room at this node; dead ends have one"
    )
    parser.add_argument("--force", action="store_true", help="overwrite a map of that name")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.bridges.sumo import is_sumo_file

    return _sumo(chosen) if is_sumo_file(chosen.file) else _open_rmf(chosen)


def _open_rmf(chosen: argparse.Namespace) -> int:
    from clo_fleet.bridges.open_rmf import import_to_folder

    imported, path = import_to_folder(chosen.file, chosen.out, level=chosen.level, force=chosen.force)
    building = imported.building
    print(f"{path}: {len(building.rooms)} rooms, {len(building.doors)} doors, {len(building.corridors)} corridors,")
    print(f"  {len(building.spawn_points)} spawn points; the building has {imported.cells} cells;")
    print(f"  a pixel is {imported.scale_m_per_px:.5f} m")
    _tell(imported.skipped)
    return REACHED


def _sumo(chosen: argparse.Namespace) -> int:
    from clo_fleet.bridges.sumo import import_network
    from clo_fleet.sim.map_folder import write_building

    imported = import_network(chosen.file, rooms=chosen.room)
    building, path = write_building(imported.building, chosen.out, force=chosen.force)
    print(f"{path}: {len(building.rooms)} rooms, {len(building.corridors)} corridors,")
    print(f"  {len(building.spawn_points)} spawn points")
    _tell(imported.skipped)
    return REACHED


def _tell(skipped: Iterable[object]) -> None:
    for item in skipped:
        print(f"  left out: {item}")
