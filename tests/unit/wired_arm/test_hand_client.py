import time

import pytest

from aeros.franka.plant import PROCESS
from aeros.wired_arm.hand_client import HandClient
from tests.unit.franka.stub.arms import use_stub


def wait(hand: HandClient) -> None:
    latest = time.monotonic() + 5.0
    while hand.is_busy and time.monotonic() < latest:
        hand.poll(1.0)
    assert not hand.is_busy


@pytest.mark.parametrize(("width", "holding"), [(0.03, True), (0.0, False)])
def test_the_hand_holds_what_is_wider_than_the_commanded_gap(
    monkeypatch: pytest.MonkeyPatch, width: float, holding: bool
) -> None:
    use_stub(monkeypatch, object=width)
    hand = HandClient("stub", 0.05, PROCESS)
    try:
        hand.refresh(1.0)
        assert hand.readings()["holding"].value is False
        hand.grip(0.01, 20.0)
        wait(hand)
        readings = hand.readings()
        assert readings["holding"].value is holding
        assert readings["finger_gap"].value == max(width, 0.01)
        assert 0.0 < readings["finger_gap"].time <= 1.0
        hand.grip(0.09, 20.0)
        wait(hand)
        assert hand.failure == "the hand refused a command: width out of range"
    finally:
        hand.close()
    hand.poll(2.0)
    assert (dict(hand.readings()), hand.is_busy) == ({}, False)
