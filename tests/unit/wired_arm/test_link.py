import socket

import pytest

from aeros.wired_arm.arm import ArmState
from aeros.wired_arm.link import (
    JudgedMessage,
    LinkClosedError,
    Message,
    ProcessLink,
    StartMessage,
    StateMessage,
    decode,
    encode,
    event,
)
from tests.unit.franka.stub.arms import READY, Ends, line

STATE = ArmState(1.25, READY, (0.1,) * 7, READY, (1.0,) * 7, (0.5,) * 7, 2, 0.98)


@pytest.mark.parametrize(
    "message",
    [
        StateMessage(STATE, True),
        StateMessage(STATE, False),
        JudgedMessage(3.5),
        StartMessage(line(READY, 0.1) * 3, 1.5),
        event("ended", reason=None, lost=2),
    ],
)
def test_each_message_is_read_as_it_was_written(message: Message) -> None:
    assert decode(encode(message)) == message


@pytest.mark.parametrize("data", [b"S12", b"T", b"P" + b"\0" * 20, b"J{", b"?"])
def test_other_bytes_close_the_link(data: bytes) -> None:
    with pytest.raises(LinkClosedError):
        decode(data)


def test_messages_stay_whole_and_in_order(ends: Ends) -> None:
    here, other = ends
    here.send(JudgedMessage(1.0))
    here.send(event("read"))
    assert [other.receive(), other.receive(), other.receive()] == [JudgedMessage(1.0), event("read"), None]


def test_to_wait_for_a_message_ends_after_the_time(ends: Ends) -> None:
    assert ends[0].receive(0.01) is None


def test_a_reader_that_does_not_read_makes_sending_fail_and_not_wait(
    ends: Ends,
) -> None:
    sent = 0
    while ends[0].send(StateMessage(STATE, True)):
        sent += 1
        assert sent < 100_000
    assert sent > 20


@pytest.mark.parametrize("message", [JudgedMessage(1.0), event("read")])
def test_a_link_whose_other_end_is_gone_is_closed_for_both_directions(ends: Ends, message: Message) -> None:
    here, other = ends
    other.close()
    with pytest.raises(LinkClosedError):
        here.receive()
    with pytest.raises(LinkClosedError):
        here.send(message)


def test_the_last_words_of_an_end_that_is_closed_with_messages_unread_are_read(ends: Ends) -> None:
    here, other = ends
    here.send(JudgedMessage(1.0))
    other.send(event("gone", reason="the robot cannot be reached"))
    other.close()
    assert here.receive() == event("gone", reason="the robot cannot be reached")
    with pytest.raises(LinkClosedError):
        here.receive()


def test_an_end_has_a_descriptor_until_it_is_closed() -> None:
    end, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    link = ProcessLink(end)
    assert link.fileno() == end.fileno()
    link.close()
    assert link.fileno() == -1
    other.close()
