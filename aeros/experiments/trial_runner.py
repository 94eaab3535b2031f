"""Runs trials on any `concurrent.futures.Executor`, and keeps them as soon as a worker is done with them.

What is finished already is not run again, and neither is what a finished trial says would be the same
(`kinds.SharesTrials`).  An interruption lets what is under way finish and be kept; a second one does not
wait, and
kills what is under way here.  Which worker runs what, and in which order, has no bearing on what is found.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count
from math import ceil
from pathlib import Path
from typing import Final, NamedTuple

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import InputPaths, load_inputs
from aeros.experiments.interruptions import InterruptCounter
from aeros.experiments.trial_kinds import (
    EQUIVALENT_INTERVAL,
    Findings,
    Trial,
    comparison_group_of,
    condition_digest,
    kind_of,
    scheduling_group_of,
)
from aeros.experiments.trial_store import SpillFile, StoredTrial, TrialStore
from aeros.spec.diagnostics.errors import InternalError, MisuseError

MAX_CHUNK_TRIALS: Final[Mapping[str, int]] = {"symbolic": 200, "physics": 1}
"""Trials that a worker runs for one answer at most, or those of one seed: one takes seconds on physics."""

_CHUNKS_PER_WORKER: Final = 2
"""Chunks given out for each worker: one that it runs and one that waits."""

_POLL_INTERVAL_S: Final = 0.1
"""Seconds between looks at whether somebody interrupts."""


class Chunk(NamedTuple):
    """Trials of conditions that keep company, for one worker.

    premises: the digest that the worker's own must have.
    wanted: seeds, each with the conditions that it is wanted of.
    aside: the file for what is finished of it, see `store.SpillFile`.
    """

    paths: InputPaths
    inputs_digest: str
    trials_by_seed: tuple[tuple[int, tuple[TrialCondition, ...]], ...]
    spill_path: Path

    @property
    def trials(self) -> int:
        """How many are wanted."""
        return sum(len(conditions) for _, conditions in self.trials_by_seed)


@dataclass(slots=True)
class RunProgress:
    """How far it has come: trials done of so many, when it began, and whether it was interrupted."""

    done: int
    total: int
    start_time: float
    is_interrupted: bool = False

    @property
    def seconds_left(self) -> float | None:
        """At the pace so far."""
        spent = time.monotonic() - self.start_time
        return spent * (self.total - self.done) / self.done if self.done else None


class ChunkResult(NamedTuple):
    """What came of a chunk: so many trials, and those of them that whoever asked does not find aside."""

    number: int
    trials: tuple[StoredTrial, ...]


_Answer = Future[ChunkResult]


class SecondInterruptError(KeyboardInterrupt):
    """A second interruption: what is under way is not waited for, and lost."""


class InputsMismatchError(Exception):
    """A worker has other modules, another site or other code than whoever asked."""


def run_chunk(chunk: Chunk) -> ChunkResult:
    """What each trial of `chunk` found; what a worker runs.

    A condition of which a trial that has run says that it would have been the same is not tried again.
    A process of the pool here hands nothing over: its answer fits into its pipe at once (`PIPE_BUF`).  Who
    has read half of a longer one waits for ever where its writer is killed, as others can write there, too.
    """
    premises = load_inputs(chunk.paths)
    if premises.digest != chunk.inputs_digest:
        raise InputsMismatchError("a worker has other modules, another site or another release of AEROS")
    finished: list[StoredTrial] = []
    with ExitStack() as stack:
        aside = stack.enter_context(SpillFile(chunk.spill_path))
        trials: dict[TrialCondition, Trial] = {}
        for seed, conditions in chunk.trials_by_seed:
            had: dict[str, list[Findings]] = {}
            for condition in conditions:
                family, number = comparison_group_of(condition)
                one = _find_equivalent(number, had.setdefault(family, []))
                if one is None:
                    if condition not in trials:
                        opened = kind_of(condition.kind).open(condition, premises)
                        trials[condition] = stack.enter_context(opened)
                    one = trials[condition](seed)
                    had[family].append(one)
                finished.append(StoredTrial(condition_digest(condition, chunk.inputs_digest), seed, one))
                aside.append(finished[-1])
    return ChunkResult(len(finished), () if _WorkerState.is_here else tuple(finished))


def _find_equivalent(number: float, had: Iterable[Findings]) -> Findings | None:
    """Of a family's trials with one seed, the one that its condition with that number would have found."""
    for one in had:
        low, high = one.get(EQUIVALENT_INTERVAL, (number, number))
        if low < number < high:
            return one
    return None


