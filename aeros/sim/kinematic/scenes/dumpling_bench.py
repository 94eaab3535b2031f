"""A bench for making one dumpling, without physics: the handle turns the lid, the lid folds the wrapper.

The lid folds a wrapper that lies where it belongs until the plate meets the filling. Further force on the
handle then presses on the filling by the lever. An open wrapper's plate falls to the side it leans to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import asin, atan2, cos, pi, sin
from typing import Any, Final

from aeros.sim.geometry import Pose, Vector3, yaw_of, yaw_orientation
from aeros.sim.kinematic.objects import STIFFNESS, GraspableObject, ObjectSet, slab
from aeros.sim.kinematic.scenes.bare import TABLE
from aeros.sim.layouts.dumpling_bench import (
    ALIGNED_POSITION,
    CAMERAS,
    FILLING,
    HINGE_TO_PLATE,
    PLATE_HALF,
    POT,
    POT_INNER,
    PRESS,
    SEALING_FORCE,
    STAND,
    STAND_RADIUS,
    TRAY,
    TRAY_EDGES,
    Dumpling,
    DumplingTracker,
    WrapperDetection,
    bench_measurements,
    sample_bench_layout,
)
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions, RobotState

HANDLE_RADIUS: Final = 0.075
"""Distance of the handle from the press's hinge, m (models/press.urdf)."""

LID_MAX: Final = 3.25
"""Greatest lid angle of the empty press, rad (models/press.urdf)."""

BED: Final = (0.024, -0.014, 0.042, 0.036)
"""The bed under plate A: its middle along x and its top, from the hinge; its length and width, m."""

HANDLE_SIZE: Final = (0.009, 0.044)
"""Radius and length of the handle, along y, m (models/press.urdf)."""

FOLDED_PLATE_GAP: Final = 0.016
"""Gap between the plates of a wrapper folded by π, m (models/wrapper.urdf)."""


@dataclass
class Handle(GraspableObject):
    """The press's handle, which moves on a circle about the hinge.

    Attributes:
        angle: of the lid, 0 open, towards -x; π closed, rad.
        stop_angle: greatest angle that the lid can reach, rad.
        press_force: force on the handle at the stop, N.
    """

    angle: float = field(default=0.0, init=False)
    stop_angle: float = field(default=LID_MAX, init=False)
    press_force: float = field(default=0.0, init=False)

    def move_with_gripper(self, target: Pose, support: float) -> float:
        """Implement `GraspableObject.move_with_gripper`: turn the lid to the fingers, as far as it goes."""
        x, _, z = target.position
        angle = atan2(z - PRESS[2], PRESS[0] - x)
        angle += 2.0 * pi if angle < -pi / 2 else 0.0
        self.angle = min(max(angle, 0.0), self.stop_angle)
        self.pose = Pose(_handle_at(self.angle), self.pose.orientation)
        self.press_force = STIFFNESS * max(0.0, self.pose.position[2] - z) if angle > self.stop_angle else 0.0
        return self.press_force

    def drop_onto_support(self, support: float) -> None:
        """Implement `GraspableObject.drop_onto_support`: the lid stays at its angle, by hinge friction."""
        self.press_force = 0.0


def _handle_at(angle: float) -> Vector3:
    return (PRESS[0] - HANDLE_RADIUS * cos(angle), PRESS[1], PRESS[2] + HANDLE_RADIUS * sin(angle))


