"""Facts as numbers, and actions as tuples of them, for what has to be fast.

Each fact becomes two *literals*, numbers that differ in their last bit: it is true (even), it is false (odd). An action
needs literals and makes literals, so that positive and negative conditions, adding and deleting, are one case.
"""

from collections.abc import Iterable

from clo_fleet.clo.task import Action, Condition, Fact

__all__ = ["Code", "Literals"]

Code = tuple[tuple[int, ...], tuple[int, ...]]  # the literals that an action needs, and those that it makes


class Literals:
    """The numbers of facts, given out as they come, and the actions translated so far.

    Attributes:
        facts: the facts by half of their literals.
        numbers: for each fact, the literal that it is true.
        codes: for each translated action, by its identity, what it needs and makes.

    >>> literals = Literals()
    >>> literals.of(Condition(("open", "d1"))), literals.of(Condition(("open", "d1"), positive=False))
    (0, 1)
    """

    __slots__ = ("_actions", "codes", "facts", "numbers")

    def __init__(self) -> None:
        self.facts: list[Fact] = []
        self.numbers: dict[Fact, int] = {}
        self.codes: dict[int, Code] = {}
        self._actions: list[Action] = []  # kept, so that no other action gets the identity of one of them

    def number(self, fact: Fact) -> int:
        """The literal that the fact is true."""
        number = self.numbers.get(fact)
        if number is None:
            number = self.numbers[fact] = 2 * len(self.facts)
            self.facts.append(fact)
        return number

    def of(self, condition: Condition) -> int:
        """The literal that the condition says."""
        number = self.number(condition.fact)
        return number if condition.positive else number + 1

    def all_of(self, conditions: Iterable[Condition]) -> tuple[int, ...]:
        """The literals that the conditions say."""
        return tuple([self.of(condition) for condition in conditions])

    def code(self, action: Action) -> Code:
        """The action's literals. The same object is translated once."""
        return self.codes.get(id(action)) or self.translated(action)

    def translated(self, action: Action) -> Code:
        """The literals of an action that has not been translated."""
        # Nothing is called for facts that have a number: this is most of the cost of linking a plan.
        numbers = self.numbers
        needs, makes = [], []
        for condition in action.needs:
            number = numbers.get(condition.fact)
            if number is None:
                number = self.number(condition.fact)
            needs.append(number if condition.positive else number + 1)
        for fact in action.adds:
            number = numbers.get(fact)
            makes.append(self.number(fact) if number is None else number)
        for fact in action.deletes:
            number = numbers.get(fact)
            makes.append((self.number(fact) if number is None else number) + 1)
        self._actions.append(action)
        code = self.codes[id(action)] = tuple(needs), tuple(makes)
        return code
