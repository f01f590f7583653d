"""Seeded episodes: a plan under way, and then something that nobody planned.

An episode follows from the seed, the problem's label and the episode's number alone, so that any one can be looked at
again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from random import Random

from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import Plan, number
from clo_fleet.clo.task import Action, Fact, apply, unmet

__all__ = ["Episode", "Episodes", "Kind"]

MOST_FLIPS = 3  # facts that turn at once, without any action
TRIES = 20  # to find a surprise that changes something


class Kind(Enum):
    """Who or what brings a surprise about."""

    FOREIGN = "actions of others"
    OWN = "an own later action, by another"
    FLIP = "facts turn"


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """A surprise in the middle of a plan.

    Attributes:
        number: its number, from 0.
        kind: what kind of surprise.
        size: how many actions, or facts that turn.
        after: how many steps of the plan had been done.
        rest: the steps left.
        before: the state that the plan expected.
        state: the state that is found.
        actions: what the others did.
    """

    number: int
    kind: Kind
    size: int
    after: int
    rest: Plan
    before: frozenset[Fact]
    state: frozenset[Fact]
    actions: tuple[Action, ...]

    @property
    def changed(self) -> frozenset[Fact]:
        """The facts that are not as expected."""
        return self.before ^ self.state


class Episodes:
    """The episodes of one plan; each third, about, of one kind.

    Args:
        label: the problem's name, one of its own.
        state: where the plan starts.
        plan: an executable plan, of at least one step.
        operators: what others can do.
        seed: the study's seed.
        sizes: how many actions others do at once.
    """

    def __init__(
        self,
        label: str,
        state: frozenset[Fact],
        plan: Sequence[Action],
        *,
        operators: Operators,
        seed: int,
        sizes: Sequence[int],
    ) -> None:
        self._label = label
        self._plan = number(plan)
        self._operators = operators
        self._seed = seed
        self._sizes = tuple(sizes)
        self._states = [state]
        for action in plan:
            self._states.append(apply(self._states[-1], action))
        actions = [operator.action for operator in operators.all]
        changing = {fact for action in actions for fact in action.adds | action.deletes}
        self._facts = sorted(changing & (state | {fact for action in actions for fact in action.adds}))

    def episode(self, place: int) -> Episode:
        """The episode of that number."""
        random = Random(f"{self._seed}/{self._label}/{place}")
        kind = random.choice(list(Kind))
        after = random.randrange(len(self._plan))
        before, rest = self._states[after], self._plan[after:]
        for _ in range(TRIES):
            actions: tuple[Action, ...] = ()
            state = before
            match kind:
                case Kind.FOREIGN:
                    size = random.choice(self._sizes)
                    actions = self._foreign(random, before, size)
                case Kind.OWN:
                    size = 1
                    later = [step.action for step in rest[1:] if not unmet(step.action, before)]
                    actions = (random.choice(later or [rest[0].action]),)
                case Kind.FLIP:
                    size = min(random.randint(1, MOST_FLIPS), len(self._facts))
                    state ^= frozenset(random.sample(self._facts, size))
            for action in actions:
                state = apply(state, action)
            if state != before:
                break
        return Episode(
            number=place, kind=kind, size=size, after=after, rest=rest, before=before, state=state, actions=actions
        )

    def _foreign(self, random: Random, state: frozenset[Fact], size: int) -> tuple[Action, ...]:
        """Actions that others can do one after the other."""
        actions: list[Action] = []
        for _ in range(size):
            possible = list(self._operators.applicable(self._operators.state(state)))
            if not possible:
                break
            actions.append(random.choice(possible).action)
            state = apply(state, actions[-1])
        return tuple(actions)
