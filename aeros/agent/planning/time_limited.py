"""Thinks in a process of its own, while the plant's time and its monitor go on.

Whoever thinks may hang, spin, crash or take all memory: it has a process, which is killed, with whatever it
has started, once it has answered, is late or is not waited for any more; also when the agent dies.  Its
answer is data (JSON of a bounded length), and no more.  Its priority is lower than that of whoever watches
the robot.

What thinking costs: every whole second of it passes on the plant's clock, where the monitor looks at each
control tick and protective stops work as ever.  An answer within the first second costs nothing, and one
that never comes exactly what is allowed for it; so a simulated run is the same again wherever its plans
come that fast.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import select
import signal
import time
from collections.abc import Callable
from math import floor, inf
from typing import Any, Final

from aeros.descriptions import describe_exception
from aeros.runtime.ports import Runtime

MAX_MEMORY_BYTES: Final = 2 << 30
"""What thinking may take beyond what the agent has when it begins, bytes."""

MAX_ANSWER_BYTES: Final = 4 << 20
"""The longest answer, bytes."""

MOST_REASON: Final = 2000
"""Characters that are kept of the message of an exception that ended thinking."""

_POLL_INTERVAL_S: Final = 0.02  # s
_PR_SET_PDEATHSIG: Final = 1


class PlanningTimeoutError(Exception):
    """There is no answer in time, or nobody waits for one any more; the message says which."""


class PlannerProcessError(Exception):
    """There is no answer, as thinking broke off; the message says how."""


class PlannerProcess:
    """Has an answer worked out while the runtime goes on.

    within: seconds allowed for each.
    until: plant seconds after which nothing is waited for any more.
    seconds: the clock by which thinking is timed.
    """

    def __init__(
        self,
        runtime: Runtime,
        timeout_s: float,
        deadline: float = inf,
        seconds: Callable[[], float] = time.monotonic,
    ) -> None:
        self._runtime = runtime
        self._within = timeout_s
        self._until = deadline
        self._seconds = seconds

    def __call__(self, job: Callable[[], Any]) -> Any:
        """What `think` returns: JSON values.  Raises `PlanningTimeoutError` and `PlannerProcessError`."""
        began = self._runtime.now()
        within = min(self._within, self._until - began)
        since, charged = self._seconds(), 0
        with _Child(job) as thought:
            while not thought.has_finished(_POLL_INTERVAL_S):
                if self._runtime.is_stopped:
                    raise PlanningTimeoutError("the operator has stopped everything")
                spent = self._seconds() - since
                if spent >= within:
                    break
                if floor(spent) > charged:
                    charged = floor(spent)
                    self._advance_plant(began + charged)
            else:
                return thought.result()
        self._advance_plant(began + max(0.0, within))
        raise PlanningTimeoutError(f"nothing came within {within:g} s")

    def _advance_plant(self, until: float) -> None:
        """Let the plant's time go on, whatever ends meanwhile: no step is the thinker's own."""
        while self._runtime.wait(until) is not None:
            pass


class _Child:
    """A process that thinks, as long as it is entered."""

    def __init__(self, think: Callable[[], Any]) -> None:
        self._said = bytearray()
        reading, writing = os.pipe()
        parent = os.getpid()
        self._pid = os.fork()
        if self._pid == 0:
            os.close(reading)
            _run_in_child(think, writing, parent)
        os.close(writing)
        self._pipe = reading
        os.set_blocking(reading, False)
        self._poll = select.poll()
        self._poll.register(reading, select.POLLIN)

    def __enter__(self) -> _Child:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._pipe)
        for kill in (os.killpg, os.kill):  # its group, and itself where it has not made that yet
            try:
                kill(self._pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        os.waitpid(self._pid, 0)

    def has_finished(self, within: float) -> bool:
        """Whether it has said all that it will, after `within` seconds at most."""
        if not self._poll.poll(within * 1000):
            return False
        said = os.read(self._pipe, 1 << 16)
        self._said += said
        return not said or len(self._said) > MAX_ANSWER_BYTES

    def result(self) -> Any:
        """What it has said; raises `PlannerProcessError`."""
        if len(self._said) > MAX_ANSWER_BYTES:
            raise PlannerProcessError(f"its answer is longer than {MAX_ANSWER_BYTES} bytes")
        try:
            said = json.loads(bytes(self._said))
        except (ValueError, RecursionError) as error:
            raise PlannerProcessError("its process ended without an answer") from error
        if type(said) is dict and said.keys() == {"answer"}:
            return said["answer"]
        why = said["failed"] if type(said) is dict and said.keys() == {"failed"} else "it is no answer"
        raise PlannerProcessError(str(why))


def _run_in_child(think: Callable[[], Any], writing: int, parent: int) -> None:
    """In the new process: think, say it, and end without any of the agent's clean-up."""
    try:
        _isolate_child(parent)
        try:
            said = json.dumps({"answer": think()})
        except BaseException as error:  # whoever waits hears of it, whatever it is
            said = json.dumps({"failed": describe_exception(error, MOST_REASON, one_line=True)})
        with open(writing, "wb", closefd=False) as pipe:
            pipe.write(said.encode())
    finally:
        os._exit(0)


def _isolate_child(parent: int) -> None:
    """End with the agent and with one signal; take neither its terminal, its priority nor its memory."""
    os.setpgid(0, 0)
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    os.nice(10)
    with open("/proc/self/statm", encoding="ascii") as file:
        taken = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = taken + MAX_MEMORY_BYTES
    resource.setrlimit(
        resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
    )
