"""Action schemas and the domain that holds them, and how a schema becomes a ground action.

| PDDL                     | here                                             |
|--------------------------|--------------------------------------------------|
| `:action`                | `Schema`                                         |
| ground operator          | `clo_fleet.clo.task.Action`                      |
| `:predicates`            | `Domain.predicates`: name and parameter types    |
| numeric `:functions`     | `Domain.functions`, used for costs only          |
| `(increase (total-cost)` | `Schema.cost`: a number, or a lifted cost term   |

A lifted atom is a tuple like a fact, with variables (``?r``) among its terms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from clo_fleet.clo.task import Action, Condition, Fact, fact_text
from clo_fleet.errors import CloFleetError

__all__ = ["EQUALS", "OBJECT", "Atom", "Costs", "Domain", "GroundingError", "Schema", "Typed", "bind"]

EQUALS = "="
OBJECT = "object"

Atom = tuple[str, ...]
Costs = Mapping[Fact, int]
"""What a cost term is worth in a task: ``("travel-time", "l1", "l2")`` to tenths of a second."""
Typed = tuple[tuple[str, str], ...]
Signatures = tuple[tuple[str, tuple[str, ...]], ...]


class GroundingError(CloFleetError):
    """A step cannot be grounded: unknown schema, wrong number of arguments, or a cost without a value.

    Attributes:
        step: the step as asked for, schema name first.
    """

    def __init__(self, step: Fact, reason: str) -> None:
        super().__init__(f"cannot ground {fact_text(step)}: {reason}")
        self.step = step


@dataclass(frozen=True, slots=True, kw_only=True)
class Schema:
    """An action with variables.

    Attributes:
        parameters: variables with their types, in the order of the ground action's arguments.
        needs: lifted preconditions, static ones included.
        adds, deletes: lifted effects.
        cost: a number, or a cost term whose value the task supplies.
    """

    name: str
    parameters: Typed
    needs: tuple[Condition, ...]
    adds: tuple[Atom, ...]
    deletes: tuple[Atom, ...]
    cost: int | Atom = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """What a PDDL domain says.

    Attributes:
        types: each type with its supertype; ``object`` is above all and not listed.
        constants: objects that every task of the domain has, with their types.
        predicates, functions: names with the types of their parameters.
        exogenous: predicates that no schema changes and that may change all the same.
        variables: the names of the predicates' parameters.
        text: the PDDL that it was read from.
    """

    name: str
    types: Typed
    constants: Typed
    predicates: Signatures
    functions: Signatures
    schemas: tuple[Schema, ...]
    exogenous: frozenset[str] = frozenset()
    variables: tuple[tuple[str, tuple[str, ...]], ...] = field(default=(), compare=False)
    text: str = field(default="", repr=False, compare=False)

    @property
    def static(self) -> frozenset[str]:
        """Predicates whose facts hold for a whole task, equality included.

        They decide which actions exist, so they are no preconditions of a ground action: a causal link on a fact
        that cannot change would only be in the way.
        """
        changed = {atom[0] for schema in self.schemas for atom in schema.adds + schema.deletes}
        return frozenset(name for name, _ in self.predicates) - changed - self.exogenous | {EQUALS}

    def has_type(self, type_: str) -> bool:
        """Whether there is such a type."""
        return type_ == OBJECT or any(name == type_ for name, _ in self.types)

    def is_a(self, type_: str, above: str) -> bool:
        """Whether ``type_`` is ``above`` or one of its subtypes."""
        if type_ in (above, OBJECT):
            return type_ == above
        return self.is_a(dict(self.types)[type_], above)

    def with_costs(self, costs: Mapping[str, Atom]) -> "Domain":
        """The domain with these cost terms for its actions, by schema."""
        schemas = tuple(replace(schema, cost=costs.get(schema.name, schema.cost)) for schema in self.schemas)
        functions = dict(self.functions)
        for schema in self.schemas:
            if schema.name in costs:
                types, (name, *terms) = dict(schema.parameters), costs[schema.name]
                functions.setdefault(name, tuple(types[term] for term in terms))
        return replace(self, schemas=schemas, functions=tuple(functions.items()))

    def ground(self, name: str, args: tuple[str, ...], costs: Costs) -> Action:
        """The schema's action for these objects, without its static preconditions.

        Raises:
            GroundingError: if there is no such schema, it takes another number of arguments, or ``costs`` lacks
                the value of its cost term.
        """
        step = (name, *args)
        schema = next((schema for schema in self.schemas if schema.name == name), None)
        if schema is None:
            raise GroundingError(step, f"domain {self.name} has no such action")
        if len(args) != len(schema.parameters):
            raise GroundingError(step, f"expected {len(schema.parameters)} arguments, got {len(args)}")
        values = {variable: value for (variable, _), value in zip(schema.parameters, args, strict=True)}
        cost = schema.cost
        if not isinstance(cost, int):
            term = bind(cost, values)
            if term not in costs:
                raise GroundingError(step, f"the task gives no value for {fact_text(term)}")
            cost = costs[term]
        static = self.static
        needs = (Condition(bind(n.fact, values), n.positive) for n in schema.needs if n.fact[0] not in static)
        return Action(
            schema=name,
            args=args,
            needs=tuple(dict.fromkeys(needs)),
            adds=frozenset(bind(atom, values) for atom in schema.adds),
            deletes=frozenset(bind(atom, values) for atom in schema.deletes),
            cost=cost,
        )


def bind(atom: Atom, values: Mapping[str, str]) -> Fact:
    """The atom with its variables replaced; what has no value stays.

    >>> bind(("at-robot", "?r", "?a"), {"?r": "r1", "?a": "l3"})
    ('at-robot', 'r1', 'l3')
    """
    return (atom[0], *(values.get(term, term) for term in atom[1:]))
