"""The radio tells who is in range, after a while, most of the time, and the same way again."""

import json

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.fleet.radio import Message, RadioChannel
from clo_fleet.world.model import Point, Radio, RobotId

A, B, C = (RobotId(name) for name in "abc")
PLACES = {A: (0.0, 0.0), B: (5.0, 0.0), C: (50.0, 0.0)}
NEWS = (Flip(("prepared", "o1"), True, Cause("a", "prepare(a, o1, l1)", 7)),)


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
    assert channel.due(2.8) == ()
    arrived = channel.due(3.0)
    assert [message.flip for message in arrived] == list(NEWS)
    assert hearers(channel, arrived) == [B]
    assert channel.due(4.0) == ()


def test_without_a_range_all_others_hear() -> None:
    """All but the sender, wherever they are."""
    channel = RadioChannel(Radio(), (A, B, C), seed=0)
    channel.tell(0.0, B, NEWS, point)
    assert hearers(channel, channel.due(0.0)) == [A, C]


def test_silent_radio_tells_nothing() -> None:
    """Where facts are not passed on, nobody hears any."""
    channel = RadioChannel(Radio(facts=False), (A, B, C), seed=0)
    channel.tell(0.0, A, NEWS, point)
    assert channel.due(9.0) == ()


def test_what_is_lost_depends_on_the_seed_alone() -> None:
    """About the given share is lost; the same seed loses the same messages, another seed others."""

    def heard(seed: int) -> list[int]:
        channel = RadioChannel(Radio(loss=0.3), (A, B), seed=seed)
        arrived = []
        for number in range(300):
            channel.tell(number, A, NEWS, point)
            arrived += [number] * bool(hearers(channel, channel.due(number)))
        return arrived

    assert heard(1) == heard(1)
    assert heard(1) != heard(2)
    assert 180 <= len(heard(1)) <= 240


def test_each_listener_loses_messages_of_its_own() -> None:
    """With or without a range, two listeners do not lose the same."""
    for radio in (Radio(loss=0.5), Radio(loss=0.5, range=100.0)):
        channel = RadioChannel(radio, (A, B, C), seed=0)
        for number in range(100):
            channel.tell(number, A, NEWS, point)
        messages = channel.due(100.0)
        heard = [[channel.reaches(message, robot) for message in messages] for robot in (B, C)]
        assert heard[0] != heard[1]


def test_messages_under_way_survive_being_saved() -> None:
    """A channel restored from plain data delivers what the first one had in the air, to the same robots."""
    for radio in (Radio(delay=5.0), Radio(delay=5.0, range=10.0)):
        channel = RadioChannel(radio, (A, B, C), seed=0)
        channel.tell(0.0, A, NEWS, point)
        other = RadioChannel(radio, (A, B, C), seed=0)
        other.restore(json.loads(json.dumps(channel.state())))
        assert other.due(5.0) == channel.due(5.0) != ()
