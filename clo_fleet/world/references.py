"""Names in the setting: that each is given once, and that what is referred to exists.

Rooms, doors, junctions, robots and objects become objects of one PDDL problem, so they share one set of names.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping

from clo_fleet.world.faults import Finding, KeyPath, did_you_mean, value_text
from clo_fleet.world.model import BuildingMap

__all__ = ["Unsound", "map_names", "name_findings", "names_of", "unknown"]

Unsound = Collection[KeyPath]  # what a reader could not read in full: ("rooms", "l1"), or ("rooms",) for them all

ZONE_NAME = "zone-"
MAX_LISTED = 8  # names that are listed where none is near
KINDS = {
    "corridors": "corridor",
    "doors": "door",
    "junctions": "junction",
    "objects": "object",
    "robots": "robot",
    "rooms": "room",
    "spawn_points": "spawn point",
}


def map_names(building: BuildingMap) -> dict[str, list[str]]:
    """The names of a building that become PDDL objects or nodes beside them, by section of its file."""
    return {
        "rooms": [room.id for room in building.rooms],
        "doors": [door.id for door in building.doors],
        "junctions": [junction.id for junction in building.junctions],
    }


def names_of(sections: Mapping[str, Iterable[str]]) -> dict[str, str]:
    """What each name stands for, such as ``room``; the first section to give a name has it."""
    return {name: KINDS[section] for section in reversed(list(sections)) for name in sections[section]}


def name_findings(sections: Mapping[str, Iterable[str]], taken: Mapping[str, str]) -> Iterator[Finding]:
    """Names that are given twice, at the later one, and names that zones have.

    Args:
        sections: the names of each section, in the order in which they claim them.
        taken: names that are claimed already, with what they stand for.
    """
    owners = dict(taken)
    for section, names in sections.items():
        for name in names:
            if name in owners:
                expected = f"a name of its own: {_a(owners[name])} has it, and all share one set of names"
                yield Finding((section, name), expected, f"the name {value_text(name)} again")
            elif name.startswith(ZONE_NAME) and name.removeprefix(ZONE_NAME).isdigit():
                yield Finding((section, name), "another name: corridor zones have such names", value_text(name))
            owners.setdefault(name, KINDS[section])


def unknown(
    key: KeyPath, name: str, known: Collection[str], sections: tuple[str, ...], unsound: Unsound
) -> Iterator[Finding]:
    """A finding if nothing has the name; none if it is the name of something that could not be read."""
    unread = any((section,) in unsound or (section, name) in unsound for section in sections)
    if name not in known and not unread:
        kind = " or ".join(_a(KINDS[section]) for section in sections)
        choice = f" ({', '.join(sorted(known)) or 'there is none'})" if len(known) <= MAX_LISTED else ""
        yield Finding(key, f"the name of {kind}{did_you_mean(name, known) or choice}", value_text(name))


def _a(kind: str) -> str:
    return f"an {kind}" if kind.startswith("o") else f"a {kind}"
