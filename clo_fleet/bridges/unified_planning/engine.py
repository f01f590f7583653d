"""The engine ``clo`` of unified-planning: repairs a plan for a problem whose initial values are the present.

How a repair ends, in unified-planning's words:

| outcome                                          | `PlanGenerationResultStatus`                              |
|--------------------------------------------------|-----------------------------------------------------------|
| repaired; ``metrics["means"]`` says how          | `SOLVED_SATISFICING`: valid, not promised to be the best  |
| refused, and it is proven that no plan exists    | `UNSOLVABLE_PROVEN`                                       |
| refused otherwise                                | `UNSOLVABLE_INCOMPLETELY`: a planner may well find a plan |
| refused, not proven, and there is a ``fallback`` | whatever the fallback says                                |

A search that came to the end of its budget is neither `TIMEOUT` nor `MEMOUT`: budgets count operations, so that a
question has the same answer on every machine, and more time or memory would change nothing.

The metrics say how many steps were kept, dropped and added (counted by name, wherever they stand in the plan), by which
means, the effort of the search (states and conditions that it looked at), how many conditions have another support than
before, whether the problem had to be grounded, and milliseconds. The log messages name each step that was dropped, and
why, and each that is new.

Other operation modes are called with a time limit and a stream to write to; `PlanRepairerMixin.repair` is not. Here
both are parameters of the engine, and concern the fallback.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from time import perf_counter
from typing import IO, Any

from unified_planning.engines import Credits, Engine, OptimalityGuarantee
from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.engines.mixins import PlanRepairerMixin
from unified_planning.exceptions import UPNoRequestedEngineAvailableException, UPUsageError
from unified_planning.model import ProblemKind
from unified_planning.model.problem_kind_versioning import LATEST_PROBLEM_KIND_VERSION
from unified_planning.plans import PlanKind

from clo_fleet.bridges.unified_planning.groundings import Groundings
from clo_fleet.bridges.unified_planning.question import ForeignPlanError, Question, names_of
from clo_fleet.clo.links import causal_links
from clo_fleet.clo.repair import Repaired, repair
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.grounding import GroundingError
from clo_fleet.planning.lifting import UnsupportedProblemError

__all__ = ["CloRepairer", "ForeignPlanError", "UnsupportedError"]

FEATURES = frozenset(
    {
        "ACTION_BASED",
        "FLAT_TYPING",
        "HIERARCHICAL_TYPING",
        "NEGATIVE_CONDITIONS",
        "DISJUNCTIVE_CONDITIONS",
        "EQUALITIES",
        "EXISTENTIAL_CONDITIONS",
        "UNIVERSAL_CONDITIONS",
        "CONDITIONAL_EFFECTS",
        "FORALL_EFFECTS",
        "STATIC_FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "ACTIONS_COST",
        "STATIC_FLUENTS_IN_ACTIONS_COST",
        "INT_NUMBERS_IN_ACTIONS_COST",
        "REAL_NUMBERS_IN_ACTIONS_COST",
        "PLAN_LENGTH",
    }
)


class UnsupportedError(CloFleetError, UPUsageError):  # type: ignore[misc]  # ships no types
    """A problem or plan is of a kind that cannot be repaired here.

    Attributes:
        what: what is not supported: unified-planning's names of features, or a sentence.
    """

    def __init__(self, what: Iterable[str]) -> None:
        self.what = tuple(what)
        super().__init__(f"clo does not support {', '.join(self.what)}")


class CloRepairer(Engine, PlanRepairerMixin):  # type: ignore[misc]  # ships no types
    """Repairs plans along their causal links; asks a planner only if told to.

    An engine remembers how it grounded the last few problems: keep one for all repairs of a plan's execution.

    Args:
        improve: whether to look for shorter and cheaper ways as well.
        fallback: a planner of unified-planning by name, such as ``fast-downward``, to be asked for a new plan where the
            repair is refused.
        fallback_params: the parameters of that planner.
        timeout: seconds for a whole call. Repairs are short and budgeted in operations: only the fallback is stopped.
        output_stream: where the fallback writes what it prints.
    """

    def __init__(
        self,
        improve: bool = False,
        fallback: str | None = None,
        fallback_params: Mapping[str, object] | None = None,
        timeout: float | None = None,
        output_stream: IO[str] | None = None,
    ) -> None:
        Engine.__init__(self)
        PlanRepairerMixin.__init__(self)
        self._improve = improve
        self._fallback = fallback
        self._fallback_params = dict(fallback_params or {})
        self._timeout = timeout
        self._output_stream = output_stream
        self._groundings = Groundings()

    @property
    def name(self) -> str:
        """The engine's name in results."""
        return "clo"

    @staticmethod
    def supported_kind() -> Any:
        """The features that a problem may have."""
        return ProblemKind(FEATURES, version=LATEST_PROBLEM_KIND_VERSION)

    @staticmethod
    def supports(problem_kind: Any) -> bool:
        """Whether all features of the kind are supported."""
        return bool(problem_kind <= CloRepairer.supported_kind())

    @staticmethod
    def supports_plan(plan_kind: Any) -> bool:
        """Whether plans of this kind are: sequential ones."""
        return plan_kind is PlanKind.SEQUENTIAL_PLAN

    @staticmethod
    def satisfies(optimality_guarantee: Any) -> bool:
        """Plans are valid, not optimal."""
        return optimality_guarantee is OptimalityGuarantee.SATISFICING

    @staticmethod
    def get_credits(**kwargs: object) -> Any:
        """Whom unified-planning is to thank when the engine is used."""
        short = "Repairs a plan along its causal links, without planning again."
        return Credits(
            name="clo",
            author="the authors of clo_fleet, after Daniel Borrajo and Manuela Veloso",
            contact="the project clo_fleet",
            website="https://arxiv.org/abs/2403.12162",
            license="Apache-2.0",
            short_description=short,
            long_description=f"{short} After: Borrajo and Veloso, Intelligent Execution through Plan Analysis, 2024.",
        )

    def destroy(self) -> None:
        """Forget all groundings."""
        self._groundings.forget()

    def repair(self, problem: Any, plan: Any) -> Any:
        """A valid plan for the problem, as much as possible the given one.

        unified-planning only warns of unsupported problems if an engine was asked for by name; this one refuses them
        all the same, unless `skip_checks` is set.

        Raises:
            UnsupportedError: if the problem or the plan is of an unsupported kind, too large to be grounded, or an
                optimal plan is asked for.
            ForeignPlanError: if the plan has other actions or objects than the problem, or is of another environment.
            UPNoRequestedEngineAvailableException: if the environment lacks the fallback.
        """
        if self.optimality_metric_required:
            raise UnsupportedError(["a guarantee that plans are optimal"])
        if not self.skip_checks:
            if lacking := sorted(problem.kind.features - FEATURES):
                raise UnsupportedError(lacking)
            if not self.supports_plan(plan.kind):
                raise UnsupportedError([plan.kind.name])
        if self._fallback is not None and self._fallback not in problem.environment.factory.engines:
            raise UPNoRequestedEngineAvailableException(f"the environment has no engine {self._fallback}")
        return self._repair(problem, plan)

    def _repair(self, problem: Any, plan: Any) -> Any:
        start = perf_counter()
        names = names_of(problem, plan)
        try:
            present = self._groundings.of(problem)
        except (UnsupportedProblemError, GroundingError) as error:
            raise UnsupportedError([str(error)]) from error
        grounded = perf_counter()
        question = Question(problem, plan, names, present)
        links = causal_links(present.state, question.steps, present.goals)
        found = repair(
            present.state,
            question.steps,
            present.goals,
            operators=present.operators,
            improve=self._improve,
            next_id=question.next_id,
        )
        result = question.repaired(found, links) if isinstance(found, Repaired) else question.refused(found)
        repaired = perf_counter()
        if self._fallback is not None and result.plan is None and result.status is not Status.UNSOLVABLE_PROVEN:
            result = self._planned(problem, question, result, start)
        result.metrics |= {
            "grounding": "known" if present.known else "new",
            "grounding_milliseconds": _milliseconds(grounded - start),
            "repair_milliseconds": _milliseconds(repaired - grounded),
            "milliseconds": _milliseconds(perf_counter() - start),
        }
        return result

    def _planned(self, problem: Any, question: Question, refused: Any, start: float) -> Any:
        """What the fallback answers, in the time that is left to it."""
        left = None if self._timeout is None else self._timeout - (perf_counter() - start)
        if left is not None and left <= 0:
            result = replace(refused, status=Status.TIMEOUT)
        else:
            factory = problem.environment.factory
            with factory.OneshotPlanner(name=self._fallback, params=self._fallback_params) as planner:
                # a copy: writing a problem as PDDL leaves it with all that is false noted
                found = planner.solve(problem.clone(), timeout=left, output_stream=self._output_stream)
            result = question.planned(found)
            result.log_messages = [*refused.log_messages, *(result.log_messages or ())]
        result.metrics = {**refused.metrics, **result.metrics, "fallback": self._fallback}
        return result


def _milliseconds(seconds: float) -> str:
    return f"{1000 * seconds:.3f}"
