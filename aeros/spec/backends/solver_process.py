"""Solvers in a process of their own, which the kernel ends if a question takes too long.

Z3 looks at its own time limit now and then, and its resource units do not count all of its work: a question
with products of ten variables took minutes for a budget of a second. So every question is put to another
process, which sets an alarm before it answers and dies by it, whatever code it is in. The alarm counts
processor time, so that a busy machine changes no answer.
"""

from __future__ import annotations

import atexit
import json
import os
import pickle
import resource
import select
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import count
from typing import TYPE_CHECKING, Any, Final, TypeVar

from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, QUESTION_SECONDS
from aeros.spec.backends.solver_results import (
    NoAnswerError,
    Question,
    SatResult,
    ScriptAnswer,
    SolverAnswer,
    timeout_answer,
)
from aeros.spec.expr import terms as t

if TYPE_CHECKING:
    from aeros.spec.backends.z3_solver import IncrementalSolver

GRACE_S: Final = 2
"""Seconds of processor time after the limit for which a solver may go on before its process ends."""

_WAITING: Final = 10
"""A solver may take so many times its limit by the clock, for the sake of others that use the processor."""

MAX_MEMORY_BYTES: Final = 4 << 30
"""Memory that a solver may use, bytes; the shipped modules and theorems need a twentieth."""

_START_S: Final = 120  # s; Python and Z3 start within 0.3 s on an idle processor
_LENGTH: Final = struct.Struct(">Q")
_PROGRAM: Final = (
    "import gc, json, sys; gc.disable(); sys.path[:] = json.loads(sys.argv[1]); "
    "from aeros.spec.backends.solver_process import answer_questions; answer_questions()"
)

_KEEPS_MEMORY: Final = {"MALLOC_TRIM_THRESHOLD_": str(1 << 30), "MALLOC_MMAP_THRESHOLD_": str(1 << 30)}
"""Settings of the C library: the 16 MB of a question's context are kept for the next, which saves 5 ms."""

