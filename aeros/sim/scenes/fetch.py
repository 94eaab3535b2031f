"""A room to fetch something in: a red can on a stand, a decoy beside it, a second stand to bring it to.

The robot drives on its carriage, with a camera on a mast and one on the hand.  Where the can is, skills
learn from pictures alone; the predicates of carrying and delivering are measured from poses and contacts.
Frame W: origin on the floor under the arm's base at the start.  Not modelled: obstacles on the way.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, dist, hypot, sin
from typing import Any, Final

from aeros.sim.detection import find_red
from aeros.sim.panda import Panda, RobotOptions
from aeros.sim.randomness import Chance
from aeros.sim.scenes.scene import Through, as_it_is
from aeros.sim.world import Camera, Triple, World

BASE_HEIGHT: Final = 0.30
"""Height of the arm's base on the carriage over the floor, m."""

STATION: Final = (1.25, 0.20)
"""Nominal place of the arm's base for picking, m."""

AHEAD: Final = 0.58
"""From the arm's base at the station to the middle of the stand, m."""

STAND: Final = (0.26, 0.50, 0.40)
"""Edges of both stands, m."""

DELIVERY: Final = (1.70, -1.10)
"""Nominal place where the can is to stand, m."""

CAN: Final = (0.022, 0.08)
"""Radius and height of the can, m."""

STATION_SPREAD: Final = 0.08
"""The station, with its stand, is up to this far from its nominal place in x and in y, m."""

CAN_SPREAD: Final = (0.05, 0.12)
"""How far the can is from the middle of its stand in x and in y at most, m."""

DELIVERY_SPREAD: Final = 0.05
"""The place to deliver to is up to this far from its nominal place in x and in y, m."""

ARRIVED: Final = 0.03
"""Distance from the station within which the base is at it, m."""

FRESH: Final = 30.0
"""Age up to which a detection counts, s."""

LIFTED: Final = 0.05
"""Height over its stand from which the can counts as lifted, m."""

DELIVERED: Final = 0.03
"""Distance from where it belongs within which the can is delivered, m."""

AT_REST: Final = 0.01
"""Speed below which the can rests, m/s."""

MAST: Final[Triple] = (0.05, 0.20, 0.85)
"""The mast camera's eye from the arm's base, m: over the carriage's left edge."""

MAST_TARGET: Final[Triple] = (0.58, 0.0, 0.12)
"""What the mast camera looks at, from the arm's base, m."""

HAND_EYE: Final = (0.07, 0.06)
"""The hand camera's eye from the tool: along the tool's x axis and up, m.  It looks straight down."""


