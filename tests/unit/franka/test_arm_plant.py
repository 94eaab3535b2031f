"""The plant of any arm: without a hand, it offers no fingers and refuses to grip."""

from __future__ import annotations

from contextlib import closing

import pytest

from aeros.franka.arm_client import ArmClient
from aeros.franka.arm_plant import ArmPlant
from aeros.franka.measurements import Measurements
from aeros.franka.planner import MotionPlanner
from aeros.runtime.ports import MotionCompletion
from tests.unit.franka.stub.arms import use_stub
from tests.unit.franka.test_measurements import NAMES
from tests.unit.franka.test_plant import CLOSE, MODEL, Watch, move, run
from tests.unit.franka.test_process import ARM

BASE = (0.0, 0.0, 0.0)


def test_an_arm_without_a_hand_moves_and_does_not_grip(monkeypatch: pytest.MonkeyPatch) -> None:
    use_stub(monkeypatch)
    planner, measurements = MotionPlanner(MODEL, BASE, 0.003), Measurements(MODEL, BASE, NAMES)
    with closing(ArmPlant(ArmClient(ARM), planner, measurements, NAMES)) as plant:
        assert run(plant, move(), Watch()) == MotionCompletion(True)
        assert plant.plan(CLOSE) == MotionCompletion(False, "unknown kind: `grip` on an arm without a hand")
        assert plant.arm_process > 0
