"""A working camera leaves a detection unchanged."""

from __future__ import annotations

import pytest

from aeros.sim.detected_object import DetectedObject
from aeros.sim.scenes.scene import unfiltered


@pytest.mark.parametrize("found", [None, DetectedObject((0.1, 0.2, 0.3), 0.5)])
def test_a_working_camera_changes_no_detection(found: DetectedObject | None) -> None:
    assert unfiltered(found) is found
