"""``clo-fleet schema``: JSON schemas for editors and tools."""

import argparse

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "print a JSON schema, for editors and tools"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("of", choices=("world", "map", "result", "batch"))


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    import json

    from clo_fleet.study.batch.spec import batch_schema
    from clo_fleet.study.result import result_schema
    from clo_fleet.world.map_file import map_schema
    from clo_fleet.world.world_file import world_schema

    schemas = {"world": world_schema, "map": map_schema, "result": result_schema, "batch": batch_schema}
    print(json.dumps(schemas[chosen.of](), indent=2))
    return REACHED
