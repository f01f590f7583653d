"""A run as an MCAP file with Foxglove's message types, for the viewers and players of robotics.

| topic              | type                   | says                                                            |
|--------------------|------------------------|-----------------------------------------------------------------|
| `/building`        | `foxglove.SceneUpdate` | walls, obstacles and corridors, once                            |
| `/fleet`           | `foxglove.SceneUpdate` | robots as cylinders with their names, objects as small ones     |
| `/robots/ID/pose`  | `foxglove.PoseInFrame` | where the robot is                                              |
| `/log`             | `foxglove.Log`         | plans, dropped steps and their reasons, failures, disturbances  |
| `/events`          | `clo_fleet.Event`      | every line of the log as it is                                  |

Messages are JSON. Time 0 of the run is time 0 of the file; the frame is the building's, metres, z up.
"""

import json
import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, BinaryIO

from clo_fleet.errors import CloFleetError
from clo_fleet.study.atomic import written_whole
from clo_fleet.study.event_log import read_events
from clo_fleet.study.replay.page import read_scene
from clo_fleet.study.replay.recording import piece

__all__ = ["MissingMcapError", "export"]

FRAME = "building"
HEIGHT = 0.4  # [m] of a robot as it is drawn
INFO, WARNING = 2, 3
WARNINGS = frozenset({"failed", "disturbed"})
GREY, BLUE, DARK = (0.45, 0.45, 0.45, 1.0), (0.0, 0.45, 0.7, 1.0), (0.1, 0.1, 0.1, 1.0)

_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_POSE = {"type": "object", "properties": {"position": {"type": "object"}, "orientation": {"type": "object"}}}
_TEXT, _WHOLE, _LIST = {"type": "string"}, {"type": "integer"}, {"type": "array", "items": {"type": "object"}}
_ENTITY = {
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "frame_id": _TEXT,
        "id": _TEXT,
        "lifetime": _TIME,
        "frame_locked": {"type": "boolean"},
        **dict.fromkeys(
            ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"), _LIST
        ),
    },
}
SCHEMAS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "foxglove.SceneUpdate": {"deletions": _LIST, "entities": {"type": "array", "items": _ENTITY}},
        "foxglove.PoseInFrame": {"timestamp": _TIME, "frame_id": _TEXT, "pose": _POSE},
        "foxglove.Log": {
            "timestamp": _TIME,
            "level": _WHOLE,
            "message": _TEXT,
            "name": _TEXT,
            "file": _TEXT,
            "line": _WHOLE,
        },
        "clo_fleet.Event": {"id": _WHOLE, "t": {"type": "number"}, "kind": _TEXT},
    }
)


class MissingMcapError(CloFleetError):
    """The library that writes MCAP files is not installed."""

    def __init__(self) -> None:
        super().__init__("writing MCAP needs the extra: pip install 'clo-fleet[mcap]'")


def export(folder: Path, target: Path) -> int:
    """Write a run as an MCAP file, whole or not at all; returns how many messages it holds.

    Raises:
        MissingMcapError: if the library is not installed.
        NoReplayError: if the folder holds no run that can be looked at.
        EventLogError: if its log is damaged.
    """
    try:
        import mcap.writer  # noqa: F401  # an extra
    except ImportError:
        raise MissingMcapError from None
    scene, events = read_scene(folder), read_events(folder / "events.jsonl")
    with written_whole(target) as temporary, temporary.open("wb") as stream:
        return _write(stream, _messages(scene, events))


Message = tuple[float, str, str, Mapping[str, Any]]  # time [s], topic, type, content


def _write(stream: BinaryIO, messages: Iterator[Message]) -> int:
    from mcap.writer import Writer

    writer: Any = Writer(stream)
    writer.start(profile="", library="clo_fleet")
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    number = 0
    for time, topic, kind, content in messages:
        if kind not in schemas:
            schema = {"title": kind, "type": "object", "properties": SCHEMAS[kind]}
            schemas[kind] = writer.register_schema(kind, "jsonschema", json.dumps(schema).encode())
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", schemas[kind])
        stamp = _nanoseconds(time)
        writer.add_message(channels[topic], stamp, json.dumps(content).encode(), stamp)
        number += 1
    writer.finish()
    return number


