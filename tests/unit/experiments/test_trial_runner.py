"""Trials run once, wherever they run, and survive interruptions."""

from __future__ import annotations

import json
import os
import pickle
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import pytest

from aeros.experiments import trial_runner
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_kinds import EQUIVALENT_INTERVAL, Trial, condition_digest, kind_of
from aeros.experiments.trial_runner import (
    MAX_CHUNK_TRIALS,
    Chunk,
    InputsMismatchError,
    RunProgress,
    executor_at,
    local_executor,
    run_chunk,
    run_trials,
)
from aeros.experiments.trial_store import TRIALS_FILE, TrialStore
from aeros.experiments.trials import task
from aeros.experiments.trials.task import TaskTrials
from aeros.spec.diagnostics.errors import InternalError, MisuseError, UserError
from tests.unit.experiments.support.common import (
    ROOT,
    WHERE,
    Here,
    comparable_findings,
    condition,
    premises,
    settings,
)

_P = ParamSpec("_P")
_R = TypeVar("_R")

FETCH = condition(task="fetch_object")


def run(
    store: TrialStore, conditions: list[TrialCondition], trials: int, executor: Here | None = None
) -> list[RunProgress]:
    reports: list[RunProgress] = []

    def on_progress(progress: RunProgress) -> None:
        reports.append(RunProgress(progress.done, progress.total))

    run_trials(conditions, range(trials), WHERE, executor or Here(), 1, store, on_progress)
    return reports


def test_conditions_that_are_equal_share_their_trials(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        reports = run(store, [FETCH, condition(task="fetch_object")], 3)
        assert len(store.trials) == 3
    assert (reports[0].done, reports[-1].done, reports[-1].total) == (0, 3, 3)


def test_finished_trials_are_not_run_again(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        run(store, [FETCH], 3)
        before = dict(store.trials)
        executor = Here()
        assert run(store, [FETCH], 3, executor)[-1].total == 0
        assert executor.submitted == 0
        assert run(store, [FETCH], 5, executor)[-1].total == 2
        assert {key: store.trials[key] for key in before} == before


RATES = ("1/10", "3/10", "1/2", "7/10", "9/10")


def alone(one: TrialCondition, seed: int) -> dict[str, object]:
    """The trial by itself, but for what may differ: its time, and where it would have been the same."""
    with kind_of(one.kind).open(one, premises()) as trial:
        return comparable_findings(trial(seed), EQUIVALENT_INTERVAL)


@pytest.mark.parametrize(
    ("task", "architecture"),
    [
        ("clean_table", "flat"),
        ("clean_table", "behaviour_tree"),
        ("fetch_object", "aeros"),
        *(pytest.param("fetch_object", one, marks=pytest.mark.deep) for one in ("flat", "behaviour_tree")),
        pytest.param("clean_table", "aeros", marks=pytest.mark.deep),
    ],
)
def test_a_rate_at_which_a_trial_would_be_the_same_shares_it(
    architecture: str, task: str, tmp_path: Path
) -> None:
    conditions = [condition(architecture=architecture, task=task, rate=rate) for rate in RATES]
    with TrialStore(tmp_path) as store:
        run(store, conditions, 6)
        assert len(store.trials) == 30
        ran = {(seed, found["processor_s"]) for (_, seed), found in store.trials.items()}
        assert len(ran) < 30
        for one in conditions:
            for seed in range(6):
                assert comparable_findings(
                    store.trials[condition_digest(one, premises().digest), seed], EQUIVALENT_INTERVAL
                ) == alone(one, seed)


@pytest.mark.parametrize("architecture", ["behaviour_tree", pytest.param("aeros", marks=pytest.mark.deep)])
def test_a_length_of_bursts_with_which_a_trial_would_be_the_same_shares_it(
    architecture: str, tmp_path: Path
) -> None:
    conditions = [
        condition(architecture=architecture, task="clean_table", bursts={"mean_length": length})
        for length in ("2", "8", "32")
    ]
    with TrialStore(tmp_path) as store:
        run(store, conditions, 8)
        ran = {(seed, found["processor_s"]) for (_, seed), found in store.trials.items()}
        assert 8 < len(ran) < 24
        for one in conditions:
            for seed in range(8):
                assert comparable_findings(
                    store.trials[condition_digest(one, premises().digest), seed], EQUIVALENT_INTERVAL
                ) == alone(one, seed)


@pytest.mark.deep
@pytest.mark.physics
def test_physics_shares_trials_alike(tmp_path: Path) -> None:
    faults = (ROOT / "experiments/faults/fetch_object.yaml").read_text()
    made = settings("fetch_object", faults=faults)
    rates = ("1/10", "3/10", "9/10")
    conditions = [TrialCondition.create("task", "physics", {**made, "rate": rate}) for rate in rates]
    with TrialStore(tmp_path) as store:
        run(store, conditions, 1)
        found = [store.trials[condition_digest(one, premises().digest), 0] for one in conditions]
    # With seed 0 the object is missed at the highest rate alone.
    assert [one["failed_tries"] for one in found] == [0, 0, 1]
    assert found[0]["processor_s"] == found[1]["processor_s"]
    assert comparable_findings(found[1], EQUIVALENT_INTERVAL) == alone(conditions[1], 0)


def test_a_later_run_shares_what_an_earlier_one_kept(tmp_path: Path) -> None:
    low, high = (condition(task="fetch_object", rate=rate) for rate in ("1/1000", "1/500"))
    with TrialStore(tmp_path) as store:
        run(store, [low], 3)
        executor = Here()
        run(store, [low, high], 3, executor)
        assert executor.submitted == 0
        assert len(store.trials) == 6


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let Ctrl-C interrupt; processes that run tests side by side ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Interrupted(Here):
    """A process in which Ctrl-C comes with the first chunk."""

    def submit(self, fn: Callable[_P, _R], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_R]:
        signal.raise_signal(signal.SIGINT)
        return super().submit(fn, *args, **kwargs)


@pytest.mark.usefixtures("interruptible")
def test_an_interruption_keeps_what_was_under_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MAX_CHUNK_TRIALS, "symbolic", 2)
    with TrialStore(tmp_path) as store:
        with pytest.raises(KeyboardInterrupt):
            run(store, [FETCH], 5, Interrupted())
        assert len(store.trials) == 2
    with TrialStore(tmp_path) as store:
        assert run(store, [FETCH], 5)[-1].total == 3


def test_processes_find_what_this_one_finds(tmp_path: Path) -> None:
    with TrialStore(tmp_path / "here") as store:
        run(store, [FETCH], 4)
        here = dict(store.trials)
    with TrialStore(tmp_path / "there") as store, executor_at(None, 2) as (executor, workers):
        run_trials([FETCH], range(4), WHERE, executor, workers, store, lambda _: None)
        there = dict(store.trials)
    assert here.keys() == there.keys()
    for key, found in here.items():
        assert comparable_findings(found) == comparable_findings(there[key])


def test_a_worker_with_other_premises_refuses(tmp_path: Path) -> None:
    with pytest.raises(InputsMismatchError, match="worker inputs differ"):
        run_chunk(Chunk(WHERE, "another digest", ((0, (FETCH,)),), tmp_path / "aside.jsonl"))


def test_a_worker_here_answers_in_one_piece_however_many_trials_it_has_finished(tmp_path: Path) -> None:
    def chunk(name: str) -> Chunk:
        wanted = tuple((seed, (FETCH,)) for seed in range(40))
        return Chunk(WHERE, premises().digest, wanted, tmp_path / name)

    with executor_at(None, 1) as (executor, _):
        answer = executor.submit(run_chunk, chunk("here")).result()
    assert answer == (40, ())
    assert len(pickle.dumps(answer)) < select.PIPE_BUF / 10
    elsewhere = run_chunk(chunk("elsewhere"))
    assert len(pickle.dumps(elsewhere)) > select.PIPE_BUF
    assert elsewhere.number == len(elsewhere.trials) == 40
    assert len((tmp_path / "here").read_text().splitlines()) == 40


class Torn(Here):
    """A process of this machine whose files lose their last line."""

    def submit(self, fn: Callable[_P, _R], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_R]:
        answer = super().submit(fn, *args, **kwargs)
        (chunk,) = args
        assert isinstance(chunk, Chunk)
        chunk.spill_path.write_bytes(chunk.spill_path.read_bytes()[:-1])
        return answer


def test_finished_trials_that_are_not_there_are_not_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial_runner._WorkerState, "is_here", True)
    with TrialStore(tmp_path) as store, pytest.raises(InternalError, match="lacks some of the 3 trials"):
        run(store, [FETCH], 3, Torn())


