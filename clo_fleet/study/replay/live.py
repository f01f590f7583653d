"""A run on a page while it goes on: a server on loopback that gives the page what has happened since it last asked.

Only this machine is listened to, and only requests that name it as their host are answered: a page of another site
whose name has been pointed here gets nothing.
"""

import contextlib
import http.server
import json
import threading
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

from clo_fleet.study.event_log import Recorded, json_of
from clo_fleet.study.replay.page import page
from clo_fleet.study.replay.recording import piece
from clo_fleet.study.replay.scene import scene
from clo_fleet.study.run import Run

__all__ = ["LiveServer", "serving"]

HOST = "127.0.0.1"
EVENTS = "events"


class LiveServer:
    """Serves one run; from ``serving``."""

    def __init__(self, server: http.server.ThreadingHTTPServer) -> None:
        self._server = server
        self._ended = threading.Event()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self._server.server_port}/"

    def wait(self) -> None:
        """Go on serving until Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            self._ended.wait()


@contextlib.contextmanager
def serving(run: Run) -> Iterator[LiveServer]:
    """Serve the run, on a free port of loopback, while the block lasts."""
    plain_scene = scene(run.mission.world)

    def whole() -> str:
        world, strategy = run.mission.world, run.mission.strategy
        begun = {"kind": "run_started", "world": world.name, "strategy": strategy.name, "seed": world.seed}
        return page(plain_scene, [begun], live=EVENTS)

    handler = type("Handler", (_Handler,), {"whole": staticmethod(whole), "since": staticmethod(run.log_since)})
    with http.server.ThreadingHTTPServer((HOST, 0), handler) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield LiveServer(server)
        finally:
            server.shutdown()
            thread.join()


class _Handler(http.server.BaseHTTPRequestHandler):
    """Answers for one run."""

    whole: Callable[[], str]
    since: Callable[[int], tuple[Recorded, ...]]

    def do_GET(self) -> None:
        """The page, or what happened since event ``from``."""
        host, _, port = self.headers.get("Host", "").partition(":")
        address: Any = self.server.server_address
        asked = urlsplit(self.path)
        if host not in (HOST, "localhost") or port != str(address[1]):
            self.send_error(403)
        elif asked.path == "/":
            self._answer("text/html; charset=utf-8", self.whole())
        elif asked.path == f"/{EVENTS}":
            begin = parse_qs(asked.query).get("from", ["0"])[0]
            number = int(begin) if begin.isdecimal() and len(begin) < 19 else 0
            events = self.since(number)
            found = piece(json_of(*event) for event in events) | {"next": number + len(events)}
            self._answer("application/json", json.dumps(found))
        else:
            self.send_error(404)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # the base class's name for it
        """Nothing: the terminal belongs to the run."""

    def _answer(self, kind: str, text: str) -> None:
        content = text.encode()
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        with contextlib.suppress(ConnectionError):  # whoever asked has left
            self.wfile.write(content)
