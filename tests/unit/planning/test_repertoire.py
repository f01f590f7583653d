"""What a robot could do is all that its domain allows in its building, and nothing else."""

from collections import Counter
from dataclasses import replace
from itertools import permutations

from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.task import Condition
from clo_fleet.planning.problem import Scene
from clo_fleet.planning.repertoire import Repertoire, ground_actions
from clo_fleet.world.binding import SensorBinding, SensorKind, SkillBinding, SkillKind
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import SkillSettings
from clo_fleet.world.pddl import read_domain
from clo_fleet.world.vocabulary import Names, Vocabulary

ROOMS, ITEMS = ("l1", "l2", "l3"), ("o1", "o2")
SCENE = Scene(
    words=Vocabulary(fleet_binding(), Names(robots=("r1", "r2"), objects=ITEMS, rooms=ROOMS, zones=("hall",))),
    travel={**dict.fromkeys(permutations(ROOMS, 2), 20), **dict.fromkeys((("hall", room) for room in ROOMS), 10)},
    skills=SkillSettings(),
)
MEETS = ("meets", "r2", "l2")


def test_robot_can_move_where_ways_lead_and_work_in_every_room() -> None:
    """Moves between rooms and out of the zone, never into it; each skill for each object and room; all its own."""
    actions = ground_actions("r1", SCENE, ())
    assert Counter(action.schema for action in actions) == {"move": 9, "prepare": 6, "grasp": 6, "place": 6}
    assert all(action.args[0] == "r1" for action in actions)
    assert not any(("at-robot", "r1", "hall") in action.adds for action in actions)
    assert {action.args[1:]: action.cost for action in actions if action.schema == "move"} == dict(SCENE.travel)


def test_robot_can_give_where_it_means_to_meet_the_other() -> None:
    """For each object; that they meet stays a condition, since plans change."""
    gives = [action for action in ground_actions("r1", SCENE, [MEETS]) if action.schema == "give"]
    assert [action.args for action in gives] == [("r1", "r2", item, "l2") for item in ITEMS]
    assert all(Condition(MEETS) in action.needs for action in gives)


def test_repertoire_is_made_again_only_for_other_meetings_or_goals() -> None:
    """What is true besides does not matter."""
    repertoire = Repertoire("r1", SCENE)
    goals = goals_of([("holding", "r1", "o1")])
    first = repertoire.operators({("at-robot", "r1", "l1")}, goals)
    assert repertoire.operators({("at-robot", "r1", "l2"), ("prepared", "o1")}, goals) is first
    other = repertoire.operators({MEETS}, goals)
    assert other is not first
    assert len(other.all) == len(first.all) + len(ITEMS)
    assert repertoire.operators({MEETS}, ()) is not other


def test_conditions_that_nothing_changes_decide_which_actions_there_are() -> None:
    """Constants, equal names and negations too; types as well where a condition binds a parameter."""
    domain = read_domain(
        """(define (domain d) (:requirements :typing :equality :negative-preconditions)
             (:types robot item place)
             (:constants l1 - place)
             (:predicates (self ?r - robot) (room ?l - place) (connected ?a ?b - place) (at-robot ?r - robot ?l - place)
                          (seen ?a ?b - place))
             (:action look :parameters (?r - robot ?a ?b - place)
               :precondition (and (connected l1 ?b) (not (= ?a ?b)) (not (connected ?a ?b)) (at-robot ?r ?a))
               :effect (seen ?a ?b))
             (:action stare :parameters (?r - robot ?a - place)
               :precondition (and (connected ?a ?a) (at-robot ?r ?a)) :effect (not (at-robot ?r ?a)))
             (:action turn :parameters (?r - robot ?x - item)
               :precondition (connected ?x ?x) :effect (seen l1 l1)))"""
    )
    travel = {("l1", "l2"): 1, ("l1", "l3"): 1, ("l2", "l3"): 1, ("l3", "l3"): 1}
    stay = SkillBinding(SkillKind.WORK, (("robot", "?r"),))
    binding = replace(
        fleet_binding(),
        domain=domain,
        skills=tuple((schema.name, stay) for schema in domain.schemas),
        sensors=(
            ("self", SensorBinding(SensorKind.SELF, (("robot", "?r"),))),
            ("room", SensorBinding(SensorKind.ROOM, (("place", "?l"),))),
            ("connected", SensorBinding(SensorKind.CONNECTED, (("from", "?a"), ("to", "?b")))),
            ("at-robot", SensorBinding(SensorKind.PLACE, (("robot", "?r"), ("place", "?l")))),
            ("seen", SensorBinding(SensorKind.EFFECTS)),
        ),
    )
    names = Names(robots=("r1",), objects=(), rooms=("l2", "l3"))
    scene = Scene(words=Vocabulary(binding, names), travel=travel, skills=SkillSettings())
    assert [(action.schema, *action.args) for action in ground_actions("r1", scene, ())] == [
        ("look", "r1", "l3", "l2"),
        ("stare", "r1", "l3"),
    ]
