import json
import sys
from pathlib import Path

import pytest

from aeros.franka.arm import HandState
from aeros.franka.libfranka import LibfrankaArm, LibfrankaHand, load_library
from aeros.wired_arm.arm import MODES, REFLEX, ArmError
from tests.unit.franka.stub.arms import READY, import_stub


def test_without_the_library_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylibfranka", None)
    with pytest.raises(ArmError, match=r"pip install '\.\[franka\]'"):
        load_library()


def test_a_state_has_what_the_robot_reports(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch)
    state = LibfrankaArm("stub", real_time=True).read()
    assert (state.time, state.q, MODES[state.mode]) == (0.001, READY, "idle")


def test_half_of_a_threshold_is_a_contact(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    log = tmp_path / "log"
    import_stub(monkeypatch, log=str(log))
    LibfrankaArm("stub", real_time=False).set_thresholds((30.0,) * 7, (40.0,) * 3 + (20.0,) * 3)
    connected, thresholds = log.read_text().splitlines()
    assert connected == "connect stub kIgnore"
    lists = json.loads(thresholds.removeprefix("thresholds "))
    assert lists == [[15.0] * 7, [30.0] * 7, [20.0] * 3 + [10.0] * 3, [40.0] * 3 + [20.0] * 3]


def test_positions_are_commanded_until_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch)
    arm = LibfrankaArm("stub", real_time=False)
    control = arm.start()
    state = control.read()
    control.write(tuple(q + 1e-4 for q in state.q_d), is_last=False)
    assert control.read().q[0] == pytest.approx(1e-4)
    control.write(state.q_d, is_last=True)
    assert MODES[arm.read().mode] == "idle"
    arm.stop()


def test_a_jump_is_answered_with_the_robots_reason_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch)
    arm = LibfrankaArm("stub", real_time=False)
    control = arm.start()
    with pytest.raises(ArmError, match=r"stopped by itself: .* a commanded joint speed jumped") as caught:
        control.write(tuple(q + 0.1 for q in READY), is_last=False)
    assert caught.value.is_connected
    assert arm.read().mode == REFLEX
    with pytest.raises(ArmError, match="the robot refused a command"):
        arm.start()
    arm.recover()
    arm.start()


def test_a_robot_that_cannot_be_reached_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch, refuses="libfranka: Connection to FCI refused")
    for part in (lambda: LibfrankaArm("10.0.0.9", real_time=False), lambda: LibfrankaHand("10.0.0.9")):
        with pytest.raises(ArmError, match=r"at `10.0.0.9` cannot be reached: .* refused") as caught:
            part()
        assert not caught.value.is_connected


def test_the_hand_opens_and_grasps_what_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch, object=0.03)
    hand = LibfrankaHand("stub")
    hand.close(0.0, 0.1, 20.0)
    assert hand.read() == HandState(0.03, True)
    hand.open(0.06, 0.1)
    assert hand.read() == HandState(0.06, False)
    with pytest.raises(ArmError, match="the hand refused a command: width out of range"):
        hand.open(0.09, 0.1)
