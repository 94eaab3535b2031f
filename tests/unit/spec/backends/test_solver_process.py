"""A question takes no longer than its time limit, also where the solver does not look at it."""

from __future__ import annotations

import atexit
import io
import json
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest
import z3

from aeros.spec.backends import solver_process, z3_scripts
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.backends.solver_process import SOLVER_PROCESS, SolverProcess, SolverSession
from aeros.spec.backends.solver_results import NoAnswerError, Question, SatResult, ScriptAnswer, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER

X, Y = (t.Variable(name, RealType(NUMBER), t.VariableRole.STATE) for name in "xy")
RANGES = {name: (Fraction(-9), Fraction(9)) for name in "xy"}
SILENT = "import sys; sys.exit(3)"


def product_above(bound: int) -> t.Term:
    return t.Compare("<", t.Literal(Fraction(bound), RealType(NUMBER)), t.Multiply(X, Y))


@pytest.fixture
def solver() -> Iterator[SolverProcess]:
    one = SolverProcess()
    yield one
    one._end()


def ask(solver: SolverProcess, bound: int, seconds: float = 10.0) -> SatResult:
    return solver.check_sat([X, Y], RANGES, [product_above(bound)], 1_000_000, seconds).result


def test_questions_are_answered_one_after_the_other_by_one_process(solver: SolverProcess) -> None:
    found = solver.check_sat([X, Y], RANGES, [product_above(80)], 1_000_000, 10.0)
    assert found.result is SatResult.SAT
    x, y = found.model["x"], found.model["y"]
    assert isinstance(x, Fraction)
    assert isinstance(y, Fraction)
    assert x * y > 80
    first = solver._process
    assert ask(solver, 81) is SatResult.UNSAT
    assert solver._process is first


def test_a_solver_that_does_not_listen_is_ended_and_the_next_question_is_answered(
    solver: SolverProcess,
) -> None:
    started = time.monotonic()
    with pytest.raises(NoAnswerError, match=r"^no answer within 0\.1 s$"):
        solver.ask(pow, 7, 10**9, seconds=0.1)  # one call of C, which no handler interrupts
    assert time.monotonic() - started < 20
    assert solver._process is None
    assert ask(solver, 80) is SatResult.SAT


def test_a_solver_that_waits_for_a_processor_is_not_late(solver: SolverProcess) -> None:
    assert solver.ask(time.sleep, 2.5, seconds=0.1) is None  # a sleep takes no processor time either


def test_a_process_that_was_killed_is_started_anew(solver: SolverProcess) -> None:
    assert ask(solver, 80) is SatResult.SAT
    assert solver._process is not None
    os.kill(solver._process.pid, signal.SIGKILL)
    solver._process.wait()
    assert ask(solver, 81) is SatResult.UNSAT


def test_a_solver_that_ends_by_itself_leaves_the_question_undecided(solver: SolverProcess) -> None:
    with pytest.raises(NoAnswerError, match=r"^the solver's process has ended \(7\)$"):
        solver.ask(os._exit, 7, seconds=5.0)
    found = SolverProcess(SILENT).check_sat([X], RANGES, [], 1, 5.0)
    assert found == SolverAnswer(SatResult.UNKNOWN, {}, "the solver does not start")


def test_a_solver_that_takes_all_memory_leaves_the_question_undecided(solver: SolverProcess) -> None:
    with pytest.raises(NoAnswerError, match=r"^the solver gave up: MemoryError$"):
        solver.ask(bytes, 5 << 30, seconds=5.0)
    assert ask(solver, 80) is SatResult.SAT


def test_a_question_that_is_nested_too_deeply_is_undecided(solver: SolverProcess) -> None:
    term: t.Term = product_above(80)
    for _ in range(100_000):
        term = t.Not(term)
    found = solver.check_sat([X, Y], RANGES, [term], 1_000_000, 5.0)
    assert found == SolverAnswer(SatResult.UNKNOWN, {}, "the question is nested too deeply")


