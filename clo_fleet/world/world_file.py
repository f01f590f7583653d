"""World files: what happens on a map, as people write it in YAML.

```yaml
format: clo-fleet/world/1
name: three_rooms
map: ../maps/three_rooms.yaml
seed: 0
until_s: 600
perception: {mode: sight, range_m: 20, look_s: 0}
radio: {facts: true, range_m: 50, delay_s: 0, loss: 0, repeat_s: 5, promise_s: 20}
planning: {fixed_s: 0, per_expansion_s: 0, wall_limit_s: 60, memory_limit_mb: 2048, partly: false}
skills: {prepare_s: 4, grasp_s: 2, place_s: 2, give_s: 2, reach_m: 0.6, partner_wait_s: 60, spread: 0.1}
robots:
  r1: {at: p1, goals: ["(holding r1 o1)"], radius_m: 0.3, max_speed_m_s: 1.0, max_acceleration_m_s2: 1.0}
  r2: {room: l2, at_m: [1, 2], heading_rad: 1.57, goals: ["(holding r2 o2)"]}
objects:
  o1: {room: l1, at_m: [2, 1], prepared: false, radius_m: 0.12, mass_kg: 1}
  o2: {at: p7}
disturbances:
  - {kind: object_moved, at_s: 12.0, object: o1, to_m: [4, 4]}
  - {kind: robot_slowed, at_s: 5.0, for_s: 20, robot: r1, max_speed_m_s: 0.3}
faults: {object_moved: {per_hour: 6}, robot_broken: {per_hour: 2, for_s: [10, 60]}}
expected: {outcome: goals_reached}
```

Only ``format``, ``map`` and ``robots`` are required. A world with a PDDL domain of its own binds it under the key
``domain`` (see ``domain.yaml`` beside this file, which binds the fleet's). The map is named relative to the world file.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from types import MappingProxyType

from clo_fleet.clo.task import parse_fact
from clo_fleet.world.changes import changed
from clo_fleet.world.disturbance_checks import Befallen, disturbance_findings
from clo_fleet.world.disturbance_sections import disturbances_in, random_faults_in
from clo_fleet.world.fact_checks import Known
from clo_fleet.world.faults import Fault, FileFaultsError, Finding
from clo_fleet.world.goal_checks import goal_findings, reach_findings
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import (
    BuildingMap,
    ObjectId,
    ObjectSpec,
    Perception,
    PerceptionMode,
    PlaceId,
    PlanningTime,
    Pose,
    Radio,
    RobotId,
    RobotSpec,
    RoomId,
    SkillSettings,
    World,
)
from clo_fleet.world.references import Unsound, unknown
from clo_fleet.world.sections import Parsed, json_schema, parse
from clo_fleet.world.world_checks import Cast, cast_findings
from clo_fleet.world.world_domain import speech
from clo_fleet.world.world_sections import (
    MEGABYTE,
    ObjectSection,
    PerceptionSection,
    PlanningSection,
    RadioSection,
    RobotSection,
    SkillsSection,
    WorldSection,
)
from clo_fleet.world.yaml_file import Value, read_yaml

__all__ = ["WORLD_FORMAT", "read_world", "world_schema"]

WORLD_FORMAT = "clo-fleet/world/1"
NO_CHANGES: Mapping[str, Value] = MappingProxyType({})

Key = tuple[str, str]
Stand = tuple[RoomId, Pose]


def read_world(path: Path, changes: Mapping[str, Value] = NO_CHANGES) -> World:
    """The world that the file describes, on its map, checked: its goals name what exists and can be reached.

    Args:
        path: the file.
        changes: values to read in place of the file's (see ``world/changes.py``).

    Raises:
        FileFaultsError: with everything that is wrong with the file, then with its map and its PDDL domain.
    """
    parsed = parse(changed(read_yaml(path), changes), WorldSection, {"format": WORLD_FORMAT, "map": "-", "robots": {}})
    building, map_faults, findings = _map(parsed, path)
    sections = parsed.sections
    stands = _stands(sections, building)
    cast = _cast(sections, stands, parsed.unsound)
    findings += _placing_findings(sections, building, parsed.unsound)
    findings += cast_findings(cast, building)
    said = speech(sections, path, building, parsed.unsound)
    findings += said.findings
    random = random_faults_in(sections.faults)
    scheduled = [(i, d) for i, section in enumerate(sections.disturbances) for d in disturbances_in(section)]
    findings += disturbance_findings(scheduled, random, _befallen(sections, building, parsed.unsound, said.known))
    if said.known is not None and said.words is not None:
        findings += goal_findings(cast.goals, said.known, said.words)
        if building is not None and not findings and not parsed.faults:
            findings += reach_findings(cast.robots, cast.objects, building, said.words)
    entries = _entries(sections)
    faults = (*parsed.located(_as_written(finding, entries) for finding in findings), *map_faults, *said.faults)
    if faults or building is None:
        raise FileFaultsError(faults)
    return World(
        name=sections.name or path.stem,
        map=building,
        robots=cast.robots,
        objects=cast.objects,
        domain=said.own,
        seed=sections.seed,
        until=float(sections.until_s),
        skills=_skills(sections.skills),
        perception=_perception(sections.perception),
        radio=_radio(sections.radio),
        planning=_planning(sections.planning),
        disturbances=tuple(disturbance for _, disturbance in scheduled),
        faults=random,
        expected=tuple(sections.expected.items()),
    )


def world_schema() -> dict[str, object]:
    """The JSON schema of world files, for editors."""
    return json_schema(WorldSection, "A clo-fleet world")


def _map(parsed: Parsed[WorldSection], path: Path) -> tuple[BuildingMap | None, tuple[Fault, ...], list[Finding]]:
    """The building, or the faults of its file, or findings about the name of that file."""
    name, key = parsed.sections.map, ("map",)
    if key in parsed.unsound:
        return None, (), []
    if PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor or "\\" in name:
        return None, (), [Finding(key, "a map file named relative to the world file, with '/' between folders")]
    try:
        exists = (path.parent / name).is_file()
    except OSError:  # a name that is too long
        exists = False
    if not exists or PurePosixPath(name).suffix not in (".yaml", ".yml"):
        return None, (), [Finding(key, "a map file (.yaml) that exists, named relative to the world file")]
    try:
        return read_map(path.parent / name), (), []
    except FileFaultsError as error:
        return None, error.faults, []


def _stands(sections: WorldSection, building: BuildingMap | None) -> dict[Key, Stand]:
    """Where each robot and object is, of those that say it in full."""
    spawns = {} if building is None else {spawn.id: (spawn.room, spawn.pose) for spawn in building.spawn_points}
    stands: dict[Key, Stand] = {}
    for key, entry in _entries(sections).items():
        heading = entry.heading_rad if isinstance(entry, RobotSection) else None
        if entry.at is not None:
            if entry.at in spawns:
                stands[key] = spawns[entry.at]
        elif entry.room is not None and entry.at_m is not None:
            x, y = map(float, entry.at_m)
            stands[key] = (RoomId(PlaceId(entry.room)), Pose(x, y, float(heading or 0)))
    return stands


def _cast(sections: WorldSection, stands: Mapping[Key, Stand], unsound: Unsound) -> Cast:
    goals = {name: tuple(map(parse_fact, section.goals)) for name, section in sections.robots.items()}
    return Cast(
        robots=tuple(
            RobotSpec(
                id=RobotId(name),
                room=stands["robots", name][0],
                pose=stands["robots", name][1],
                goals=goals[name],
                radius=float(section.radius_m),
                max_speed=float(section.max_speed_m_s),
                max_acceleration=float(section.max_acceleration_m_s2),
            )
            for name, section in sections.robots.items()
            if ("robots", name) in stands
        ),
        objects=tuple(
            ObjectSpec(
                id=ObjectId(name),
                room=stands["objects", name][0],
                position=stands["objects", name][1].point,
                prepared=section.prepared,
                radius=float(section.radius_m),
                mass=float(section.mass_kg),
            )
            for name, section in sections.objects.items()
            if ("objects", name) in stands
        ),
        goals=goals,
        object_ids=tuple(sections.objects),
        unsound=unsound,
    )


def _placing_findings(sections: WorldSection, building: BuildingMap | None, unsound: Unsound) -> Iterator[Finding]:
    """Robots and objects that do not say where they are, or say it twice."""
    spawns = None if building is None else frozenset(spawn.id for spawn in building.spawn_points)
    for key, entry in _entries(sections).items():
        heading = entry.heading_rad if isinstance(entry, RobotSection) else None
        if key in unsound:
            continue
        if entry.at is None:
            for part, value in (("room", entry.room), ("at_m", entry.at_m)):
                if value is None:
                    yield Finding((*key, part), "a place: room and at_m, or a spawn point of the map with at")
        elif (entry.room, entry.at_m, heading) != (None, None, None):
            yield Finding((*key, "at"), "either at (a spawn point), or room with at_m and heading_rad")
        elif spawns is not None:
            yield from unknown((*key, "at"), entry.at, spawns, ("spawn_points",), unsound)


def _as_written(finding: Finding, entries: Mapping[Key, RobotSection | ObjectSection]) -> Finding:
    """The finding at the key that says where something is: a spawn point stands for its room and position."""
    key = finding.key
    entry = entries.get((str(key[0]), str(key[1]))) if len(key) == 3 and key[2] in ("room", "at_m") else None
    if entry is None or entry.at is None:
        return finding
    return Finding((*key[:2], "at"), finding.expected, finding.value)


def _entries(sections: WorldSection) -> dict[Key, RobotSection | ObjectSection]:
    """Robots and objects by their key."""
    entries: dict[Key, RobotSection | ObjectSection] = {}
    entries.update({("robots", name): robot for name, robot in sections.robots.items()})
    entries.update({("objects", name): thing for name, thing in sections.objects.items()})
    return entries


def _befallen(sections: WorldSection, building: BuildingMap | None, unsound: Unsound, known: Known | None) -> Befallen:
    return Befallen(
        robots=sections.robots,
        objects=sections.objects,
        known=known,
        building=building,
        unsound=unsound,
        until=float(sections.until_s),
    )


def _skills(section: SkillsSection) -> SkillSettings:
    return SkillSettings(
        prepare=float(section.prepare_s),
        grasp=float(section.grasp_s),
        place=float(section.place_s),
        give=float(section.give_s),
        reach=float(section.reach_m),
        partner_wait=float(section.partner_wait_s),
        spread=float(section.spread),
        speed_spread=float(section.speed_spread),
    )


def _perception(section: PerceptionSection) -> Perception:
    return Perception(PerceptionMode(section.mode), float(section.range_m), float(section.look_s))


def _radio(section: RadioSection) -> Radio:
    reach = None if section.range_m is None else float(section.range_m)
    return Radio(
        facts=section.facts,
        range=reach,
        delay=float(section.delay_s),
        loss=float(section.loss),
        repeat=float(section.repeat_s),
        promise=float(section.promise_s),
    )


def _planning(section: PlanningSection) -> PlanningTime:
    return PlanningTime(
        fixed=float(section.fixed_s),
        per_expansion=float(section.per_expansion_s),
        wall_limit=float(section.wall_limit_s),
        memory_limit=int(section.memory_limit_mb * MEGABYTE),
        partly=section.partly,
    )
