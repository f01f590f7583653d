"""From a run's log to what a page needs to show it, small and in pieces that can be appended.

A piece is plain data for JSON:

| key       | holds                                                                                                    |
|-----------|----------------------------------------------------------------------------------------------------------|
| `until`   | the time up to which it tells [s]                                                                        |
| `tracks`  | by body: its samples as bytes in base64 (see below)                                                      |
| `plans`   | by robot: what happened to its plan, in order, each ``[t, what, ...]``                                   |
| `facts`   | what became true or false: ``[t, fact, bool]``                                                           |
| `helps`   | ``[t, helper, helped, fact, names of the dropped steps]``                                                |
| `waits`   | by robot: ``[t, why, for whom]``, an empty reason when it goes on                                        |
| `marks`   | the events to jump to: ``[t, kind, robot or null, text]``                                                |
| `outcome` | ``[outcome, why]`` once the run has ended, else null                                                     |

A sample is four whole numbers: time in tenths of a second, x and y in centimetres, heading in hundredths of a radian,
each as the difference to the body's sample before in this piece, zigzag and variable length (seven bits a byte, the
last ones first).
"""

import base64
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

__all__ = ["piece"]

Event = Mapping[str, Any]
SCALES = (10, 100, 100, 100)  # of t [s], x [m], y [m], heading [rad]


def piece(events: Iterable[Event]) -> dict[str, Any]:
    """What some consecutive events of a log, as JSON objects, add to what is to be shown."""
    found = _Piece()
    for event in events:
        found.until = event["t"]
        if (take := _TAKES.get(event["kind"])) is not None:
            take(found, event)
    return found.plain()


