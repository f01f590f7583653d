"""What a problem of unified-planning says, as plain values with parameters.

| here                | unified-planning                                       |
|---------------------|--------------------------------------------------------|
| `Literal`           | `FluentExp` of a Boolean fluent, or `Not` of it        |
| `Same`              | `Equals` of two objects                                |
| `AllOf`, `AnyOf`    | `And`, `Or`, `Implies`, `Iff`, `Forall`, `Exists`      |
| `LiftedAction`      | `InstantaneousAction`                                  |
| `Change`            | `Effect`, conditional ones and those for all objects   |
| `LiftedAction.cost` | `MinimizeActionCosts.get_action_cost`; 1 without it    |

unified-planning has compilers and a grounder of its own. They are not used: its grounder looks at all bindings there
are, and its removers of disjunctions and of conditional effects split an action before the static conditions are
decided that make most of the cases impossible. Tests compare the results on problems small enough for both.
"""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import product
from types import MappingProxyType
from typing import Any as Any

from unified_planning.model import Problem
from unified_planning.model.operators import OperatorKind

from clo_fleet.clo.task import Fact
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.formulas import FALSE, TRUE, AllOf, AnyOf, Atom, Formula, Literal, Same, Term, negated
from clo_fleet.planning.lifted_task import Change, LiftedAction, LiftedTask

__all__ = ["UnsupportedProblemError", "lifted"]

MOST_PARTS = 100_000  # that a quantifier, or an effect for all objects, may expand to
_SUPPORTED = {
    *("ACTION_BASED", "FLAT_TYPING", "HIERARCHICAL_TYPING"),
    *("NEGATIVE_CONDITIONS", "DISJUNCTIVE_CONDITIONS", "EQUALITIES", "EXISTENTIAL_CONDITIONS", "UNIVERSAL_CONDITIONS"),
    *("CONDITIONAL_EFFECTS", "FORALL_EFFECTS", "STATIC_FLUENTS_IN_BOOLEAN_ASSIGNMENTS"),
    *("FLUENTS_IN_BOOLEAN_ASSIGNMENTS", "PLAN_LENGTH", "MAKESPAN", "FINAL_VALUE", "ACTIONS_COST"),
    *("STATIC_FLUENTS_IN_ACTIONS_COST", "INT_NUMBERS_IN_ACTIONS_COST", "REAL_NUMBERS_IN_ACTIONS_COST"),
    # numbers may be counted up, as long as no condition asks for them
    *("INT_FLUENTS", "REAL_FLUENTS", "INCREASE_EFFECTS", "DECREASE_EFFECTS", "UNDEFINED_INITIAL_NUMERIC"),
    *("SIMPLE_NUMERIC_PLANNING", "GENERAL_NUMERIC_PLANNING"),
    *("STATIC_FLUENTS_IN_NUMERIC_ASSIGNMENTS", "FLUENTS_IN_NUMERIC_ASSIGNMENTS"),
}

Terms = Mapping[Any, Term]
"""What parameters and the variables of quantifiers stand for."""


class UnsupportedProblemError(CloFleetError):
    """A problem uses what has no ground form here.

    Attributes:
        place: where, such as ``action move``.
        what: what it uses.
    """

    def __init__(self, place: str, what: str) -> None:
        super().__init__(f"{place}: not supported: {what}")
        self.place = place
        self.what = what


def lifted(problem: Any) -> LiftedTask:
    """The problem's actions, facts, goal and costs.

    Costs that are no whole numbers are all multiplied by the same number.

    Raises:
        UnsupportedProblemError: if it uses more than Boolean fluents and action costs.
    """
    try:
        return _Lifting(problem).task()
    except RecursionError as error:
        raise UnsupportedProblemError("the problem", "conditions that nest so deeply") from error