_T = TypeVar("_T")
_Ranges = Mapping[str, tuple[Fraction, Fraction]]


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
        os.register_at_fork(after_in_child=self._leave_to_parent)

    def ask(self, answer: Callable[..., _T], *arguments: object, seconds: float) -> _T:
        """Have a question answered.

        Args:
            answer: function of a module that answers it.
            arguments: its arguments; they and the answer can be pickled.
            seconds: limit of processor time, s.

        Returns:
            The answer.

        Raises:
            NoAnswerError: there is none after `seconds` and at most a few more, or it cannot be had.
        """
        try:
            question = pickle.dumps((answer, arguments, seconds))
        except RecursionError as error:
            raise NoAnswerError("the question is nested too deeply") from error
        with self._lock:
            process = self._running()
            if process is None:
                raise NoAnswerError("the solver does not start")
            content = b""
            try:
                _send(process.stdin, question)
                content = _receive(process.stdout, _WAITING * (seconds + 2 * GRACE_S))
            except OSError:
                pass  # it has ended, as below
            except BaseException:
                self._end()  # its answer would be taken for that to the next question
                raise
            if content:
                found: _T
                found, reason = pickle.loads(content)  # noqa: S301  our own process wrote it
                if reason:
                    raise NoAnswerError(reason)
                return found
            self._end()
            if process.returncode in (-signal.SIGPROF, -signal.SIGKILL):
                raise NoAnswerError(timeout_answer(seconds).reason)
            raise NoAnswerError(f"the solver's process has ended ({process.returncode})")

    def check_sat(
        self,
        variables: Sequence[t.Variable],
        ranges: _Ranges,
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
            The answer; UNKNOWN if there is none in time.
        """
        given = (tuple(variables), dict(ranges), tuple(terms), rlimit, seconds)
        try:
            return self.ask(_solve_terms, *given, seconds=seconds)
        except NoAnswerError as why:
            return SolverAnswer(SatResult.UNKNOWN, {}, str(why))

    def check_together(
        self, questions: Sequence[Question], rlimit: int, seconds: float
    ) -> list[SolverAnswer | None]:
        """Check for several questions if all terms of each can hold together.

        Args:
            questions: the questions.
            rlimit: budget of one step, in Z3's resource units.
            seconds: time limit of all together, s.

        Returns:
            The answers, SAT or UNSAT; None where a question has to be asked alone.
        """
        try:
            return self.ask(_solve_together, tuple(questions), rlimit, seconds, seconds=seconds)
        except NoAnswerError:
            return [None] * len(questions)

    def solve_script(self, script: str, rlimit: int, seconds: float) -> ScriptAnswer:
        """Solve a script by Z3.

        Args:
            script: SMT-LIB text with one `check-sat`.
            rlimit: budget in Z3's resource units.
            seconds: time limit, s.

        Returns:
            The answer; UNKNOWN if there is none in time.
        """
        try:
            return self.ask(_solve_script, script, rlimit, seconds=seconds)
        except NoAnswerError as why:
            return ScriptAnswer(SatResult.UNKNOWN, {}, 0, 0, str(why))

    def _running(self) -> subprocess.Popen[bytes] | None:
        """Return the process, started if need be; None if it does not start."""
        if self._process is not None and self._process.poll() is None:
            return self._process
        self._end()
        if self._owner == 0:
            atexit.register(self._end)
        self._owner = os.getpid()
        self._process = subprocess.Popen(  # noqa: S603  our own program
            # `-S` leaves out the search for site packages, as the program takes our path.
            [sys.executable, "-I", "-S", "-c", self._program, json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env=os.environ | _KEEPS_MEMORY,
        )
        if not _receive(self._process.stdout, _START_S):
            self._end()
            return None
        return self._process

    def _leave_to_parent(self) -> None:
        """After a fork: the process is the parent's, and so is whoever holds the lock."""
        self._lock = threading.Lock()
        self._process = None

    def _end(self) -> None:
        """Kill the process and wait for its end."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        self._process = None


SOLVER_PROCESS: Final = SolverProcess()
"""The solver process of this process; it starts with the first question."""

_SESSION_IDS = count(1)


class SolverSession:
    """Questions on growing assumptions, which the solver process keeps from one question to the next.

    Args:
        variables: every free variable of assumptions and questions.
        seconds: time limit of one question, s.
    """

    def __init__(self, variables: Sequence[t.Variable], seconds: float = QUESTION_SECONDS) -> None:
        self._key = f"{os.getpid()} {next(_SESSION_IDS)}"
        self._variables = tuple(variables)
        self._seconds = seconds
        self._assumed: list[t.Term] = []
        self._sent = 0

    def assume(self, term: t.Term) -> None:
        """Add an assumption for all later questions.

        Args:
            term: boolean term without past-time operators.
        """
        self._assumed.append(term)

    def check_sat(self, term: t.Term) -> SolverAnswer:
        """Check if the assumptions and a term can hold together.

        Args:
            term: boolean term without past-time operators; it is forgotten afterwards.

        Returns:
            The answer; UNKNOWN if there is none in time.
        """
        try:
            answer = self._ask(None, self._assumed[self._sent :], term) if self._sent else None
            if answer is None:  # not open yet, or the process was ended over another question
                answer = self._ask(self._variables, self._assumed, term)
        except NoAnswerError as why:
            return SolverAnswer(SatResult.UNKNOWN, {}, str(why))
        self._sent = len(self._assumed)
        found: SolverAnswer = answer
        return found

    def _ask(
        self, variables: tuple[t.Variable, ...] | None, assumptions: Sequence[t.Term], term: t.Term
    ) -> Any:
        """Return what `_solve_in_session` does."""
        given = (self._key, variables, tuple(assumptions), term, self._seconds)
        return SOLVER_PROCESS.ask(_solve_in_session, *given, seconds=self._seconds)


def answer_questions() -> None:
    """Answer questions from standard input until it ends; the program of the solver process."""
    # Importing Z3 takes 80 ms, which is not part of any question.
    import aeros.spec.backends.z3_group  # noqa: F401

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    signal.signal(signal.SIGPROF, signal.SIG_DFL)  # ends this process, also amid the code of a solver
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = MAX_MEMORY_BYTES if hard == resource.RLIM_INFINITY else min(hard, MAX_MEMORY_BYTES)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    _send(sys.stdout.buffer, b"ready")
    while question := _receive(sys.stdin.buffer, None):
        answer, arguments, seconds = pickle.loads(question)  # noqa: S301  from our parent process
        signal.setitimer(signal.ITIMER_PROF, seconds + GRACE_S)
        try:
            content = pickle.dumps((answer(*arguments), ""))
        except (MemoryError, RecursionError) as error:
            content = pickle.dumps((None, f"the solver gave up: {type(error).__name__}"))
        except NoAnswerError as error:
            content = pickle.dumps((None, str(error)))
        signal.setitimer(signal.ITIMER_PROF, 0)
        _send(sys.stdout.buffer, content)


def _solve_terms(
    variables: Sequence[t.Variable], ranges: _Ranges, terms: Sequence[t.Term], rlimit: int, seconds: float
) -> SolverAnswer:
    from aeros.spec.backends.portfolio import decide

    return decide(Question(variables, ranges, terms), rlimit, seconds)


def _solve_together(questions: Sequence[Question], rlimit: int, seconds: float) -> list[SolverAnswer | None]:
    from aeros.spec.backends.z3_group import answer_together

    return answer_together(questions, rlimit, seconds)


def _solve_script(script: str, rlimit: int) -> ScriptAnswer:
    from aeros.spec.backends.z3_scripts import solve_script

    return solve_script(script, rlimit)


_sessions: dict[str, IncrementalSolver] = {}
"""The latest session of the solver process."""


def _solve_in_session(
    key: str,
    variables: Sequence[t.Variable] | None,
    assumptions: Sequence[t.Term],
    term: t.Term,
    seconds: float,
) -> SolverAnswer | None:
    """Answer a question of a session; None if the session is not open and its variables are not given."""
    from aeros.spec.backends.z3_solver import IncrementalSolver

    if variables is not None:
        _sessions.clear()
        _sessions[key] = IncrementalSolver(variables, {}, DEFAULT_RLIMIT, seconds=seconds)
    solver = _sessions.get(key)
    if solver is None:
        return None
    for one in assumptions:
        solver.assume(one)
    return solver.check_sat(term)


def _send(stream: Any, content: bytes) -> None:
    rest = memoryview(_LENGTH.pack(len(content)) + content)
    while rest:
        rest = rest[stream.write(rest) :]
    stream.flush()


def _receive(stream: Any, seconds: float | None) -> bytes:
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
