"""Presses without physics: the handle turns the lid, and the lid folds what lies where it belongs.

The lid folds until it meets the filling. Further force on the handle then presses on the filling by the
lever. A fold that is not sealed falls open, to the side it leans to.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import asin, atan2, cos, pi, sin

from aeros.sim.geometry import Pose, Vector3, to_world, yaw_orientation
from aeros.sim.kinematic.objects import STIFFNESS, GraspableObject
from aeros.spec.model.scene import Press


@dataclass
class Handle(GraspableObject):
    """The handle of a lid, which moves on a circle about the lid's joint.

    Attributes:
        axis: position of the joint in W, m.
        radius: of the circle, m.
        angle: of the lid, 0 open, towards -x; π closed, rad.
        stops: greatest angle that the lid can reach for each thing that it may fold, rad, by its name.
        handle_force: force on the handle at the stop, N.
    """

    axis: Vector3 = (0.0, 0.0, 0.0)
    radius: float = 0.0
    angle: float = field(default=0.0, init=False)
    stops: dict[str, float] = field(default_factory=dict, init=False)
    handle_force: float = field(default=0.0, init=False)

    @property
    def stop_angle(self) -> float:
        """Greatest angle that the lid can reach, rad."""
        return min(self.stops.values(), default=pi)

    def move_with_gripper(self, target: Pose, support: float) -> float:
        """Implement `GraspableObject.move_with_gripper`: turn the lid to the fingers, as far as it goes."""
        x, _, z = target.position
        angle = atan2(z - self.axis[2], self.axis[0] - x)
        angle += 2.0 * pi if angle < -pi / 2 else 0.0
        self.angle = min(max(angle, 0.0), self.stop_angle)
        self.pose = Pose(_on_circle(self.axis, self.radius, self.angle), self.pose.orientation)
        self.handle_force = (
            STIFFNESS * max(0.0, self.pose.position[2] - z) if angle > self.stop_angle else 0.0
        )
        return self.handle_force

    def drop_onto_support(self, support: float) -> None:
        """Implement `GraspableObject.drop_onto_support`: the lid stays at its angle, by hinge friction."""
        self.handle_force = 0.0


class FoldingPress:
    """A press and the joint that it folds. Several with one lid share its handle.

    Args:
        press: the declaration.
        axis: position of the lid's joint in W, m.
        filling_height: height of the filling, m.
        handle: handle of the lid, if another press has it, too.

    Attributes:
        press: the declaration.
        handle: the handle.
        fold: position of the folded joint, rad.
    """

    def __init__(
        self, press: Press, axis: Vector3, filling_height: float, handle: Handle | None = None
    ) -> None:
        self.press = press
        self.handle = _handle_of(press, axis) if handle is None else handle
        self._stop(press.range[1])
        self.fold = 0.0
        self._arm = abs(press.hinge[0])
        self._filled_angle = pi - asin(min(1.0, max(0.0, filling_height - press.gap) / self._arm))

    def tick(self, folded: Pose, *, is_held: bool, is_filled: bool, is_sealed: bool) -> None:
        """Fold what lies where it belongs.

        Args:
            folded: pose in W of the body that is folded.
            is_held: True if the hand carries it.
            is_filled: True if the filling is inside.
            is_sealed: True if the fold stays by itself.
        """
        self._stop(self.press.range[1])
        if is_held or not self._is_in_place(folded):
            return
        self._stop(self._filled_angle if is_filled else pi)
        lid = self.handle.angle
        if lid >= self.fold or (not is_sealed and self.fold < pi / 2):
            self.fold = lid

    def load(self) -> float:
        """Compute the force of the lid on what lies on the bed, filled or not.

        Returns:
            The force, N; 0 if the lid meets nothing.
        """
        if self.handle.stops[self.press.folds.body] >= self.press.range[1]:
            return 0.0
        return self.handle.handle_force * self.press.handle_radius / self._arm

    def force_on_filling(self, *, is_filled: bool) -> float:
        """Compute the force of the lid on the filling.

        Args:
            is_filled: True if the filling is inside.

        Returns:
            The force, N.
        """
        return self.load() if is_filled else 0.0

    def _stop(self, angle: float) -> None:
        self.handle.stops[self.press.folds.body] = angle

    def _is_in_place(self, folded: Pose) -> bool:
        hinge = to_world(folded, self.press.hinge)
        return all(abs(a - b) < self.press.tolerance for a, b in zip(hinge, self.press.place, strict=True))


def _handle_of(press: Press, axis: Vector3) -> Handle:
    rod, reach = press.handle_size[0], press.handle_size[1] / 2
    place = Pose(_on_circle(axis, press.handle_radius, 0.0), yaw_orientation(0.0))
    low, high = (-rod, -reach, -rod), (rod, reach, rod)
    return Handle(place, low, high, rod, axis=axis, radius=press.handle_radius)


def _on_circle(axis: Vector3, radius: float, angle: float) -> Vector3:
    return (axis[0] - radius * cos(angle), axis[1], axis[2] + radius * sin(angle))