class _Lifting:
    """Reads one problem; ``_place`` says where it is reading."""

    def __init__(self, problem: Any) -> None:
        self._place = "the problem"
        if not isinstance(problem, Problem):
            raise self._unsupported(f"a {type(problem).__name__}")
        if features := sorted(problem.kind.features - _SUPPORTED):
            raise self._unsupported(", ".join(feature.replace("_", " ").lower() for feature in features))
        self._problem = problem
        metrics = [metric for metric in problem.quality_metrics if metric.is_minimize_action_costs()]
        self._metric = metrics[0] if metrics else None
        self._changing = {effect.fluent.fluent().name for action in problem.actions for effect in action.effects}

    def task(self) -> LiftedTask:
        problem = self._problem
        self._place = "the goal"
        goal = self._all(problem.goals, {})
        actions = {action.name: self._action(action) for action in problem.actions}
        prices = {action.name: self._price(action) for action in problem.actions}
        self._place = "the initial state"
        names = {price[0] for price in prices.values() if isinstance(price, tuple)}
        facts, costs = set(), {}
        for expression, value in self._initial(names):
            atom = self._fact(expression)
            if value.is_true():
                facts.add(atom)
            elif atom[0] in names:
                costs[atom] = Fraction(value.constant_value())
        amounts = [*costs.values(), *(price for price in prices.values() if isinstance(price, Fraction))]
        scale = math.lcm(*(amount.denominator for amount in amounts))
        return LiftedTask(
            name=problem.name or "",
            predicates=frozenset(fluent.name for fluent in problem.fluents if fluent.type.is_bool_type()),
            facts=frozenset(facts),
            goal=goal,
            actions=tuple(
                replace(action, cost=self._whole(price * scale) if isinstance(price, Fraction) else price)
                for action, price in zip(actions.values(), prices.values(), strict=True)
            ),
            costs={term: self._whole(cost * scale) for term, cost in costs.items()},
        )

    def _initial(self, numbers: Collection[Term]) -> Iterator[tuple[Any, Any]]:
        """The ground fluents that are true, or of the numeric fluents named, with their values; perhaps more."""
        yield from self._problem.explicit_initial_values.items()
        for fluent, default in self._problem.fluents_defaults.items():
            if default.is_true() or fluent.name in numbers:
                for args in self._bindings([parameter.type for parameter in fluent.signature]):
                    yield fluent(*args), self._problem.initial_value(fluent(*args))

    def _action(self, action: Any) -> LiftedAction:
        self._place = f"action {action.name}"
        for parameter in action.parameters:
            if not parameter.type.is_user_type():
                raise self._unsupported(f"parameter {parameter.name} of type {parameter.type}")
        terms = {parameter: place for place, parameter in enumerate(action.parameters)}
        return LiftedAction(
            name=action.name,
            parameters=tuple(
                tuple(object.name for object in self._problem.objects(parameter.type))
                for parameter in action.parameters
            ),
            needs=self._all(action.preconditions, terms),
            changes=tuple(change for effect in action.effects for change in self._changes(effect, terms)),
        )

    def _changes(self, effect: Any, terms: Terms) -> Iterator[Change]:
        """What an effect changes; numbers that are counted up are left out, for no condition asks for them."""
        if not effect.fluent.fluent().type.is_bool_type():
            return
        for extended in self._extended(effect.forall, terms):
            atom = self._atom(effect.fluent, extended)
            when = self._formula(effect.condition, extended)
            value = self._formula(effect.value, extended)
            for becomes, formula in ((True, value), (False, negated(value))):
                if formula == TRUE or when == TRUE:
                    yield Change(atom, becomes, when if formula == TRUE else formula)
                elif formula != FALSE:
                    yield Change(atom, becomes, AllOf((when, formula)))

    def _price(self, action: Any) -> Fraction | Atom:
        """The cost of an action: a number, or the term that says it."""
        self._place = f"the cost of action {action.name}"
        if self._metric is None:
            return Fraction(1)
        cost = self._metric.get_action_cost(action)
        if cost is None:
            return Fraction(0)
        cost = cost.simplify()
        if cost.is_fluent_exp() and cost.fluent().name not in self._changing:
            return self._atom(cost, {parameter: place for place, parameter in enumerate(action.parameters)})
        if not (cost.is_int_constant() or cost.is_real_constant()):
            raise self._unsupported(f"{cost}")
        return Fraction(cost.constant_value())

    def _whole(self, cost: Fraction) -> int:
        if cost < 0:
            raise self._unsupported(f"a cost below zero, {cost}")
        return int(cost)

    def _all(self, conditions: Iterable[Any], terms: Terms) -> Formula:
        return AllOf(tuple(self._formula(condition, terms) for condition in conditions))

    def _formula(self, node: Any, terms: Terms) -> Formula:
        kind = node.node_type
        if kind in _CONNECTIVES:
            return _CONNECTIVES[kind](tuple(self._formula(arg, terms) for arg in node.args))
        match kind:
            case OperatorKind.BOOL_CONSTANT:
                return TRUE if node.is_true() else FALSE
            case OperatorKind.FLUENT_EXP if node.fluent().type.is_bool_type():
                return Literal(self._atom(node, terms))
            case OperatorKind.EQUALS if all(arg.type.is_user_type() for arg in node.args):
                return Same(self._term(node.arg(0), terms), self._term(node.arg(1), terms))
            case OperatorKind.EXISTS | OperatorKind.FORALL:
                combined = AnyOf if kind is OperatorKind.EXISTS else AllOf
                every = self._extended(node.variables(), terms)
                return combined(tuple(self._formula(node.arg(0), extended) for extended in every))
        raise self._unsupported(f"the condition {node}")

    def _atom(self, expression: Any, terms: Terms) -> Atom:
        return (expression.fluent().name, *(self._term(arg, terms) for arg in expression.args))

    def _fact(self, expression: Any) -> Fact:
        return (expression.fluent().name, *(str(self._term(arg, {})) for arg in expression.args))

    def _term(self, node: Any, terms: Terms) -> Term:
        match node.node_type:
            case OperatorKind.OBJECT_EXP:
                return str(node.object().name)
            case OperatorKind.PARAM_EXP:
                return terms[node.parameter()]
            case OperatorKind.VARIABLE_EXP:
                return terms[node.variable()]
        raise self._unsupported(f"the term {node}")

    def _extended(self, variables: Iterable[Any], terms: Terms) -> Iterator[Terms]:
        """The terms with every choice of objects for the variables."""
        variables = tuple(variables)
        for objects in self._bindings([variable.type for variable in variables]):
            yield {**terms, **{variable: object.name for variable, object in zip(variables, objects, strict=True)}}

    def _bindings(self, types: Iterable[Any]) -> Iterator[tuple[Any, ...]]:
        """Every choice of an object for each type."""
        choices = [tuple(self._problem.objects(type_)) for type_ in types]
        if math.prod(map(len, choices)) > MOST_PARTS:
            raise self._unsupported(f"more than {MOST_PARTS:,} objects, or combinations of them, at once")
        return product(*choices)

    def _unsupported(self, what: str) -> UnsupportedProblemError:
        return UnsupportedProblemError(self._place, what)


def _implication(parts: tuple[Formula, ...]) -> Formula:
    return AnyOf((negated(parts[0]), parts[1]))


def _equivalence(parts: tuple[Formula, ...]) -> Formula:
    return AnyOf((AllOf(parts), AllOf(tuple(map(negated, parts)))))


_CONNECTIVES: Mapping[OperatorKind, Callable[[tuple[Formula, ...]], Formula]] = MappingProxyType(
    {
        OperatorKind.AND: AllOf,
        OperatorKind.OR: AnyOf,
        OperatorKind.NOT: lambda parts: negated(parts[0]),
        OperatorKind.IMPLIES: _implication,
        OperatorKind.IFF: _equivalence,
    }
)
