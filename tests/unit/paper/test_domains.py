"""The paper's three domains: their problems, and what newcomers and opportunities are in each of them."""

from functools import partial

import pytest

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Fact
from clo_fleet.paper.catalogue import SETTINGS, SIZES
from clo_fleet.paper.settings import Draw, Setting, problem_text
from clo_fleet.planning.problem import check
from clo_fleet.planning.problem_file import read_problem
from clo_fleet.world.chance import uniform

each_setting = pytest.mark.parametrize("setting", SETTINGS.values(), ids=str)


def at(facts: frozenset[Fact], flips: tuple[Flip, ...]) -> frozenset[Fact]:
    """The facts after the flips."""
    return (facts - {flip.fact for flip in flips if not flip.value}) | {flip.fact for flip in flips if flip.value}


def always(number: float) -> Draw:
    """The same number for every purpose."""
    return lambda _: number


def chance(number: int) -> Draw:
    """The numbers drawn at one moment."""
    return partial(uniform, number)


@each_setting
@pytest.mark.parametrize("size", SIZES)
def test_problems_fit_their_domain_and_survive_being_written(setting: Setting, size: int) -> None:
    """What the planner reads is what the generator made."""
    domain, task = setting.domain(), setting.task(size)
    check(task, domain)
    assert read_problem(problem_text(task, domain.name), domain) == task


@each_setting
def test_newcomers_fit_the_domain_and_have_nothing_to_do_with_the_goals(setting: Setting) -> None:
    """A problem with a newcomer is a problem still; its name is new."""
    task = setting.task(5)
    newcomer = setting.newcomer(task.facts, 1)
    objects = {
        type_: (*names, *(name for name, of in newcomer.objects if of == type_)) for type_, names in task.objects
    }
    assert not {name for name, _ in newcomer.objects} & {name for _, names in task.objects for name in names}
    assert not set(newcomer.facts) & set(task.goals)
    grown = type(task)(
        robot=task.robot,
        objects=tuple(objects.items()),
        facts=task.facts | set(newcomer.facts),
        goals=task.goals,
    )
    check(grown, setting.domain())


@each_setting
def test_opportunities_bring_every_goal_about_and_then_there_are_none_left(setting: Setting) -> None:
    """Each changes what is not so yet; after enough of them all goals hold, and nobody does anything more."""
    task = setting.task(5)
    facts = task.facts
    for number in range(100):
        flips = setting.opportunity(task, facts, chance(number))
        assert all((flip.fact in facts) is not flip.value for flip in flips)
        facts = at(facts, flips)
    assert facts.issuperset(task.goals)
    assert setting.opportunity(task, facts, chance(100)) == ()


def test_half_of_the_opportunities_in_rooms_are_objects_handed_over() -> None:
    """Handed over, an object does not lie anywhere any more; else it is prepared, and lies where it lay."""
    setting = SETTINGS["rooms"]
    task = setting.task(10)
    found = [setting.opportunity(task, task.facts, chance(n)) for n in range(400)]
    held = [flips for flips in found if len(flips) == 2]
    assert 170 < len(held) < 230
    for flips in held:
        assert [(flip.fact[0], flip.value) for flip in flips] == [("holding", True), ("at-object", False)]
    assert {flips[0].fact[0] for flips in found if len(flips) == 1} == {"prepared"}
    assert {flips[0].fact[1] for flips in found} == {f"o{i}" for i in range(1, 11)}


def test_an_opportunity_in_dialog_is_two_answers_of_one_person() -> None:
    """They are the next two that the person has not given; one if only one is left."""
    setting = SETTINGS["dialog"]
    task = setting.task(1)
    first = setting.opportunity(task, task.facts, always(0.0))
    assert [flip.fact for flip in first] == [("asked", "h1", "q1"), ("asked", "h1", "q2")]
    almost = at(task.facts, tuple(Flip(goal, True) for goal in task.goals[:-1]))
    assert [flip.fact for flip in setting.opportunity(task, almost, always(0.0))] == [("asked", "h1", "q5")]


def test_an_opportunity_in_cooking_adds_units_up_to_what_is_wanted() -> None:
    """From 1 to three quarters of the problem's size, after those that are there already."""
    setting = SETTINGS["cooking"]
    task = setting.task(20)
    for number, more in ((0.0, 1), (0.3, 5), (0.999, 15)):
        flips = setting.opportunity(task, task.facts, always(number))
        wanted = next(int(goal[2][1:]) for goal in task.goals if goal[1] == flips[0].fact[1])
        assert [flip.fact[2] for flip in flips] == [f"n{i}" for i in range(1, min(more, wanted) + 1)]
        assert all(flip.value for flip in flips)
