import pytest

from aeros.exit_codes import Exit
from aeros.franka.recover import recover
from tests.unit.franka.stub.arms import import_stub


def test_a_reflex_is_cleared_and_the_modes_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    import_stub(monkeypatch, mode=4)
    assert recover({"AEROS_FRANKA": "stub"}) == (Exit.SUCCESS, "the robot's mode was reflex, and is idle")


def test_without_an_address_or_a_robot_the_reason_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    assert recover({}) == (Exit.USAGE, "no robot is named: set AEROS_FRANKA to its address")
    import_stub(monkeypatch, refuses="libfranka: Connection timeout")
    code, text = recover({"AEROS_FRANKA": "stub"})
    assert code is Exit.REJECTED
    assert "the robot at `stub` cannot be reached: libfranka: Connection timeout" in text