def test_a_child_of_a_fork_asks_a_process_of_its_own(solver: SolverProcess) -> None:
    assert ask(solver, 80) is SatResult.SAT
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            os._exit(0 if ask(solver, 81) is SatResult.UNSAT else 1)
        os._exit(2)
    assert os.waitpid(child, 0)[1] == 0
    assert ask(solver, 81) is SatResult.UNSAT


def test_a_session_goes_on_with_its_assumptions_also_in_a_new_process() -> None:
    session = SolverSession([X, Y])
    session.assume(product_above(80))
    negative = t.Compare("<", X, t.Literal(Fraction(0), RealType(NUMBER)))
    assert session.check_sat(negative).result is SatResult.SAT
    session.assume(t.Not(negative))
    assert session.check_sat(negative).result is SatResult.UNSAT
    assert session.check_sat(t.TRUE).result is SatResult.SAT
    SOLVER_PROCESS._end()
    assert session.check_sat(negative).result is SatResult.UNSAT
    other = SolverSession([X])
    assert other.check_sat(negative).result is SatResult.SAT
    assert session.check_sat(negative).result is SatResult.UNSAT


def test_a_question_of_a_session_has_a_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    def late(*_: object, seconds: float) -> SolverAnswer:
        raise NoAnswerError(f"no answer within {seconds:g} s")

    monkeypatch.setattr(SolverProcess, "ask", late)
    found = SolverSession([X], seconds=2.5).check_sat(t.TRUE)
    assert found == SolverAnswer(SatResult.UNKNOWN, {}, "no answer within 2.5 s")
    solved = SOLVER_PROCESS.solve_script("(check-sat)", 1, 2.5)
    assert solved == ScriptAnswer(SatResult.UNKNOWN, {}, 0, 0, "no answer within 2.5 s")
    assert SOLVER_PROCESS.check_together([Question([X], {}, [t.TRUE])] * 3, 1, 2.5) == [None] * 3


