"""System calls through libc, with arguments in full width, and failures as OSError."""

from __future__ import annotations

import ctypes
import errno
import os
import signal
from collections.abc import Iterator

import pytest

from aeros.runtime.isolation.kernel import child_processes, end_descendants, process_control, system_call
from aeros.runtime.isolation.privileges import become_subreaper
from aeros.runtime.isolation.seccomp import ARCHITECTURES
from tests.unit.runtime.isolation.support.forked import in_child

PR_SET_NAME, PR_GET_NAME, PR_SET_TIMERSLACK, PR_GET_TIMERSLACK = 15, 16, 29, 30
PR_GET_NO_NEW_PRIVS = 39
CALLS = ARCHITECTURES[os.uname().machine].calls


@pytest.fixture
def name() -> Iterator[ctypes.Array[ctypes.c_char]]:
    """A buffer for this thread's name, which is what it was afterwards."""
    before = ctypes.create_string_buffer(16)
    process_control(PR_GET_NAME, before)
    yield ctypes.create_string_buffer(16)
    process_control(PR_SET_NAME, before)


def test_a_system_call_returns_its_result() -> None:
    assert system_call(CALLS["getpid"]) == os.getpid()


def test_a_failed_system_call_raises_what_the_kernel_says() -> None:
    with pytest.raises(OSError, match="Bad file descriptor") as failure:
        system_call(CALLS["close"], -1)
    assert failure.value.errno == errno.EBADF


def test_integers_and_objects_are_passed_in_full_width() -> None:
    read, write = os.pipe()
    data = ctypes.create_string_buffer(b"abc", 3)
    assert ctypes.addressof(data) > 2**32
    assert system_call(CALLS["write"], write, data, 3) == 3
    assert system_call(CALLS["write"], write, ctypes.addressof(data), 2) == 2
    assert os.read(read, 10) == b"abcab"
    os.close(read)
    os.close(write)


def test_process_control_fills_up_missing_arguments(name: ctypes.Array[ctypes.c_char]) -> None:
    assert process_control(PR_SET_NAME, b"a-name") == 0
    assert process_control(PR_GET_NAME, name) == 0
    assert name.value == b"a-name"
    # The kernel refuses this one unless all others are zero.
    assert process_control(PR_GET_NO_NEW_PRIVS) in (0, 1)
    other = ctypes.create_string_buffer(b"another")
    process_control(PR_SET_NAME, ctypes.addressof(other))
    process_control(PR_GET_NAME, ctypes.addressof(name))
    assert name.value == b"another"


def test_process_control_returns_the_result() -> None:
    slack = process_control(PR_GET_TIMERSLACK)
    assert process_control(PR_SET_TIMERSLACK, 123_456) == 0
    assert process_control(PR_GET_TIMERSLACK) == 123_456
    process_control(PR_SET_TIMERSLACK, slack)


def test_an_unknown_operation_raises() -> None:
    with pytest.raises(OSError, match="Invalid argument") as failure:
        process_control(123_456)
    assert failure.value.errno == errno.EINVAL


def test_all_descendants_are_found_and_ended() -> None:
    def end(_: int) -> list[list[int]]:
        become_subreaper()
        ready, write_end = os.pipe()
        if os.fork() == 0:
            if os.fork() == 0:
                os.setsid()
                os.write(write_end, b"x")
            signal.pause()
        os.read(ready, 1)
        (child,) = child_processes()
        (grandchild,) = child_processes(child)
        end_descendants()
        for ended in (child, grandchild):
            with pytest.raises(ProcessLookupError):
                os.kill(ended, 0)
        return [child_processes(), child_processes(child)]

    assert in_child(end) == [[], []]
