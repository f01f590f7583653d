"""A run as one page that opens from disk, without a network: its scene, its recording, and what shows them.

The data lies in the page as base64 of gzipped JSON, so that no text of a run can become markup or script; the script
writes texts as text only, and the page's policy lets it load and call nothing.
"""

import base64
import gzip
import hashlib
import html
import json
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from clo_fleet.errors import CloFleetError
from clo_fleet.study.atomic import write_whole
from clo_fleet.study.event_log import read_events
from clo_fleet.study.replay.recording import piece
from clo_fleet.study.replay.scene import SCENE_FORMAT

__all__ = ["NoReplayError", "page", "read_scene", "view"]

SCRIPTS = ("data.js", "drawing.js", "panel.js", "main.js")


class NoReplayError(CloFleetError):
    """A folder holds no run that can be looked at.

    Attributes:
        folder: the folder.
    """

    def __init__(self, folder: Path, reason: str) -> None:
        super().__init__(f"{folder}: {reason}; make a run with clo-fleet run WORLD --out {folder}")
        self.folder = folder


def view(folder: Path) -> Path:
    """Write ``run.html`` into a run's folder, whole or not at all; a run that was cut short is shown as far as it got.

    Raises:
        NoReplayError: if the folder holds no run that can be looked at.
        EventLogError: if the log is damaged.
    """
    scene = read_scene(folder)
    target = folder / "run.html"
    write_whole(target, page(scene, read_events(folder / "events.jsonl")).encode())
    return target


def read_scene(folder: Path) -> dict[str, Any]:
    """The scene of a run that has a log.

    Raises:
        NoReplayError: if the folder holds no ``events.jsonl``, or no ``scene.json`` of this format.
    """
    for name in ("scene.json", "events.jsonl"):
        if not (folder / name).is_file():
            raise NoReplayError(folder, f"has no {name}")
    try:
        scene = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
    except ValueError as error:
        raise NoReplayError(folder, f"its scene.json is no JSON ({error})") from None
    if not isinstance(scene, dict) or scene.get("format") != SCENE_FORMAT:
        raise NoReplayError(folder, f"its scene.json is not of the format {SCENE_FORMAT}")
    return scene


def page(scene: Mapping[str, Any], events: list[dict[str, Any]], live: str = "") -> str:
    """The page.

    Args:
        scene: of the run.
        events: of the log so far.
        live: the path under which a server has what happens next; empty for a page that is complete.
    """
    begin = next((event for event in events if event["kind"] == "run_started"), {})
    run = {key: begin.get(key, "") for key in ("world", "strategy", "seed", "version")}
    data = {
        "scene": scene,
        "run": run,
        "piece": piece(events) if not live else None,
        "live": live,
    }
    packed = base64.b64encode(gzip.compress(json.dumps(data, separators=(",", ":")).encode(), mtime=0)).decode()
    here = files("clo_fleet.study.replay")
    script = "\n".join((here / name).read_text(encoding="utf-8") for name in SCRIPTS)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    values = {
        "title": html.escape(f"{run['world']}, {run['strategy']}"),
        "policy": f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:"
        + ("; connect-src 'self'" if live else ""),
        "style": (here / "page.css").read_text(encoding="utf-8"),
        "data": packed,
        "script": script,
    }
    text = (here / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\[\[(\w+)\]\]", lambda found: values[found[1]], text)
