"""Detections from true poses in the shipped tasks' scenes.

This is perception, and belongs to the modules; until they bring their own, a scene whose file is named in
`_DETECTORS` is looked at from here. Other scenes have cameras and no detections.
Not modelled: occlusion of objects by the arm or anything else; detection errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera, Vector3, to_world, yaw_of
from aeros.sim.layouts import dumpling_bench, table
from aeros.sim.layouts.dumpling_bench import DumplingTracker, WrapperDetection
from aeros.sim.robot.robot import RobotState
from aeros.spec.model.scene import BodyPart

if TYPE_CHECKING:
    from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene


class ExactDetector(Protocol):
    """Detections in the pictures of one scene file, from true poses."""

    def tick(self) -> None:
        """Update after a tick."""

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Measure what follows from earlier pictures, and is felt and counted.

        Args:
            state: the robot's latest readings.
            time: now, s.

        Returns:
            Values by vocabulary name, SI, positions in W.
        """

    def detect(self, camera: str, view: Camera, time: float) -> Mapping[str, Any]:
        """Take a picture and evaluate it.

        Args:
            camera: name of the camera; nothing is detected with one of another scene file.
            view: the camera, in W.
            time: now, s.

        Returns:
            Detections by vocabulary name, SI, positions in W; None for what is no longer known.
        """


def detectors_of(scene: DeclaredScene) -> tuple[ExactDetector, ...]:
    """Make the detectors of a scene.

    Args:
        scene: the scene, which has been built.

    Returns:
        One for each of its files that has any, in their order.
    """
    parts = [part for part in scene.scene.parts if part.name in _DETECTORS]
    return tuple(_DETECTORS[part.name](scene, part.prefix) for part in parts)


class _TableDetector:
    """Sponge and clutter that are not held, and the verdict of the mast's camera."""

    def __init__(self, scene: DeclaredScene, prefix: str) -> None:
        self._scene = scene
        self._prefix = prefix

    def tick(self) -> None:
        """Implement `ExactDetector.tick`: nothing changes."""

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `ExactDetector.measure`; see `table_measurements`."""
        is_coated = f"{self._prefix}dirt" in self._scene.scene.coatings
        return table.table_measurements(self._wiped_share()) if is_coated else {}

    def detect(self, camera: str, view: Camera, time: float) -> Mapping[str, Any]:
        """Implement `ExactDetector.detect`: `overhead` detects objects, `mast` verifies."""
        place = f"{self._prefix}sponge_rest_position"
        rest: Vector3 | None = self._scene.state.value(place) if place in self._scene.scene.places else None
        pieces = [self._detection(name) for name in ("cube", "can")]
        seen = table.table_detections(
            rest, self._detection("sponge"), [piece for piece in pieces if piece is not None]
        )
        match camera.removeprefix(self._prefix):
            case "overhead":
                return seen
            case "mast":
                is_clean = self._wiped_share() >= table.WIPED_THRESHOLD
                return {"table_verified": is_clean and seen["table_organized"]}
        return {}

    def _wiped_share(self) -> float:
        return self._scene.wiped_share(f"{self._prefix}dirt")

    def _detection(self, name: str) -> DetectedObject | None:
        """Return an exact detection of an object; None if it is held or not in the scene."""
        body = f"{self._prefix}{name}"
        if body not in self._scene.scene.bodies or self._scene.is_carried(body):
            return None
        pose = self._scene.pose_of(BodyPart(body))
        return DetectedObject(pose.position, None, yaw_of(pose.orientation))


class _BenchDetector:
    """Wrapper and filling that are not held; a closed wrapper hides its filling."""

    def __init__(self, scene: DeclaredScene, prefix: str) -> None:
        self._scene = scene
        self._prefix = prefix
        self._tracker = DumplingTracker()

    def tick(self) -> None:
        """Implement `ExactDetector.tick`: note the force of the press."""
        self._tracker.add_press_force(self._scene.state.value(f"{self._prefix}press_force"))

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `ExactDetector.measure`: nothing but instruments."""
        return {}

    def detect(self, camera: str, view: Camera, time: float) -> Mapping[str, Any]:
        """Implement `ExactDetector.detect`: `overhead` sees the bench, `side` the inside of a wrapper."""
        is_closed = self._scene.state.value(f"{self._prefix}closed")
        match camera.removeprefix(self._prefix):
            case "overhead":
                return self._tracker.add_overhead_view(self._wrapper(), self._filling(is_closed), time)
            case "side":
                return self._tracker.add_side_view(is_closed)
        return {}

    def _wrapper(self) -> WrapperDetection | None:
        body = f"{self._prefix}wrapper"
        if self._scene.is_carried(body):
            return None
        pose = self._scene.pose_of(BodyPart(body))
        hinge = to_world(pose, (-dumpling_bench.HINGE_TO_PLATE, 0.0, 0.0))
        fold = self._scene.joint_position(BodyPart(body, "fold"))
        return WrapperDetection(hinge, yaw_of(pose.orientation), fold)

    def _filling(self, is_hidden: bool) -> Vector3 | None:
        body = f"{self._prefix}filling"
        if is_hidden or self._scene.is_carried(body):
            return None
        return self._scene.pose_of(BodyPart(body)).position


_DETECTORS: Final[Mapping[str, Callable[[DeclaredScene, str], ExactDetector]]] = {
    "table": _TableDetector,
    "dumpling_bench": _BenchDetector,
}
"""Detectors by the name of the scene file."""