def test_the_condition_is_named_by_all_that_decides_it() -> None:
    digests = {
        one.digest(known)
        for one in (
            FETCH,
            condition(),
            condition(rate="1/2"),
            TrialCondition.create("task", "physics", FETCH.settings),
        )
        for known in (premises().digest, "another")
    }
    assert len(digests) == 8


def test_a_refusal_by_a_worker_is_raised_here_and_finished_trials_are_kept(tmp_path: Path) -> None:
    unknown = TrialCondition.create("task", "symbolic", {**condition().settings, "task": "make_dumpling"})
    with TrialStore(tmp_path) as store, executor_at(None, 1) as (executor, workers):
        with pytest.raises(UserError) as refused:
            run_trials([FETCH, unknown], range(2), WHERE, executor, workers, store, lambda _: None)
        assert len(store.trials) == 2
    (problem,) = refused.value.diagnostics
    assert problem.headline == "no module has the task `make_dumpling`"
    assert problem.help == ("did you mean `make_dumplings`?",)


@pytest.mark.parametrize("address", ["ray://here", "dask"])
def test_another_executor_is_refused(address: str) -> None:
    with pytest.raises(MisuseError, match="expected `dask://HOST:PORT`"):
        executor_at(address, 1)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().split(")")[-1].split()[0] != "Z"