class KinematicDumplingBench:
    """Scene of the bench: press, pot, wrapper on a tray, filling on a stand."""

    robot = RobotOptions()
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("overhead",)

    def build(self, chance: RandomSource) -> ObjectSet:
        """Implement `KinematicScene.build`: wrapper and filling at random, press and pot fixed."""
        laid = sample_bench_layout(chance)
        (length, width, half), (side, height) = PLATE_HALF, FILLING
        self._wrapper = GraspableObject(
            laid.wrapper,
            (-2.0 * HINGE_TO_PLATE - length, -width, -half),
            (length, width, half),
            half,
            top_surface=slab(0.0, 0.0, half, 2.0 * length, 2.0 * width),
        )
        edge = side / 2
        self._filling = GraspableObject(
            laid.filling, (-edge, -edge, -height / 2), (edge, edge, height / 2), height / 2
        )
        rod, reach = HANDLE_SIZE[0], HANDLE_SIZE[1] / 2
        place = Pose(_handle_at(0.0), yaw_orientation(0.0))
        self._handle = Handle(place, (-rod, -reach, -rod), (rod, reach, rod), rod)
        x, y = laid.tray.position[:2]
        surfaces = (
            TABLE,
            slab(x, y, TRAY[2], *TRAY_EDGES, yaw_of(laid.tray.orientation)),
            slab(laid.stand[0], laid.stand[1], STAND[2], 2.0 * STAND_RADIUS, 2.0 * STAND_RADIUS),
            slab(PRESS[0] + BED[0], PRESS[1], PRESS[2] + BED[1], *BED[2:]),
            slab(*POT, *POT_INNER[:2]),
        )
        self._things = ObjectSet((self._wrapper, self._filling, self._handle), surfaces)
        self._fold = 0.0
        self._sealed = False
        self._inspector = DumplingTracker()
        return self._things

    def tick(self) -> None:
        """Implement `KinematicScene.tick`: fold the wrapper; seal if fold, filling and force all pass."""
        dumpling = self._dumpling()
        self._handle.stop_angle = LID_MAX
        if self._is_on_press(dumpling):
            self._handle.stop_angle = _closed_fold_angle(dumpling)
            self._fold_by(self._handle.angle)
        if self._press_force() > SEALING_FORCE and self._dumpling().is_closed:
            self._sealed = True
        self._inspector.add_press_force(self._press_force())

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.measure`; see `bench_measurements`."""
        return bench_measurements(self._handle.pose.position, self._press_force())

    def detect(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.detect` from true poses.

        Held objects are not detected; a closed wrapper hides its filling.
        """
        dumpling = self._dumpling()
        if camera == "side":
            return self._inspector.add_side_view(dumpling.is_closed)
        held = self._things.holds(self._wrapper)
        yaw = yaw_of(dumpling.plate.orientation)
        wrapper = None if held else WrapperDetection(dumpling.hinge, yaw, dumpling.fold)
        hidden = dumpling.is_closed or self._things.holds(self._filling)
        return self._inspector.add_overhead_view(wrapper, None if hidden else dumpling.filling, time)

    def _fold_by(self, lid: float) -> None:
        """Fold the wrapper with the lid; an open plate behind the lid falls to the side it leans to."""
        if lid >= self._fold or (not self._sealed and self._fold < pi / 2):
            self._fold = lid

    def _press_force(self) -> float:
        """Return the lid's force on the filling, N."""
        touches = self._handle.stop_angle < LID_MAX and self._dumpling().is_filled
        return self._handle.press_force * HANDLE_RADIUS / HINGE_TO_PLATE if touches else 0.0

    def _is_on_press(self, dumpling: Dumpling) -> bool:
        """Return True if the wrapper is not held and its hinge is within 8 mm of the press's."""
        near = all(abs(a - b) < 0.008 for a, b in zip(dumpling.hinge, ALIGNED_POSITION, strict=True))
        return near and not self._things.holds(self._wrapper)

    def _dumpling(self) -> Dumpling:
        return Dumpling(self._wrapper.pose, self._fold, self._filling.pose.position)


def _closed_fold_angle(dumpling: Dumpling) -> float:
    """Return the fold at which plate B meets the filling, or its own stop at π."""
    return pi - asin((FILLING[1] - FOLDED_PLATE_GAP) / HINGE_TO_PLATE) if dumpling.is_filled else pi
