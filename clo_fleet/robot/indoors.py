"""Who works in a room stays in it, and who leaves it leaves by its own door: out of all other doorways.

Avoidance knows bodies and nothing of doors: in a crowd it would send a robot that is in the middle of its work, or
waits for another door, out of the room by a doorway, and into a vehicle that holds there. Then the robot would be in
another place than its plan says.
"""

from clo_fleet.robot.avoidance import Agent
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import beyond, in_front, outward
from clo_fleet.world.model import DoorId, Point, RobotId, RoomId

__all__ = ["at_doors", "indoors"]

AHEAD = 1.0  # [s] a robot of 1 m/s that brakes with 1 m/s2 has stopped by then


def at_doors(site: Site) -> list[Agent]:
    """The vehicles that hold at doors, as the robots in the rooms behind have to avoid them: they give no way."""
    return [
        Agent(
            id=robot,
            position=site.pose(robot).point,
            velocity=(0.0, 0.0),
            preferred=(0.0, 0.0),
            radius=site.robot_radius(robot),
            max_speed=0.0,
            group=str(room),
        )
        for robot, room in site.holding().items()
    ]


def indoors(site: Site, robot: RobotId, velocity: Point, own: DoorId | None = None) -> Point:
    """The velocity without what would carry the robot out of its room; by its ``own`` door it means to leave."""
    place = site.place(robot)
    if not site.premises.is_room(place):
        return velocity
    (x, y), (vx, vy) = site.pose(robot).point, velocity
    room = RoomId(place)
    for door in site.premises.doors_of(room):
        if door.id == own:
            continue
        ahead = (x + vx * AHEAD, y + vy * AHEAD)
        if in_front(door, room, ahead, 0.0) and beyond(door, room, ahead):
            nx, ny = outward(door, room)
            out = max(0.0, vx * nx + vy * ny)
            vx, vy = vx - out * nx, vy - out * ny
    return (vx, vy)