def _children(pid: int) -> list[int]:
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _started_run(tmp_path: Path) -> tuple[subprocess.Popen[str], list[int]]:
    """A long run that has finished some trials, and its workers."""
    command = [sys.executable, "-m", "aeros", "experiment", "4", "--plant", "symbolic", "--workers", "1"]
    process = subprocess.Popen(
        [*command, "--trials", "1000", "--out", str(tmp_path)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
    )
    log, latest = tmp_path / TRIALS_FILE, time.monotonic() + 120
    while not (log.exists() and log.stat().st_size) and time.monotonic() < latest:
        time.sleep(0.05)
    workers = _children(process.pid)
    assert workers
    return process, workers


def _assert_nothing_is_lost(folder: Path) -> int:
    """Every trial that a worker has finished is there; how many are."""
    written = [path.read_text() for path in folder.glob("*.jsonl")]
    whole = [line for text in written for line in text.splitlines(keepends=True) if line.endswith("\n")]
    finished = {(one["condition"], one["seed"]) for one in map(json.loads, whole)}
    with TrialStore(folder) as store:
        assert store.trials.keys() == finished
    assert [path.name for path in folder.glob("*.jsonl")] == [TRIALS_FILE]
    return len(finished)


def test_finished_trials_of_an_unfinished_chunk_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class EndsInTheThird(TaskTrials):
        @contextmanager
        def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
            with super().open(condition, premises) as trial:
                yield lambda seed: trial(seed) if seed < 2 else sys.exit("the third")

    with monkeypatch.context() as changed:
        changed.setattr(task, "KIND", EndsInTheThird())
        with TrialStore(tmp_path) as store, pytest.raises(SystemExit, match="the third"):
            run(store, [FETCH], 4)
        assert not store.trials
    assert _assert_nothing_is_lost(tmp_path) == 2
    with TrialStore(tmp_path) as store:
        assert run(store, [FETCH], 4)[-1].total == 2
        for (_, seed), found in store.trials.items():
            assert comparable_findings(found, EQUIVALENT_INTERVAL) == alone(FETCH, seed)


def test_every_worker_has_a_part_of_every_company(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        executor = Here()
        run_trials([FETCH], range(4), WHERE, executor, 2, store, lambda _: None)
        assert executor.submitted == 2


def test_a_worker_that_is_killed_ends_the_run_and_leaves_whole_trials(tmp_path: Path) -> None:
    process, workers = _started_run(tmp_path)
    os.kill(workers[0], signal.SIGKILL)
    _, output = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "a worker process died" in output
    assert f"continue with --out {tmp_path} --resume" in output
    _assert_nothing_is_lost(tmp_path)


_KILLED_AFTER_AN_INTERRUPTION = """\
import os, signal, time
from concurrent.futures import wait
from aeros.experiments.trial_runner import local_executor

with local_executor(2) as (pool, _):
    under_way = [one for one in [pool.submit(time.sleep, 600.0) for _ in range(4)] if not one.cancel()]
    os.kill(next(iter(pool._processes)), signal.SIGKILL)
    wait(under_way)[0].pop().result()
"""


def test_a_worker_that_is_killed_after_others_were_cancelled_ends_the_run() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _KILLED_AFTER_AN_INTERRUPTION],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 1
    assert "BrokenProcessPool" in done.stderr.splitlines()[-1]


@pytest.mark.deep
def test_a_second_interrupt_does_not_wait(tmp_path: Path) -> None:
    process, workers = _started_run(tmp_path)
    # A trial under way would never end, so a caller that waited for it would not return.
    os.kill(workers[0], signal.SIGSTOP)
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    output = ""
    while "press Ctrl-C again to abort" not in output:
        output += (line := process.stderr.readline())
        assert line
    process.send_signal(signal.SIGINT)
    _, more = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in output + more
    assert f"continue with --out {tmp_path} --resume" in more
    assert not any(map(_alive, workers))
    _assert_nothing_is_lost(tmp_path)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_workers_are_dismissed_does_not_wait_either(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shutdown = ProcessPoolExecutor.shutdown

    def interrupted(*given: Any, **more: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        shutdown(*given, **more)

    monkeypatch.setattr(ProcessPoolExecutor, "shutdown", interrupted)
    stack = ExitStack()
    pool, _ = stack.enter_context(local_executor(1))
    worker = pool.submit(os.getpid).result()
    os.kill(worker, signal.SIGSTOP)
    with pytest.raises(KeyboardInterrupt):
        stack.close()
    assert not _alive(worker)


@pytest.mark.parametrize("how", [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.deep)])
def test_a_run_that_is_ended_leaves_whole_trials_and_no_worker(how: signal.Signals, tmp_path: Path) -> None:
    process, workers = _started_run(tmp_path)
    latest = time.monotonic() + 60
    process.send_signal(how)
    _, output = process.communicate(timeout=60)
    assert process.returncode == (-signal.SIGKILL if how is signal.SIGKILL else 130)
    assert "Traceback" not in output
    if how is signal.SIGINT:
        assert "finishing running trials" in output
        assert f"continue with --out {tmp_path} --resume" in output
    while any(map(_alive, workers)) and time.monotonic() < latest:
        time.sleep(0.05)
    assert not any(map(_alive, workers))
    assert 0 < _assert_nothing_is_lost(tmp_path) < 15_000
