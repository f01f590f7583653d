"""The radio tells who is in range, after a while, most of the time, and the same way again."""

import json

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.plan import goals_of, number
from clo_fleet.clo.task import Action
from clo_fleet.fleet.announcements import Announcement, Deed
from clo_fleet.fleet.radio import Message, RadioChannel
from clo_fleet.world.model import ObjectId, Point, Radio, RobotId

A, B, C = (RobotId(name) for name in "abc")
PLACES = {A: (0.0, 0.0), B: (5.0, 0.0), C: (50.0, 0.0)}
NEWS = (Flip(("prepared", "o1"), True, Cause("a", "prepare(a, o1, l1)", 7)),)
REST = Action(schema="rest", args=("a",), needs=(), adds=frozenset({("rested", "a")}), deletes=frozenset())
PLAN = Announcement(
    robot=A,
    place="l1",
    plan=number([REST]),
    moving=False,
    goals=goals_of([("rested", "a")]),
    beliefs=frozenset({("at-robot", "a", "l1")}),
    in_hand=(ObjectId("o1"),),
    deeds=(Deed(2.0, NEWS),),
)


def point(robot: RobotId) -> Point:
    """Where the robot is."""
    return PLACES[robot]


def hearers(channel: RadioChannel, messages: tuple[Message, ...]) -> list[RobotId]:
    """Those whom any of the messages reaches."""
    return [robot for robot in (A, B, C) if any(channel.reaches(message, robot) for message in messages)]


def test_others_in_range_hear_once_and_after_the_delay() -> None:
    """Not the sender, not who is too far, not before the delay is over, and not twice."""
    channel = RadioChannel(Radio(range=10.0, delay=1.0), (A, B, C), seed=0)
    channel.tell(2.0, A, NEWS, point)
    channel.announce(2.0, PLAN, point)
    assert channel.due(2.8) == ()
    arrived = channel.due(3.0)
    assert [message.news for message in arrived] == [*NEWS, PLAN]
    assert hearers(channel, arrived) == [B]
    assert channel.due(4.0) == ()


def test_without_a_range_all_others_hear() -> None:
    """All but the sender, wherever they are."""
    channel = RadioChannel(Radio(), (A, B, C), seed=0)
    channel.tell(0.0, B, NEWS, point)
    assert hearers(channel, channel.due(0.0)) == [A, C]


def test_silent_radio_tells_plans_only() -> None:
    """Where facts are not passed on, nobody hears any."""
    channel = RadioChannel(Radio(facts=False), (A, B, C), seed=0)
    channel.tell(0.0, A, NEWS, point)
    channel.announce(0.0, PLAN, point)
    assert [message.news for message in channel.due(9.0)] == [PLAN]


def test_messages_arrive_by_time_then_sender_then_number() -> None:
    """However they were sent."""
    channel = RadioChannel(Radio(delay=1.0), (A, B, C), seed=0)
    channel.tell(0.2, C, NEWS, point)
    channel.tell(0.0, C, NEWS * 2, point)
    channel.announce(0.0, PLAN, point)
    arrived = [(message.due, message.sender, message.first) for message in channel.due(5.0)]
    assert arrived == [(1.0, A, 7), (1.0, C, 3), (1.0, C, 5), (1.2, C, 1)]


def test_what_is_lost_depends_on_the_seed_alone() -> None:
    """About the given share is lost; the same seed loses the same messages, another seed others."""

    def heard(seed: int) -> list[int]:
        channel = RadioChannel(Radio(loss=0.3), (A, B), seed=seed)
        arrived = []
        for tick in range(300):
            if tick % 2:
                channel.tell(tick, A, NEWS, point)
            else:
                channel.announce(tick, PLAN, point)
            arrived += [tick] * bool(hearers(channel, channel.due(tick)))
        return arrived

    assert heard(1) == heard(1)
    assert heard(1) != heard(2)
    assert 180 <= len(heard(1)) <= 240


def test_each_listener_loses_messages_of_its_own() -> None:
    """With or without a range, two listeners do not lose the same."""
    for radio in (Radio(loss=0.5), Radio(loss=0.5, range=100.0)):
        channel = RadioChannel(radio, (A, B, C), seed=0)
        for tick in range(100):
            channel.tell(tick, A, NEWS, point)
        messages = channel.due(100.0)
        heard = [[channel.reaches(message, robot) for message in messages] for robot in (B, C)]
        assert heard[0] != heard[1]


def test_messages_under_way_survive_being_saved() -> None:
    """A channel restored from plain data delivers what the first one had in the air, to the same robots."""
    for radio in (Radio(delay=5.0), Radio(delay=5.0, range=10.0)):
        channel = RadioChannel(radio, (A, B, C), seed=0)
        channel.tell(0.0, A, NEWS, point)
        channel.announce(0.0, PLAN, point)
        other = RadioChannel(radio, (A, B, C), seed=0)
        other.restore(json.loads(json.dumps(channel.state())))
        arrived = other.due(5.0)
        assert arrived == channel.due(5.0) != ()
        (plan,) = (message.news for message in arrived if isinstance(message.news, Announcement))
        assert (plan.deeds, plan.beliefs) == (PLAN.deeds, PLAN.beliefs)
