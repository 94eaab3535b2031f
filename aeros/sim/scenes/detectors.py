"""Detections in pictures of the shipped tasks' scenes.

This is perception, and belongs to the modules; until they bring their own, a scene whose file is named in
`_DETECTORS` is looked at from here. Other scenes have cameras and no detections.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import dist
from typing import TYPE_CHECKING, Any, Final, Protocol

from aeros.sim.detected_object import DetectedObject
from aeros.sim.layouts import table
from aeros.sim.layouts.dumpling_bench import DumplingTracker, WrapperDetection
from aeros.sim.perception.bench_detection import detect_bench, is_filling_visible
from aeros.sim.perception.detection import MIN_PIXELS
from aeros.sim.perception.inspection import inspect_table
from aeros.sim.perception.table_detection import detect_table
from aeros.sim.scenes.scene import DetectionFilter

if TYPE_CHECKING:
    from aeros.sim.scenes.physics_scene import PhysicsScene


class Detector(Protocol):
    """Detections in the pictures of one scene file."""

    def tick(self) -> None:
        """Update after a tick."""

    def measure(self) -> Mapping[str, Any]:
        """Measure what follows from earlier pictures, and is felt and counted.

        Returns:
            Values by vocabulary name, SI, positions in W.
        """

    def detect(self, camera: str, through: DetectionFilter) -> Mapping[str, Any]:
        """Take a picture and evaluate it.

        Args:
            camera: name of the camera; nothing is detected with one of another scene file.
            through: filter of each detection.

        Returns:
            Detections by vocabulary name, SI, positions in W; None for what is no longer known.
        """


def detectors_of(scene: PhysicsScene) -> tuple[Detector, ...]:
    """Make the detectors of a scene.

    Args:
        scene: the scene, which has been built.

    Returns:
        One for each of its files that has any, in their order.
    """
    parts = [part for part in scene.scene.parts if part.name in _DETECTORS]
    return tuple(_DETECTORS[part.name](scene, part.prefix) for part in parts)


class _TableDetector:
    """Sponge and clutter in pictures from above, and the verdict of the mast's camera."""

    def __init__(self, scene: PhysicsScene, prefix: str) -> None:
        self._scene = scene
        self._prefix = prefix

    def tick(self) -> None:
        """Implement `Detector.tick`: nothing changes."""

    def measure(self) -> Mapping[str, Any]:
        """Implement `Detector.measure`; see `table_measurements`."""
        dirt = f"{self._prefix}dirt"
        is_coated = dirt in self._scene.scene.coatings
        return table.table_measurements(self._scene.wiped_share(dirt)) if is_coated else {}

    def detect(self, camera: str, through: DetectionFilter) -> Mapping[str, Any]:
        """Implement `Detector.detect`.

        `overhead` detects sponge and clutter; see `table_detections`. `mast` verifies: the area is clean,
        the sponge is at its rest and nothing else is there; a picture that shows no sponge verifies
        nothing.
        """
        place = f"{self._prefix}sponge_rest_position"
        rest = self._scene.state.value(place) if place in self._scene.scene.places else None
        match camera.removeprefix(self._prefix):
            case "overhead":
                view = detect_table(*self._scene.picture(camera))
                pieces = map(through, view.pieces)
                shown = [piece for piece in pieces if piece is not None]
                return table.table_detections(rest, through(view.sponge), shown)
            case "mast":
                seen = inspect_table(*self._scene.picture(camera))
                sponge = through(None if seen.sponge is None else DetectedObject(seen.sponge))
                returned = (
                    sponge is not None
                    and rest is not None
                    and dist(sponge.position, rest) < table.REST_TOLERANCE
                )
                is_clean = seen.clean_share >= table.WIPED_THRESHOLD and seen.other_pixels < MIN_PIXELS
                return {"table_verified": returned and is_clean}
        return {}


class _BenchDetector:
    """Wrapper and filling in pictures from above, and the filling inside from the side."""

    def __init__(self, scene: PhysicsScene, prefix: str) -> None:
        self._scene = scene
        self._prefix = prefix
        self._tracker = DumplingTracker()

    def tick(self) -> None:
        """Implement `Detector.tick`: note the force of the press."""
        self._tracker.add_press_force(self._scene.state.value(f"{self._prefix}press_force"))

    def measure(self) -> Mapping[str, Any]:
        """Implement `Detector.measure`: nothing but instruments."""
        return {}

    def detect(self, camera: str, through: DetectionFilter) -> Mapping[str, Any]:
        """Implement `Detector.detect`: `overhead` sees the bench, `side` the inside of a closed wrapper."""
        match camera.removeprefix(self._prefix):
            case "overhead":
                seen = detect_bench(*self._scene.picture(camera))
                wrapper = _filtered(through, seen.wrapper)
                filling = through(None if seen.filling is None else DetectedObject(seen.filling))
                place = None if filling is None else filling.position
                return self._tracker.add_overhead_view(wrapper, place, self._scene.time)
            case "side":
                wrapper = _filtered(through, self._tracker.wrapper)
                filled = wrapper is not None and is_filling_visible(*self._scene.picture(camera), wrapper)
                return self._tracker.add_side_view(filled)
        return {}


def _filtered(through: DetectionFilter, wrapper: WrapperDetection | None) -> WrapperDetection | None:
    sight = through(None if wrapper is None else DetectedObject(wrapper.hinge))
    return None if wrapper is None or sight is None else wrapper._replace(hinge=sight.position)


_DETECTORS: Final[Mapping[str, Callable[[PhysicsScene, str], Detector]]] = {
    "table": _TableDetector,
    "dumpling_bench": _BenchDetector,
}
"""Detectors by the name of the scene file."""