def test_a_session_sends_what_is_new(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []

    def answer(*arguments: object, seconds: float) -> SolverAnswer:
        given.append((*arguments[3:], seconds))
        return SolverAnswer(SatResult.SAT, {})

    monkeypatch.setattr(SolverProcess, "ask", answer)
    session = SolverSession([X], seconds=2.5)
    first, second = product_above(1), product_above(2)
    session.assume(first)
    session.check_sat(t.TRUE)
    session.assume(second)
    session.check_sat(t.FALSE)
    session.check_sat(t.TRUE)
    assert given == [
        ((X,), (first,), t.TRUE, 2.5, 2.5),
        (None, (second,), t.FALSE, 2.5, 2.5),
        (None, (), t.TRUE, 2.5, 2.5),
    ]


def _refuse(reason: type[BaseException]) -> None:
    raise reason("why")


def test_the_solver_process_answers_until_its_input_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its program runs here, without the limits on this process, which are noted."""
    asked, written = io.BytesIO(), io.BytesIO()
    questions: list[tuple[Callable[..., object], tuple[object, ...], float]] = [
        (pow, (2, 10), 1.5),
        (_refuse, (MemoryError,), 2.5),
        (_refuse, (RecursionError,), 2.5),
        (_refuse, (NoAnswerError,), 3.5),
    ]
    for question in questions:
        solver_process._send(asked, pickle.dumps(question))
    asked.seek(0)
    limits: list[object] = []
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=asked))
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(buffer=written))
    for module, name in ((signal, "signal"), (signal, "setitimer"), (resource, "setrlimit")):
        monkeypatch.setattr(module, name, lambda *given, name=name: limits.append((name, *given)))
    for hard, most in ((resource.RLIM_INFINITY, 4 << 30), (5 << 30, 4 << 30), (1 << 30, 1 << 30)):
        monkeypatch.setattr(resource, "getrlimit", {resource.RLIMIT_AS: (7, hard)}.__getitem__)
        asked.seek(0)
        written.seek(0)
        written.truncate()
        limits.clear()
        solver_process.answer_questions()
        written.seek(0)
        assert solver_process._receive(written, None) == b"ready"
        answers = [pickle.loads(solver_process._receive(written, None)) for _ in questions]  # noqa: S301
        assert answers == [
            (1024, ""),
            (None, "the solver gave up: MemoryError"),
            (None, "the solver gave up: RecursionError"),
            (None, "why"),
        ]
        assert limits[:3] == [
            ("signal", signal.SIGINT, signal.SIG_IGN),
            ("signal", signal.SIGPROF, signal.SIG_DFL),
            ("setrlimit", resource.RLIMIT_AS, (most, hard)),
        ]
        assert limits[3:] == [
            ("setitimer", signal.ITIMER_PROF, limit)
            for *_, seconds in questions
            for limit in (seconds + solver_process.GRACE_S, 0)
        ]


def test_a_question_is_the_arguments_of_a_solver() -> None:
    above = product_above(80)
    for bound, expected in ((80, SatResult.SAT), (81, SatResult.UNSAT)):
        found = solver_process._solve_terms([X, Y], RANGES, [product_above(bound)], 1_000_000, 10.0)
        assert found.result is expected
    question = Question([X, Y], RANGES, [above])
    other = Question([X, Y], RANGES, [product_above(81)])
    answers = solver_process._solve_together([question, other], 1_000_000, 10.0)
    assert [answer and answer.result for answer in answers] == [SatResult.SAT, SatResult.UNSAT]
    assert solver_process._solve_script("(assert false)(check-sat)", 1_000).result is SatResult.UNSAT


def test_a_script_is_solved_with_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[object] = []
    monkeypatch.setattr(z3_scripts, "solve_script", lambda *arguments: given.append(arguments))
    solver_process._solve_script("(check-sat)", 123)
    assert given == [("(check-sat)", 123)]


def test_the_solver_process_solves_what_it_is_asked() -> None:
    assert SOLVER_PROCESS.solve_script("(assert false)(check-sat)", 1_000, 5.0).result is SatResult.UNSAT
    question = Question([X, Y], RANGES, [product_above(81)])
    (found,) = SOLVER_PROCESS.check_together([question], 1_000_000, 5.0)
    assert found == SolverAnswer(SatResult.UNSAT, {})


class _Pipe(io.BytesIO):
    """Stream that takes and gives at most three bytes at a time, as a pipe may."""

    def write(self, content: Any) -> int:
        return super().write(bytes(content[:3]))

    def read(self, count: int | None = -1) -> bytes:
        assert count is not None
        assert count > 0
        return super().read(min(count, 3))


def test_messages_are_taken_apart_as_they_were_sent() -> None:
    pipe = _Pipe()
    sent = [b"first", b"", b"a longer one, of more than one part", b"x"]
    for content in sent:
        solver_process._send(pipe, content)
    pipe.seek(0)
    assert [solver_process._receive(pipe, None) for _ in sent] == sent
    assert solver_process._receive(pipe, None) == b""
    whole = pipe.getvalue()
    for end in range(8 + len(sent[0])):
        assert solver_process._receive(_Pipe(whole[:end]), None) == b""


def test_a_message_that_does_not_come_in_time_is_empty() -> None:
    out, into = os.pipe()
    with os.fdopen(out, "rb", buffering=0) as reader, os.fdopen(into, "wb", buffering=0) as writer:
        assert solver_process._receive(reader, 0.01) == b""
        solver_process._send(writer, b"in time")
        assert solver_process._receive(reader, 0.01) == b"in time"
        writer.write(b"\0" * 7)
        assert solver_process._receive(reader, 0.01) == b""


def test_a_process_ends_with_the_one_that_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    at_exit: list[Callable[[], object]] = []
    monkeypatch.setattr(atexit, "register", at_exit.append)
    one = SolverProcess()
    for _ in range(2):
        assert one.ask(abs, -3, seconds=5.0) == 3
        process = one._process
        assert process is not None
        (end,) = at_exit
        end()
        assert process.returncode == -signal.SIGKILL
        assert one._process is None


def test_a_process_has_the_path_and_memory_settings_of_the_one_that_asks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[tuple[list[str], dict[str, Any]]] = []
    start = subprocess.Popen

    def noted(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        started.append((command, options))
        return start([sys.executable, "-c", SILENT], **options)

    monkeypatch.setattr(subprocess, "Popen", noted)
    monkeypatch.setenv("SOME", "setting")
    with pytest.raises(NoAnswerError, match=r"^the solver does not start$"):
        SolverProcess("the program").ask(abs, -3, seconds=5.0)
    ((command, options),) = started
    assert command == [sys.executable, "-I", "-S", "-c", "the program", json.dumps(sys.path)]
    assert options["stderr"] == subprocess.DEVNULL, "its complaints are not for people"
    assert options["bufsize"] == 0
    kept = {f"MALLOC_{name}_THRESHOLD_": str(2**30) for name in ("TRIM", "MMAP")}
    assert options["env"] == {**os.environ, **kept}


def test_an_interrupted_question_ends_the_process_so_that_no_other_gets_its_answer(
    solver: SolverProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solver.ask(abs, -3, seconds=5.0) == 3
    receive = solver_process._receive

    def interrupted(*_: object) -> bytes:
        monkeypatch.setattr(solver_process, "_receive", receive)
        raise KeyboardInterrupt

    monkeypatch.setattr(solver_process, "_receive", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solver.ask(abs, -4, seconds=5.0)
    assert solver._process is None
    assert solver.ask(abs, -5, seconds=5.0) == 5


def test_an_answer_may_take_ten_times_its_limit_by_the_clock(
    solver: SolverProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: list[float | None] = []
    receive = solver_process._receive

    def noted(stream: object, seconds: float | None) -> bytes:
        limits.append(seconds)
        return receive(stream, seconds)

    monkeypatch.setattr(solver_process, "_receive", noted)
    for _ in range(2):
        assert solver.ask(abs, -3, seconds=1.5) == 3
    assert limits == [120, 55.0, 55.0]  # it starts once; a grace of 2 s counts at both ends


DEAF = (
    "import os, sys; os.close(0); "
    "sys.stdout.buffer.write(bytes(7) + b'\\x05ready'); sys.stdout.buffer.flush()"
)
"""It starts, takes no question and ends."""


def test_a_process_that_ends_before_it_is_asked_leaves_the_question_undecided() -> None:
    solver = SolverProcess(DEAF)
    with pytest.raises(NoAnswerError, match=r"^(the solver's process has ended|no answer within)"):
        solver.ask(len, bytes(1 << 20), seconds=5.0)
    assert solver._process is None


def test_a_process_that_is_silent_for_too_long_is_killed(
    solver: SolverProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solver.ask(abs, -3, seconds=5.0) == 3
    process = solver._process
    assert process is not None
    monkeypatch.setattr(solver_process, "_receive", lambda *_: b"")
    with pytest.raises(NoAnswerError, match=r"^no answer within 5 s$"):
        solver.ask(abs, -4, seconds=5.0)
    assert process.returncode == -signal.SIGKILL


def test_after_a_fork_the_process_and_the_lock_are_the_parents(solver: SolverProcess) -> None:
    assert solver.ask(abs, -3, seconds=5.0) == 3
    process, lock = solver._process, solver._lock
    assert process is not None
    with lock:  # of a thread that the child does not have
        solver._leave_to_parent()
        assert solver.ask(abs, -4, seconds=5.0) == 4
        assert solver._process is not process
        assert process.poll() is None
    process.kill()
    process.communicate()


def test_a_session_has_the_budget_and_its_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    limits: dict[str, object] = {}
    monkeypatch.setattr(z3.Solver, "set", lambda solver, name, value: limits.update({name: value}))
    answer = solver_process._solve_in_session("a session", (X, Y), (), product_above(3), 2.5)
    assert answer is not None
    assert answer.result is SatResult.SAT
    assert limits == {"random_seed": 0, "rlimit": DEFAULT_RLIMIT, "timeout": 2500}
    assert solver_process._solve_in_session("another", None, (), t.TRUE, 2.5) is None
