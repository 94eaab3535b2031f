from threading import Thread

import pytest

from aeros.franka.arm import HandState
from aeros.franka.hand_loop import run_hand
from aeros.wired_arm.arm import ArmError
from aeros.wired_arm.link import event
from tests.unit.franka.stub.arms import Ends


class ScriptedHand:
    def __init__(self) -> None:
        self.state = HandState(0.04, False)
        self.calls: list[tuple[object, ...]] = []
        self.failure: ArmError | None = None

    def read(self) -> HandState:
        if self.failure is not None and not self.failure.is_connected:
            raise self.failure
        return self.state

    def open(self, gap: float, speed: float) -> None:
        self._do("open", gap, speed)

    def close(self, gap: float, speed: float, force: float) -> None:
        self._do("close", gap, speed, force)

    def _do(self, *call: object) -> None:
        self.calls.append(call)
        if self.failure is not None:
            raise self.failure


def answer(ends: Ends, hand: ScriptedHand, **message: object) -> dict[str, object]:
    """Send one message to the loop, and return its answer."""
    here, there = ends
    loop = Thread(target=run_hand, args=(hand, there))
    loop.start()
    here.send({**message})
    reply = here.receive(5.0)
    here.send(event("close"))
    loop.join(5.0)
    assert isinstance(reply, dict)
    return reply


def test_the_state_is_read_as_asked_for(ends: Ends) -> None:
    reply = answer(ends, ScriptedHand(), **event("read"))
    assert (reply["is"], reply["gap"], reply["grasped"]) == ("hand", 0.04, False)


@pytest.mark.parametrize(
    ("gap", "call"),
    [(0.08, ("open", 0.08, 0.1)), (0.04, ("open", 0.04, 0.1)), (0.0, ("close", 0.0, 0.1, 20.0))],
)
def test_fingers_open_or_close_with_a_force(ends: Ends, gap: float, call: tuple[object, ...]) -> None:
    hand = ScriptedHand()
    reply = answer(ends, hand, **event("grip", gap=gap, speed=0.1, force=20.0))
    assert (reply["is"], reply["reason"], hand.calls) == ("gripped", None, [call])


def test_a_refused_command_is_reported_with_its_reason(ends: Ends) -> None:
    hand = ScriptedHand()
    hand.failure = ArmError("the hand refused a command: width out of range")
    reply = answer(ends, hand, **event("grip", gap=0.08, speed=0.1, force=20.0))
    assert (reply["is"], reply["reason"]) == ("gripped", "the hand refused a command: width out of range")


def test_a_hand_that_is_gone_ends_the_loop(ends: Ends) -> None:
    hand = ScriptedHand()
    hand.failure = ArmError("the hand cannot be reached", is_connected=False)
    reply = answer(ends, hand, **event("read"))
    assert reply == {"is": "gone", "reason": "the hand cannot be reached"}


def test_the_loop_ends_when_the_plant_is_gone(ends: Ends) -> None:
    ends[0].close()
    run_hand(ScriptedHand(), ends[1])
