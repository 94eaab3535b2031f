"""Z3 in a process of its own, which the kernel ends if a question takes too long.

Z3 looks at its own time limit now and then, and its resource units do not count all of its work: a question
with products of ten variables took minutes for a budget of a second. So it is put to another process, which
sets an alarm before each question and dies by it, whatever code it is in.
"""

from __future__ import annotations

import atexit
import json
import math
import os
import pickle
import select
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import IO, Final, cast

from aeros.spec.backends.solver_results import SatResult, SolverAnswer, timeout_answer
from aeros.spec.expr import terms as t

GRACE_S: Final = 2
"""Seconds after the time limit for which Z3 may go on before its process ends."""

_START_S: Final = 120  # s; Python and Z3 start within 0.3 s on an idle processor
_LENGTH: Final = struct.Struct(">Q")
_PROGRAM: Final = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from aeros.spec.backends.solver_process import answer_questions; answer_questions()"
)


class SolverProcess:
    """A process that answers one question after the other, and is started anew after it was ended.

    Safe to use from several threads; they wait for each other.

    Args:
        program: Python program of the process; `sys.argv[1]` is the caller's `sys.path`, as JSON.
    """

    def __init__(self, program: str = _PROGRAM) -> None:
        self._program = program
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0

    def check_sat(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
        rlimit: int,
        seconds: float,
    ) -> SolverAnswer:
        """Check if all terms can hold together.

        Args:
            variables: every free variable of the terms.
            ranges: closed range (SI) of each real scalar variable.
            terms: boolean terms without past-time operators.
            rlimit: budget in Z3's resource units.
            seconds: time limit, s.

        Returns:
            The answer; UNKNOWN `seconds` and at most a few seconds later if there is none.
        """
        question = pickle.dumps((tuple(variables), dict(ranges), tuple(terms), rlimit, seconds))
        with self._lock:
            process = self._running()
            if process is None:
                return SolverAnswer(SatResult.UNKNOWN, {}, "the solver does not start")
            content = b""
            try:
                _send(cast("IO[bytes]", process.stdin), question)
                content = _receive(cast("IO[bytes]", process.stdout), seconds + 2 * GRACE_S)
            except OSError:
                pass  # it has ended, as below
            except BaseException:
                self._end()  # its answer would be taken for that to the next question
                raise
            if content:
                answer: SolverAnswer = pickle.loads(content)  # noqa: S301  our own process wrote it
                return answer
            self._end()
            if process.returncode in (-signal.SIGALRM, -signal.SIGKILL):
                return timeout_answer(seconds)
            why = f"the solver's process has ended ({process.returncode})"
            return SolverAnswer(SatResult.UNKNOWN, {}, why)

    def _running(self) -> subprocess.Popen[bytes] | None:
        """Return the process, started if need be; None if it does not start."""
        if self._process is not None and self._owner == os.getpid() and self._process.poll() is None:
            return self._process
        self._end()
        if self._owner == 0:
            atexit.register(self._end)
        self._owner = os.getpid()
        self._process = subprocess.Popen(  # noqa: S603  our own program
            [sys.executable, "-I", "-c", self._program, json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )
        if not _receive(cast("IO[bytes]", self._process.stdout), _START_S):
            self._end()
            return None
        return self._process

    def _end(self) -> None:
        """Kill the process and wait for its end; after a fork it is the parent's, and left alone."""
        if self._process is not None and self._owner == os.getpid():
            self._process.kill()
            self._process.communicate()
        self._process = None


SOLVER_PROCESS: Final = SolverProcess()
"""The solver process of this process; it starts with the first question."""


def answer_questions(solve: Callable[..., SolverAnswer] | None = None) -> None:
    """Answer questions from standard input until it ends; the program of the solver process.

    Args:
        solve: answers one question, given as the arguments of `SolverProcess.check_sat`; None for Z3.
    """
    answer_question = _load_z3() if solve is None else solve
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # ends this process, also amid Z3's code
    _send(sys.stdout.buffer, b"ready")
    while question := _receive(sys.stdin.buffer, None):
        arguments = pickle.loads(question)  # noqa: S301  from our parent process
        signal.alarm(math.ceil(arguments[-1]) + GRACE_S)
        content = pickle.dumps(answer_question(*arguments))
        signal.alarm(0)
        _send(sys.stdout.buffer, content)


def _load_z3() -> Callable[..., SolverAnswer]:
    from aeros.spec.backends.z3_solver import IncrementalSolver

    def solve(
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
        rlimit: int,
        seconds: float,
    ) -> SolverAnswer:
        return IncrementalSolver(variables, ranges, rlimit, seconds=seconds).check_sat(*terms)

    return solve


def _send(stream: IO[bytes], content: bytes) -> None:
    rest = memoryview(_LENGTH.pack(len(content)) + content)
    while rest:
        rest = rest[stream.write(rest) :]
    stream.flush()


def _receive(stream: IO[bytes], seconds: float | None) -> bytes:
    """Receive one message; empty if the other side has ended or sends nothing for `seconds`."""
    content, wanted = b"", _LENGTH.size
    is_head = True
    while len(content) < wanted:
        if seconds is not None and not select.select([stream], [], [], seconds)[0]:
            return b""
        part = stream.read(wanted - len(content))
        if not part:
            return b""
        content += part
        if is_head and len(content) == wanted:
            content, wanted, is_head = b"", _LENGTH.unpack(content)[0], False
    return content