class _Piece:
    """A piece in the making."""

    def __init__(self) -> None:
        self.until = 0.0
        self._tracks: dict[str, bytearray] = {}
        self._last: dict[str, tuple[int, ...]] = {}
        self._plans: dict[str, list[Any]] = {}
        self._facts: list[Any] = []
        self._helps: list[Any] = []
        self._waits: dict[str, list[Any]] = {}
        self._marks: list[Any] = []
        self._outcome: list[str] | None = None

    def plain(self) -> dict[str, Any]:
        """The piece."""
        return {
            "until": self.until,
            "tracks": {body: base64.b64encode(samples).decode() for body, samples in self._tracks.items()},
            "plans": self._plans,
            "facts": self._facts,
            "helps": self._helps,
            "waits": self._waits,
            "marks": self._marks,
            "outcome": self._outcome,
        }

    # ---- what each kind of event adds ----------------------------------------------------------------------

    def _poses(self, event: Event) -> None:
        for name, x, y, heading in (*event["robots"], *event["objects"]):
            sample = tuple(
                round(value * scale) for value, scale in zip((event["t"], x, y, heading), SCALES, strict=True)
            )
            samples = self._tracks.setdefault(name, bytearray())
            for now, then in zip(sample, self._last.get(name, (0, 0, 0, 0)), strict=True):
                _append(samples, now - then)
            self._last[name] = sample

    def _plan_followed(self, event: Event) -> None:
        self._plan(event, "followed", event["steps"])
        again = f", in place of {len(event['superseded'])} left" if event["superseded"] else ""
        self._mark(event, "plan", f"{event['robot']} follows a plan of {len(event['steps'])} steps{again}")

    def _steps_left_out(self, event: Event) -> None:
        names = [name for _, name in event["steps"]]
        why = self._spared(event, names)
        self._plan(event, "dropped", [number for number, _ in event["steps"]], why)
        self._mark(event, "dropped", f"{event['robot']} drops {', '.join(names)}: {why}")

    def _action_called_off(self, event: Event) -> None:
        why = self._spared(event, [event["action"]])
        self._mark(event, "dropped", f"{event['robot']} means to stop {event['action']}: {why}")

    def _also_happened(self, event: Event) -> None:
        self._mark(event, "also", f"{event['action']} also made {event['fact']} true, by {event['by']}")

    def _spared(self, event: Event, names: list[str]) -> str:
        """Note who helped if somebody did; why these steps are not needed."""
        robot, helper = event["robot"], event["by"]
        if helper not in (None, robot):
            self._helps.append([event["t"], helper, robot, event["fact"], names])
            return f"{event['reason']} ({helper} made {event['fact']} true)"
        return f"{event['reason']} ({event['fact']})" if event["fact"] else str(event["reason"])

    def _plan_mended(self, event: Event) -> None:
        self._plan(event, "mended", event["steps"], event["means"])
        added = ", ".join(name for _, name in event["added"])
        self._mark(
            event, "mended", f"{event['robot']} mends its plan ({event['means']}): {added or 'in another order'}"
        )

    def _plan_linked(self, event: Event) -> None:
        self._plan(event, "linked", event["links"], event["watch"])

    def _action_started(self, event: Event) -> None:
        self._plan(event, "started", event["step"], event["action"])
        self._wait(event, "")

    def _action_ended(self, event: Event) -> None:
        self._plan(event, event["ending"], event["step"], event["reason"])
        self._wait(event, "")
        if event["ending"] != "finished":
            reason = f": {event['reason']}" if event["reason"] else ""
            self._mark(event, event["ending"], f"{event['robot']}: {event['action']} {event['ending']}{reason}")

    def _fact_changed(self, event: Event) -> None:
        self._facts.append([event["t"], event["fact"], event["value"]])

    def _waiting(self, event: Event) -> None:
        self._wait(event, event["why"], event.get("on", ()))

    def _rerouted(self, event: Event) -> None:
        self._mark(event, "way", f"{event['robot']} takes another way: {event['why']}")

    def _offer_made(self, event: Event) -> None:
        self._mark(event, "offer", f"{event['robot']} offers {event['object']} to {event['to']}")

    def _plan_failed(self, event: Event) -> None:
        self._mark(event, "failed", f"{event['robot']} gets no plan: {event['reason']}")

    def _repair_failed(self, event: Event) -> None:
        self._mark(event, "failed", f"{event['robot']} cannot repair its plan: {event['why']}")

    def _disturbed(self, event: Event) -> None:
        text = f"{event['disturbance'].replace('_', ' ')}: {event['subject']} {event['detail']}"
        self._mark(event, "disturbed", text)

    def _goals_reached(self, event: Event) -> None:
        self._mark(event, "goals", f"{event['robot']} has reached its goals")

    def _gave_up(self, event: Event) -> None:
        self._mark(event, "failed", f"{event['robot']} gives up: {event['outcome']}, {event['why']}")

    def _run_ended(self, event: Event) -> None:
        self._outcome = [event["outcome"], event["why"]]
        self._mark(event, "end", f"the run ends: {event['outcome']}, {event['why']}")

    # ---- where it goes -------------------------------------------------------------------------------------

    def _plan(self, event: Event, what: str, *more: Any) -> None:
        self._plans.setdefault(event["robot"], []).append([event["t"], what, *more])

    def _wait(self, event: Event, why: str, on: Sequence[str] = ()) -> None:
        waits = self._waits.setdefault(event["robot"], [])
        if not waits or waits[-1][1:] != [why, list(on)]:
            waits.append([event["t"], why, list(on)])

    def _mark(self, event: Event, what: str, text: str) -> None:
        self._marks.append([event["t"], what, event.get("robot"), text])


_TAKES = {
    name: getattr(_Piece, f"_{name}")
    for name in (
        *("poses", "plan_followed", "steps_left_out", "plan_mended", "plan_linked", "action_started"),
        *("action_called_off", "action_ended", "also_happened"),
        *(
            "fact_changed",
            "waiting",
            "rerouted",
            "offer_made",
            "plan_failed",
            "repair_failed",
            "disturbed",
            "goals_reached",
        ),
        *("gave_up", "run_ended"),
    )
}


def _append(samples: bytearray, value: int) -> None:
    """A whole number, zigzag and variable length."""
    rest = value << 1 if value >= 0 else (-value << 1) - 1
    while rest > 0x7F:
        samples.append(rest & 0x7F | 0x80)
        rest >>= 7
    samples.append(rest)
