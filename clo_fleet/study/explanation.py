"""What is to be said of a plan: what holds it together, what would help it, and what a surprise makes of it.

Everything is said in numbers and texts, so that the tables, the picture and the JSON document come from the same
value. The document (``to_json``) is of the format ``clo-fleet/explanation/1``: one object whose keys are the fields of
`Explanation`, nested as the dataclasses here are, tuples as lists. Steps go by their number in the plan, from 1; steps
that a repair adds are numbered on from the plan's last one. A consumer is such a number or ``"goal"``. Facts are
texts as in PDDL, ``(not (holding o2))`` if they are to be false. ``repair`` is ``null`` unless something changed by
itself.
"""

import json
from dataclasses import asdict, dataclass

__all__ = [
    "EXPLANATION_FORMAT",
    "GOAL",
    "ChangeRow",
    "Explanation",
    "FateRow",
    "GuardRow",
    "LinkRow",
    "OpportunityRow",
    "Place",
    "RepairRow",
    "StepRow",
    "WindowRow",
]

EXPLANATION_FORMAT = "clo-fleet/explanation/1"
GOAL = "goal"

Place = int | str
"""A step's number, or ``GOAL``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRow:
    """A step of the plan. ``supports``: the steps, or the goal, that need what it does; none if it is ``done``."""

    step: int
    action: str
    cost: int
    done: bool
    supports: tuple[Place, ...]


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class LinkRow:
    """Step ``producer`` makes ``fact`` hold for ``consumer``."""

    producer: int
    fact: str
    consumer: Place


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardRow:
    """A fact that holds now and has to stay so until the last of ``needed_by`` has used it."""

    fact: str
    needed_by: tuple[Place, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowRow:
    """Coming true before one of the steps ``first`` to ``last`` would still help."""

    first: int
    last: int


@dataclass(frozen=True, slots=True, kw_only=True)
class OpportunityRow:
    """A fact that would make steps needless.

    Attributes:
        saves: the cost that would go if it turned true now.
        saves_steps: how many steps would go.
        windows: when its turning true would help.
    """

    fact: str
    saves: int
    saves_steps: int
    windows: tuple[WindowRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeRow:
    """Something that happened by itself.

    Attributes:
        value: what the fact is now.
        news: whether it was not so before.
        meaning: what the plan made of it: an opportunity, a broken guard, or nothing.
    """

    fact: str
    value: bool
    news: bool
    meaning: str

    def __str__(self) -> str:
        value = "true" if self.value else "false"
        if not self.news:
            return f"{self.fact} was {value} already"
        return f"{self.fact} turned {value} by itself: {self.meaning}"


@dataclass(frozen=True, slots=True, kw_only=True)
class FateRow:
    """What becomes of a step: ``kept``, ``dropped`` or ``added``.

    Attributes:
        reason: why it was dropped or added.
        because: the facts that brought it about, where they are known.
    """

    step: int
    action: str
    cost: int
    fate: str
    reason: str
    because: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RepairRow:
    """What the changes make of the plan.

    Attributes:
        changes: what happened by itself.
        refused: why there is no repaired plan; empty if there is one.
        means: what the repair took at most: deletion, relinking, rebinding or bridge; empty if it was refused.
        steps: the steps left before, dropped ones included, and the added ones, each with its fate.
        cost_before, cost_after: of the steps that were left, and of those that are left, if the plan was repaired.
        links, guards: what holds the repaired plan together.
        missing: what nothing brings about any more, for which consumers, if the repair was refused.
    """

    changes: tuple[ChangeRow, ...]
    refused: str
    means: str
    steps: tuple[FateRow, ...]
    cost_before: int
    cost_after: int | None
    links: tuple[LinkRow, ...]
    guards: tuple[GuardRow, ...]
    missing: tuple[GuardRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """All that is said of a plan.

    Attributes:
        format: the version of this schema.
        task: the name of the PDDL problem.
        source: where the plan comes from.
        cost: of all steps.
        executed: how many steps have been done; links, opportunities and guards are those of the others.
        steps: the whole plan.
        opportunities: the most valuable first.
        repair: what became of the plan, if something changed by itself.
    """

    format: str
    task: str
    source: str
    cost: int
    executed: int
    steps: tuple[StepRow, ...]
    links: tuple[LinkRow, ...]
    opportunities: tuple[OpportunityRow, ...]
    guards: tuple[GuardRow, ...]
    repair: RepairRow | None

    @property
    def cost_left(self) -> int:
        """The cost of the steps that have not been done."""
        return sum(row.cost for row in self.steps if not row.done)

    def to_json(self) -> str:
        """The explanation as JSON text."""
        return json.dumps(asdict(self), ensure_ascii=False, indent=2) + "\n"
