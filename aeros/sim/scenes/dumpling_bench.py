"""A bench for making one dumpling, with physics.

Everything moves by motors, gravity, friction and contact. One change is modelled: the wrapper's hinge
becomes stiff ("sealed") in the tick in which measured fold, filling position and press force all pass.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.layouts.dumpling_bench import (
    CAMERAS,
    FILLING,
    OVERHEAD_CAMERA,
    POT,
    POT_INNER,
    PRESS,
    SEALING_FORCE,
    SIDE_CAMERA,
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
from aeros.sim.perception.bench_detection import detect_bench, is_filling_visible
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table
from aeros.sim.scenes.scene import DetectionFilter, unfiltered

DOUGH_FRICTION: Final = 0.001
"""Dry friction of the open wrapper's hinge, N·m: above 2 mN·m the lid lifts the whole wrapper."""

SEALED_FRICTION: Final = 0.5
"""Dry friction of the sealed wrapper's hinge, N·m: carrying and dropping do not open it."""


class DumplingBenchScene:
    """Scene of the bench: press, pot, wrapper on a tray, filling on a stand."""

    robot = RobotOptions()
    view = Camera(eye=(1.15, 0.55, 0.62), target=(0.42, 0.03, 0.1), field_of_view=40.0)
    pushable_objects: tuple[str, ...] = ("wrapper", "filling")
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("overhead",)

    def build(self, world: PhysicsWorld, robot: Panda, chance: RandomSource) -> None:
        """Implement `Scene.build`: tray and stand at random, wrapper and filling on them."""
        self._world = world
        add_table(world)
        self._press = world.bodies.add_urdf(str(MODELS / "press.urdf"), PRESS, fixed=True, friction=0.8)
        world.bodies.set_joint_friction(self._press, _LID, 0.005)
        world.bodies.set_joint_friction(self._press, _HANDLE, 0.0)
        add_open_box(world, POT_INNER, POT)
        laid = sample_bench_layout(chance)
        world.bodies.add_box((*TRAY_EDGES, TRAY[2]), *laid.tray)
        self._wrapper = world.bodies.add_urdf(str(MODELS / "wrapper.urdf"), *laid.wrapper, friction=0.8)
        world.bodies.set_joint_friction(self._wrapper, _FOLD, DOUGH_FRICTION)
        world.bodies.add_cylinder(STAND_RADIUS, STAND[2], laid.stand)
        side, height = FILLING
        green = (0.35, 0.55, 0.25, 1.0)
        self._filling = world.bodies.add_box((side, side, height), *laid.filling, mass=0.05, colour=green)
        self._sealed = False
        self._press_force = 0.0
        self._inspector = DumplingTracker()

    def tick(self) -> None:
        """Implement `Scene.tick`: measure the press force, and seal if fold, filling and force all pass."""
        plate_b = self._world.contacts(self._wrapper, self._filling, link=_FOLD)
        self._press_force = sum(contact.force for contact in plate_b)
        if not self._sealed and self._press_force > SEALING_FORCE and self._dumpling().is_closed:
            self._sealed = True
            self._world.bodies.set_joint_friction(self._wrapper, _FOLD, SEALED_FRICTION)
        self._inspector.add_press_force(self._press_force)

    def measure(self) -> Mapping[str, Any]:
        """Implement `Scene.measure`; see `bench_measurements`."""
        return bench_measurements(self._world.pose(self._press, _HANDLE).position, self._press_force)

    def body(self, name: str) -> int:
        """Implement `Scene.body`."""
        return {"wrapper": self._wrapper, "filling": self._filling}[name]

    def camera(self, name: str) -> Camera:
        """Implement `Scene.camera`: both are fixed."""
        return {"overhead": OVERHEAD_CAMERA, "side": SIDE_CAMERA}[name]

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """Implement `Scene.detect`: `overhead` sees the bench, `side` the inside of a closed wrapper."""
        if camera == "overhead":
            seen = detect_bench(self._world.renderer.render(OVERHEAD_CAMERA), OVERHEAD_CAMERA)
            wrapper = _apply_filter(through, seen.wrapper)
            filling = through(None if seen.filling is None else DetectedObject(seen.filling))
            place = None if filling is None else filling.position
            return self._inspector.add_overhead_view(wrapper, place, self._world.time)
        wrapper = _apply_filter(through, self._inspector.wrapper)
        filled = wrapper is not None and is_filling_visible(
            self._world.renderer.render(SIDE_CAMERA), SIDE_CAMERA, wrapper
        )
        return self._inspector.add_side_view(filled)

    def _dumpling(self) -> Dumpling:
        return Dumpling(
            self._world.pose(self._wrapper),
            self._world.joint_position(self._wrapper, _FOLD),
            self._world.pose(self._filling).position,
        )


def _apply_filter(through: DetectionFilter, wrapper: WrapperDetection | None) -> WrapperDetection | None:
    sight = through(None if wrapper is None else DetectedObject(wrapper.hinge))
    return None if wrapper is None or sight is None else wrapper._replace(hinge=sight.position)


_LID: Final = 0
_HANDLE: Final = 1
"""Joints of models/press.urdf."""

_FOLD: Final = 0
"""Joint of models/wrapper.urdf; plate B is its link."""