class Fetch:
    """The room.  Channels of chance: station, can, delivery."""

    robot = RobotOptions(carriage=True, base=(0.0, 0.0, BASE_HEIGHT))
    view = Camera(eye=(0.2, -2.3, 1.9), target=(1.1, -0.35, 0.4), field_of_view=50.0)
    things: tuple[str, ...] = ("can", "decoy")
    cameras: tuple[str, ...] = ("mast", "hand")

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Place both stands, the can and the decoy by chance."""
        self._world = world
        self._robot = robot
        self._seen_at: float | None = None
        world.add_box((6.0, 6.0, 0.05), (1.0, 0.0, -0.025), colour=(0.75, 0.74, 0.70, 1.0))
        dx, dy = (STATION_SPREAD * float(part) for part in chance.on("station").uniform(-1.0, 1.0, 2))
        self._station: Triple = (STATION[0] + dx, STATION[1] + dy, BASE_HEIGHT)
        self._can = self._lay_can(chance)
        dx, dy = (DELIVERY_SPREAD * float(part) for part in chance.on("delivery").uniform(-1.0, 1.0, 2))
        self._delivery: Triple = (DELIVERY[0] + dx, DELIVERY[1] + dy, STAND[2] + CAN[1] / 2)
        self._add_stand(self._delivery[0], self._delivery[1])

    def _lay_can(self, chance: Chance) -> int:
        """The stand at the station, the red can on it, and a blue decoy on the can's far side."""
        x, y = self._station[0] + AHEAD, self._station[1]
        self._add_stand(x, y)
        draw = chance.on("can").uniform(-1.0, 1.0, 2)
        u, v = x + CAN_SPREAD[0] * draw[0], y + CAN_SPREAD[1] * draw[1]
        radius, height = CAN
        red, blue = (0.80, 0.10, 0.08, 1.0), (0.15, 0.30, 0.75, 1.0)
        aside = y - 0.17 if v > y else y + 0.17
        self._decoy = self._world.add_box(
            (0.04, 0.04, 0.05), (x, aside, STAND[2] + 0.026), mass=0.1, colour=blue
        )
        place = (u, v, STAND[2] + height / 2 + 0.001)
        return self._world.add_cylinder(radius, height, place, mass=0.15, colour=red)

    def _add_stand(self, x: float, y: float) -> None:
        self._world.add_box(STAND, (x, y, STAND[2] / 2), colour=(0.78, 0.70, 0.58, 1.0))

    def tick(self) -> None:
        """Nothing changes but by physics."""

    def measure(self) -> Mapping[str, Any]:
        """Station and place to deliver to, and the task's predicates.

        object_detected holds for `FRESH` seconds after a picture in which the can was found, and while
        it is felt in the hand: an interrupted delivery need not look for what it carries.
        delivery_position is where the can's middle belongs.
        """
        base = self._robot.sense().base_position
        seen = self._seen_at is not None and self._world.time - self._seen_at <= FRESH
        grasped = self._grasped()
        return {
            "station_position": self._station,
            "delivery_position": self._delivery,
            "robot_at_target": dist(base[:2], self._station[:2]) < ARRIVED,
            "object_detected": seen or grasped,
            "object_grasped": grasped,
            "object_delivered": self._delivered(),
        }

    def thing(self, name: str) -> int:
        """See `Scene`."""
        return {"can": self._can, "decoy": self._decoy}[name]

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """Where the can's middle is, estimated from a picture by `mast` or `hand` camera."""
        eye = self._camera(camera)
        found = through(camera, find_red(self._world.render(eye), eye, CAN[1]))
        self._seen_at = None if found is None else self._world.time
        return {} if found is None else {"object_position": found}

    def _camera(self, name: str) -> Camera:
        """The camera `name` where it is now; raises KeyError for a camera that is not there."""
        state = self._robot.sense()
        if name == "mast":
            return Camera(_plus(state.base_position, MAST), _plus(state.base_position, MAST_TARGET))
        if name == "hand":
            _, yaw = self._robot.tool_command()
            ahead, above = HAND_EYE
            eye = _plus(state.tool_position, (ahead * cos(yaw), ahead * sin(yaw), above))
            below = _plus(eye, (0.0, 0.0, -1.0))
            return Camera(eye, below, up=(cos(yaw), sin(yaw), 0.0), field_of_view=70.0)
        raise KeyError(name)

    def _finger_links(self) -> set[int]:
        """Which finger links touch the can."""
        touching = {contact.link_b for contact in self._world.contacts(self._can, self._robot.body)}
        return touching & set(self._robot.fingers)

    def _grasped(self) -> bool:
        """Both fingers touch the can and it is lifted."""
        height = self._world.pose(self._can).position[2] - STAND[2] - CAN[1] / 2
        return height > LIFTED and len(self._finger_links()) == 2

    def _delivered(self) -> bool:
        """The can stands where it belongs, still and let go."""
        dx, dy, dz = (
            a - b for a, b in zip(self._world.pose(self._can).position, self._delivery, strict=True)
        )
        near = hypot(dx, dy) < DELIVERED and abs(dz) < 0.01
        return near and self._world.speed(self._can) < AT_REST and not self._finger_links()


def _plus(a: Triple, b: Triple) -> Triple:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
