import os
import signal
from collections.abc import Iterator

import pytest

from aeros.franka.plant import PROCESS
from aeros.runtime.ports import Trajectory
from aeros.sim.robot.robot_file import read_robot
from aeros.wired_arm.arm_client import ArmClient, RobotLostError
from aeros.wired_arm.link import Message, ProcessLink, StartMessage, event
from tests.unit.franka.stub.arms import READY, line, use_stub
from tests.unit.franka.test_process import ARM

PLAN = Trajectory(read_robot("franka_fr3").body, (line(READY, 0.05),), (0.0,) * 3, (0.0,) * 3, 0.2)


@pytest.fixture
def arm(monkeypatch: pytest.MonkeyPatch) -> Iterator[ArmClient]:
    use_stub(monkeypatch)
    client = ArmClient(ARM, PROCESS)
    yield client
    client.close()
    client.close()


def test_a_motion_is_streamed_while_its_states_are_judged(arm: ArmClient) -> None:
    assert arm.refresh()
    assert not arm.refresh()
    arm.watch(on=True)
    arm.start(PLAN)
    while arm.is_streaming:
        if arm.wait():
            arm.acknowledge()
    assert arm.end == (None, False)
    assert arm.cycle_times["cycles"] > 100
    arm.watch(on=True)
    assert arm.wait()
    assert arm.state.q == pytest.approx([q + 0.05 for q in READY])


def test_a_process_that_dies_in_mid_motion_ends_the_motion(arm: ArmClient) -> None:
    arm.refresh()
    arm.start(PLAN)
    assert arm.wait()
    os.kill(arm.pid, signal.SIGKILL)
    with pytest.raises(RobotLostError, match="the other process has ended"):
        all(arm.wait() or True for _ in range(1000))
    assert not arm.is_streaming
    assert arm.end is not None
    assert str(arm.end.reason).startswith("gone: ")


def without_room(monkeypatch: pytest.MonkeyPatch, kind: type, times: int) -> list[Message]:
    """Let the link have no room for messages of a kind for some times; return those that were sent."""
    send, left = ProcessLink.send, [None] * times
    sent: list[Message] = []

    def limited(link: ProcessLink, message: Message) -> bool:
        if isinstance(message, kind):
            if left:
                left.pop()
                return False
            sent.append(message)
        return send(link, message)

    monkeypatch.setattr(ProcessLink, "send", limited)
    return sent


def test_an_order_to_brake_without_room_is_repeated(arm: ArmClient, monkeypatch: pytest.MonkeyPatch) -> None:
    arm.refresh()
    arm.watch(on=True)
    arm.start(PLAN)
    sent = without_room(monkeypatch, dict, 3)
    arm.brake()
    assert sent == []
    while arm.is_streaming:
        arm.wait()
    assert sent == [event("brake")]
    assert arm.end == (None, True)


def test_a_motion_without_room_for_its_order_has_not_begun(
    arm: ArmClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm.refresh()
    without_room(monkeypatch, StartMessage, 1)
    arm.start(PLAN)
    assert not arm.is_streaming
    assert arm.end is not None
    assert str(arm.end.reason).startswith("busy: the streaming process reads no orders")
    assert arm.ended_at == arm.state.time


def test_a_request_for_states_without_room_is_repeated(
    arm: ArmClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm.refresh()
    sent = without_room(monkeypatch, dict, 1)
    arm.watch(on=True)
    arm.watch(on=True)
    assert sent == [event("watch", on=True)]
    assert arm.wait()
