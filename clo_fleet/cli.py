"""The command ``clo-fleet``: which subcommands there are, and what a user sees of an error."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from typing import Protocol

from clo_fleet import __version__
from clo_fleet.commands import (
    batch,
    build_network,
    compare,
    explain,
    export,
    import_map,
    init,
    make_map,
    make_world,
    paper,
    query,
    report,
    run,
    schema,
    study_repair,
    validate,
    view,
)
from clo_fleet.commands.exit_codes import BAD_INPUT, INTERRUPTED, OTHER_OUTCOME
from clo_fleet.errors import CloFleetError

__all__ = ["main"]


class _Subcommand(Protocol):
    """A module of ``clo_fleet.commands``."""

    HELP: str

    def options(self, parser: argparse.ArgumentParser) -> None:
        """Adds its arguments."""

    def command(self, chosen: argparse.Namespace) -> int:
        """Does it; returns the exit code."""


_SUBCOMMANDS: dict[str, _Subcommand] = {
    "run": run,
    "view": view,
    "export": export,
    "compare": compare,
    "batch": batch,
    "query": query,
    "report": report,
    "validate": validate,
    "make-map": make_map,
    "make-world": make_world,
    "import-map": import_map,
    "build-network": build_network,
    "explain": explain,
    "study-repair": study_repair,
    "paper": paper,
    "init": init,
    "schema": schema,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code (``commands/exit_codes.py``)."""
    chosen = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = chosen.command
    try:
        return command(chosen)
    except CloFleetError as error:
        from clo_fleet.world.faults import FileFaultsError

        of_a_file = isinstance(error, FileFaultsError)  # each line begins with its place, for editors to jump to
        print(error if of_a_file else f"clo-fleet: {error}", file=sys.stderr)
        return BAD_INPUT
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OTHER_OUTCOME
    except OSError as error:
        print(f"clo-fleet: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("clo-fleet: interrupted; events.jsonl holds what happened so far", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="clo-fleet", description="Fleets of robots that repair their plans when others help them."
    )
    parser.add_argument("--version", action="version", version=f"clo-fleet {__version__}")
    subparsers = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, subcommand in _SUBCOMMANDS.items():
        its_parser = subparsers.add_parser(name, help=subcommand.HELP)
        subcommand.options(its_parser)
        its_parser.set_defaults(command=subcommand.command)
    return parser


if __name__ == "__main__":
    sys.exit(main())
