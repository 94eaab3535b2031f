"""A room to fetch something in, without physics: a camera gives the can's place where it is in the picture.

Not modelled: what hides the can from a camera, the arm among it; errors of a detection.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.detected_object import Sight
from aeros.sim.geometry import Pose, in_view, plus, turned
from aeros.sim.kinematic.objects import Round, Thing, Things, slab
from aeros.sim.layouts.fetch import (
    CAMERAS,
    CAN,
    DECOY,
    ROBOT,
    STAND,
    Seen,
    camera_at,
    lay_room,
    measured_in_room,
    seen_by,
)
from aeros.sim.randomness import Chance
from aeros.sim.robot.robot import RobotState


class Fetch:
    """The room."""

    robot = ROBOT
    cameras = CAMERAS
    watching: tuple[str, ...] = ("mast",)

    def lay(self, chance: Chance) -> Things:
        """Can and decoy on their stand, and the stand to deliver to, by chance."""
        self._laid = laid = lay_room(chance)
        self._seen: Seen | None = None
        (radius, height), (x, y, z) = CAN, (edge / 2 for edge in DECOY)
        low, high = (-radius, -radius, -height / 2), (radius, radius, height / 2)
        self._can = Round(Pose(laid.can, turned(0.0)), low, high, height / 2)
        decoy = Thing(Pose(laid.decoy, turned(0.0)), (-x, -y, -z), (x, y, z), z)
        stands = [slab(stand[0], stand[1], STAND[2], *STAND[:2]) for stand in laid.stands]
        self._things = Things((self._can, decoy), (slab(1.0, 0.0, 0.0, 6.0, 6.0), *stands))
        return self._things

    def tick(self) -> None:
        """What was seen of the can does not hold any more once it is held."""
        if self._things.holds(self._can):
            self._seen = None

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """See `measured_in_room`."""
        held = self._things.holds(self._can) and self._things.is_lifted(self._can)
        return measured_in_room(self._laid, state.base_position, held, self._seen, time)

    def look(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Where the can's middle is, if the middle of its top is in the picture."""
        middle = self._can.pose.position
        eye = camera_at(camera, state.base_position, state.tool_position, yaw)
        seen = in_view(eye, plus(middle, (0.0, 0.0, CAN[1] / 2)))
        self._seen = Seen(middle, time) if seen else None
        return seen_by(camera, Sight(middle) if seen else None, self._laid.delivery)
