"""Planning in a separate process with a time limit, while plant time and its monitor continue.

A planner may hang, spin, crash or use up memory. Its process, and all that it started, is killed when it has
answered, is late or is no longer waited for, and also when the agent dies. Its answer is data (JSON of a
bounded length). Its priority is lower than that of the processes that monitor the robot.

Each whole second of planning passes on the plant's clock too. The monitor checks each control tick meanwhile,
and protective stops work as always. An answer within the first second costs no plant time, and a missing
answer costs exactly the time allowed. So simulated runs are reproducible if their plans come within a second.
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

from aeros.agent.planning.plan_json import MalformedPlanError
from aeros.agent.planning.strong_cyclic import NoPlanError
from aeros.descriptions import describe_exception
from aeros.runtime.ports import Runtime
from aeros.spec.planning.search_result import PlanUndecidedError

_EXPECTED_ERRORS: Final = (NoPlanError, PlanUndecidedError, MalformedPlanError)
"""Errors whose messages say why there is no plan."""

MAX_MEMORY_BYTES: Final = 2 << 30
"""Memory that a planner may use in addition to the agent's memory at its start, bytes."""

MAX_ANSWER_BYTES: Final = 4 << 20
"""The longest answer, bytes."""

MOST_REASON: Final = 2000
"""Characters that are kept of the message of an exception that ended thinking."""

_POLL_INTERVAL_S: Final = 0.02  # s
_PR_SET_PDEATHSIG: Final = 1


class PlanningTimeoutError(Exception):
    """A plan that did not come in time or is no longer waited for; the message says which."""


class PlannerProcessError(Exception):
    """A planner process that ended without an answer; the message says how."""


class PlannerProcess:
    """Runner of jobs in a separate process while the runtime continues.

    `timeout_s` is the wall time (s) for each job, `deadline` the plant time (s) at which any wait ends, and
    `seconds` the clock that measures the wall time.
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
        """Run a job.

        Args:
            job: function that returns JSON values.

        Returns:
            The JSON values that it returned.

        Raises:
            PlanningTimeoutError: it did not return in time, or the operator stopped everything.
            PlannerProcessError: it failed.
        """
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
        raise PlanningTimeoutError(f"there was no plan within {within:g} s")

    def _advance_plant(self, until: float) -> None:
        """Let plant time pass; steps that end meanwhile are not the planner's and are ignored."""
        while self._runtime.wait(until) is not None:
            pass


class _Child:
    """A process that runs a job; it is killed at the end of the `with` block."""

    def __init__(self, think: Callable[[], Any]) -> None:
        self._received = bytearray()
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
        """Wait at most `within` seconds; return True if the process has written its whole answer."""
        if not self._poll.poll(within * 1000):
            return False
        chunk = os.read(self._pipe, 1 << 16)
        self._received += chunk
        return not chunk or len(self._received) > MAX_ANSWER_BYTES

    def result(self) -> Any:
        """Return the answer.

        Raises:
            PlannerProcessError: the process failed, ended without an answer, or gave too long an answer.
        """
        if len(self._received) > MAX_ANSWER_BYTES:
            raise PlannerProcessError(f"its answer is longer than {MAX_ANSWER_BYTES} bytes")
        try:
            answer = json.loads(bytes(self._received))
        except (ValueError, RecursionError) as error:
            raise PlannerProcessError("its process ended without an answer") from error
        if type(answer) is dict and answer.keys() == {"answer"}:
            return answer["answer"]
        why = (
            answer["failed"]
            if type(answer) is dict and answer.keys() == {"failed"}
            else "its answer is malformed"
        )
        raise PlannerProcessError(str(why))


def planner_failure(error: BaseException) -> str:
    """Describe why a planner gives no plan.

    Args:
        error: what it raised.

    Returns:
        The message of an error that says why there is no plan; else the type of the error, too.
    """
    described = describe_exception(error, MOST_REASON, one_line=True)
    message = described.partition(": ")[2] if isinstance(error, _EXPECTED_ERRORS) else ""
    return message or described


def _run_in_child(think: Callable[[], Any], writing: int, parent: int) -> None:
    """Run the job in the new process, write its answer, and exit without the agent's clean-up."""
    try:
        _isolate_child(parent)
        try:
            answer = json.dumps({"answer": think()})
        except BaseException as error:  # the waiting process gets every exception
            answer = json.dumps({"failed": planner_failure(error)})
        with open(writing, "wb", closefd=False) as pipe:
            pipe.write(answer.encode())
    finally:
        os._exit(0)


def _isolate_child(parent: int) -> None:
    """Tie the process to the agent's life, and separate its terminal, signals, priority and memory."""
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
        used = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = used + MAX_MEMORY_BYTES
    resource.setrlimit(
        resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
    )
