"""The skills there are: which one carries out a deed, and which one a state was taken from."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from clo_fleet.robot.drive import Drive
from clo_fleet.robot.giving import Give
from clo_fleet.robot.handling import Handle, Place
from clo_fleet.robot.skill import Skill
from clo_fleet.robot.staying import Stay
from clo_fleet.world.binding import SkillKind
from clo_fleet.world.model import ObjectId, RobotId, RoomId
from clo_fleet.world.vocabulary import Deed

__all__ = ["saved_skill", "skill_of"]

# what a skill's state names -> how it is made from that
SAVED: Mapping[str, Callable[[Mapping[str, Any]], Skill]] = MappingProxyType(
    {
        "drive": Drive.from_state,
        "handle": Handle.from_state,
        "place": Place.from_state,
        "give": Give.from_state,
        "stay": Stay.from_state,
    }
)


def saved_skill(state: Mapping[str, Any]) -> Skill:
    """The skill that ``state()`` was taken from."""
    return SAVED[state["skill"]](state)


def skill_of(deed: Deed) -> Skill:
    """The skill, at its beginning, that does the deed."""
    roles = deed.roles
    if deed.kind is SkillKind.DRIVE:
        return Drive(RoomId(roles["from"]), RoomId(roles["to"]))
    room = RoomId(roles["in"])
    if deed.kind is SkillKind.WORK:
        return Handle(ObjectId(roles["at"]), room, grasp=False) if "at" in roles else Stay(room)
    item = ObjectId(roles["object"])
    if deed.kind is SkillKind.GRASP:
        return Handle(item, room, grasp=True)
    return Place(item, room) if deed.kind is SkillKind.PLACE else Give(item, RobotId(roles["to"]), room)
