"""The plant of any arm: without a hand, it offers no fingers and refuses to grip."""

from __future__ import annotations

from contextlib import closing

import pytest

from aeros.franka.plant import PROCESS
from aeros.runtime.ports import MotionCompletion
from aeros.wired_arm.arm_client import ArmClient
from aeros.wired_arm.arm_plant import ArmPlant
from aeros.wired_arm.measurements import Measurements
from aeros.wired_arm.planner import MotionPlanner
from tests.unit.franka.stub.arms import use_stub
from tests.unit.franka.test_plant import CLOSE, MODEL, Watch, move, run
from tests.unit.franka.test_process import ARM
from tests.unit.wired_arm.test_measurements import NAMES

BASE = (0.0, 0.0, 0.0)


def test_an_arm_without_a_hand_moves_and_does_not_grip(monkeypatch: pytest.MonkeyPatch) -> None:
    use_stub(monkeypatch)
    planner, measurements = MotionPlanner(MODEL, BASE, 0.003), Measurements(MODEL, BASE, NAMES)
    with closing(ArmPlant(ArmClient(ARM, PROCESS), planner, measurements, NAMES)) as plant:
        assert run(plant, move(), Watch()) == MotionCompletion(True)
        assert plant.plan(CLOSE) == MotionCompletion(False, "unknown kind: `grip` on an arm without a hand")
        assert plant.arm_process > 0