def _messages(scene: Mapping[str, Any], events: Sequence[Mapping[str, Any]]) -> Iterator[Message]:
    """Everything in the order of time."""
    yield 0.0, "/building", "foxglove.SceneUpdate", {"deletions": [], "entities": [_building(scene)]}
    radii = {body["id"]: body["radius"] for body in (*scene["robots"], *scene["objects"])}
    said = deque(piece(events)["marks"])
    held: dict[str, str] = {}
    for event in events:
        time = event["t"]
        while said and said[0][0] <= time:
            when, kind, robot, text = said.popleft()
            level = WARNING if kind in WARNINGS else INFO
            log = {
                "timestamp": _stamp(when),
                "level": level,
                "message": text,
                "name": robot or "",
                "file": "",
                "line": 0,
            }
            yield time, "/log", "foxglove.Log", log
        yield time, "/events", "clo_fleet.Event", event
        if event["kind"] == "fact_changed":
            _note(event, scene["holding"], held)
        if event["kind"] == "poses":
            objects = [*event["objects"], *_carried(event, held)]
            entities = [
                _body(time, body, radii.get(body[0], 0.1), height)
                for bodies, height in ((event["robots"], HEIGHT), (objects, HEIGHT / 2))
                for body in bodies
            ]
            yield time, "/fleet", "foxglove.SceneUpdate", {"deletions": [], "entities": entities}
            for name, x, y, heading in event["robots"]:
                content = {"timestamp": _stamp(time), "frame_id": FRAME, "pose": _pose(x, y, 0.0, heading)}
                yield time, f"/robots/{name}/pose", "foxglove.PoseInFrame", content


def _note(event: Mapping[str, Any], holding: Mapping[str, Sequence[int]], held: dict[str, str]) -> None:
    """Who has what in hand now."""
    predicate, *arguments = event["fact"].strip("()").split() or [""]
    if predicate in holding and len(arguments) >= max(holding[predicate]):
        robot, item = (arguments[place - 1] for place in holding[predicate])
        if event["value"]:
            held[item] = robot
        elif held.get(item) == robot:  # the next one has it already, otherwise
            del held[item]


def _carried(event: Mapping[str, Any], held: Mapping[str, str]) -> Iterator[tuple[Any, ...]]:
    """Where objects are that robots carry through corridors: the log says where the robots are."""
    robots = {name: pose for name, *pose in event["robots"]}
    told = {name for name, *_ in event["objects"]}
    for item, robot in sorted(held.items()):
        if robot in robots and item not in told:
            yield (item, *robots[robot])


def _building(scene: Mapping[str, Any]) -> dict[str, Any]:
    walls = [_line(points, GREY, 0.1, loop=True) for room in scene["rooms"] for points in _outlines(room)]
    ways = [_line(corridor["shape"], (*GREY[:3], 0.4), 0.05, loop=False) for corridor in scene["corridors"]]
    return _entity(0.0, "building", lines=[*walls, *ways])


def _outlines(room: Mapping[str, Any]) -> list[Any]:
    return [room["outline"], *room["obstacles"]]


def _body(time: float, body: Sequence[Any], radius: float, height: float) -> dict[str, Any]:
    name, x, y, heading = body
    cylinder = {
        "pose": _pose(x, y, height / 2, heading),
        "size": {"x": 2 * radius, "y": 2 * radius, "z": height},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": _colour(BLUE if height == HEIGHT else DARK),
    }
    text = {
        "pose": _pose(x, y, height + 0.3, 0.0),
        "billboard": True,
        "font_size": 0.4,
        "scale_invariant": False,
        "color": _colour(DARK),
        "text": name,
    }
    return _entity(time, name, cylinders=[cylinder], texts=[text])


def _entity(time: float, name: str, **primitives: list[dict[str, Any]]) -> dict[str, Any]:
    empty: dict[str, Any] = {
        key: []
        for key in ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    }
    own = {"timestamp": _stamp(time), "frame_id": FRAME, "id": name, "lifetime": _stamp(0.0), "frame_locked": False}
    return own | empty | primitives


def _line(
    points: Sequence[Sequence[float]], colour: Sequence[float], thickness: float, *, loop: bool
) -> dict[str, Any]:
    return {
        "type": 1 if loop else 0,
        "pose": _pose(0.0, 0.0, 0.0, 0.0),
        "thickness": thickness,
        "scale_invariant": False,
        "points": [{"x": x, "y": y, "z": 0.0} for x, y in points],
        "color": _colour(colour),
        "colors": [],
        "indices": [],
    }


def _pose(x: float, y: float, z: float, heading: float) -> dict[str, Any]:
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}
    return {"position": {"x": x, "y": y, "z": z}, "orientation": turn}


def _colour(colour: Sequence[float]) -> dict[str, float]:
    return dict(zip("rgba", colour, strict=True))


def _stamp(time: float) -> dict[str, int]:
    seconds, nanoseconds = divmod(_nanoseconds(time), 1_000_000_000)
    return {"sec": seconds, "nsec": nanoseconds}


def _nanoseconds(time: float) -> int:
    return round(time * 1000) * 1_000_000