def run_trials(
    conditions: Iterable[TrialCondition],
    seeds: Sequence[int],
    where: InputPaths,
    executor: Executor,
    workers: int,
    store: TrialStore,
    on_progress: Callable[[RunProgress], None],
) -> None:
    """Run whatever the store does not have of `conditions` for `seeds`.

    For the main thread alone, which Ctrl-C comes to.
    tell: hears whenever trials were kept.  Raises KeyboardInterrupt once what was under way is kept, and
    `SecondInterruptError` where another interruption comes before that.
    """
    premises = load_inputs(where).digest
    chunks = list(_missing(dict.fromkeys(conditions), seeds, where, premises, store, workers))
    progress = RunProgress(0, sum(chunk.trials for chunk in chunks), time.monotonic())
    on_progress(progress)
    queue, running = iter(chunks), dict[_Answer, Chunk]()
    with InterruptCounter() as interrupted:
        try:
            while True:
                while len(running) < _CHUNKS_PER_WORKER * workers and not interrupted.count:
                    if (chunk := next(queue, None)) is None:
                        break
                    running[executor.submit(run_chunk, chunk)] = chunk
                if interrupted.count and not progress.is_interrupted:
                    progress.is_interrupted = True
                    on_progress(progress)
                    running = {future: chunk for future, chunk in running.items() if not future.cancel()}
                if interrupted.count > 1:
                    raise SecondInterruptError
                if not running:
                    break
                _store_finished(running, store, progress, on_progress)
        finally:
            for future in running:
                future.cancel()
    if interrupted.count:
        raise KeyboardInterrupt


def _store_finished(
    running: dict[_Answer, Chunk],
    store: TrialStore,
    progress: RunProgress,
    tell: Callable[[RunProgress], None],
) -> None:
    done, _ = wait(running, _POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
    # What was refused comes last, so that all else is kept.
    for future in sorted(done, key=lambda one: one.exception() is not None):
        chunk = running.pop(future)
        number, trials = future.result()
        if trials:
            store.append(trials, chunk.spill_path)
        elif store.merge_spill(chunk.spill_path) < number:
            raise InternalError(f"{chunk.spill_path} lacks some of the {number} trials that are finished")
        progress.done += number
    if done:
        tell(progress)


def _missing(
    conditions: Iterable[TrialCondition],
    seeds: Sequence[int],
    where: InputPaths,
    premises: str,
    store: TrialStore,
    workers: int,
) -> Iterator[Chunk]:
    numbers = count()
    companies: dict[tuple[str, str, str], list[TrialCondition]] = {}
    for condition in conditions:
        key = condition.kind, condition.plant, scheduling_group_of(condition)
        companies.setdefault(key, []).append(condition)
    for (_, plant, _), company in companies.items():
        wanted = [
            (seed, tuple(left)) for seed in seeds if (left := _remaining(company, seed, premises, store))
        ]
        # Every worker has a part of every company, however few they are.
        size = max(1, min(MAX_CHUNK_TRIALS[plant] // len(company), ceil(len(wanted) / workers)))
        for first in range(0, len(wanted), size):
            chosen = tuple(wanted[first : first + size])
            yield Chunk(where, premises, chosen, store.spill_path(next(numbers)))


def _remaining(
    company: Sequence[TrialCondition], seed: int, premises: str, store: TrialStore
) -> list[TrialCondition]:
    """Those of which no trial with that seed is there, nor one that says that it would be the same."""
    digests = {condition: condition_digest(condition, premises) for condition in company}
    had: dict[str, list[Findings]] = {}
    for condition, digest in digests.items():
        if (one := store.trials.get((digest, seed))) is not None:
            had.setdefault(comparison_group_of(condition)[0], []).append(one)
    left = []
    for condition, digest in digests.items():
        if (digest, seed) in store.trials:
            continue
        family, number = comparison_group_of(condition)
        same = _find_equivalent(number, had.get(family, ()))
        if same is None:
            left.append(condition)
        else:
            store.append([StoredTrial(digest, seed, same)])
    # What is listed last goes on longest, as a rule, so the others find that what they ask has been asked.
    return left[::-1]


@contextmanager
def local_executor(workers: int) -> Iterator[tuple[Executor, int]]:
    """Processes on this machine, and how many."""
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(workers, initializer=_init_worker, initargs=(os.getpid(),))
    is_patient = True
    try:
        yield pool, workers
    except (SecondInterruptError, BrokenExecutor):
        # The pool dismisses no worker any more where one that it had cancelled was to hear that it is broken.
        is_patient = False
        raise
    finally:
        with InterruptCounter() as interrupted:
            pool.shutdown(wait=False, cancel_futures=True)
            while left := [one for one in multiprocessing.active_children() if one not in others]:
                if interrupted.count or not is_patient:
                    for worker in left:
                        worker.kill()
                left[0].join(_POLL_INTERVAL_S)
        if interrupted.count:
            raise KeyboardInterrupt


class _WorkerState:
    """What kind of process this is."""

    is_here = False
    """Whether it works for another one of this machine, which sees the same files."""


def _init_worker(parent: int) -> None:
    """Leave interruptions to whoever keeps what is found, and end where that has ended without a word."""
    _WorkerState.is_here = True
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, args=(parent,), daemon=True).start()


def _exit_with_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def executor_at(address: str | None, workers: int) -> AbstractContextManager[tuple[Executor, int]]:
    """The processes of this machine, or those of a cluster at `dask://HOST:PORT`.  Raises `MisuseError`."""
    if address is None:
        return local_executor(workers)
    if not address.startswith("dask://"):
        raise MisuseError(f"`{address}` is no executor; expected `dask://HOST:PORT`")
    try:
        from aeros.experiments.cluster import dask_executor
    except ImportError as error:
        needs = f"`{address}` needs `pip install 'aeros[distributed]'` ({error.name} is missing)"
        raise MisuseError(needs) from error
    return dask_executor("tcp://" + address.removeprefix("dask://"))
