"""Run trials on any `concurrent.futures.Executor`, and store them as soon as a worker has finished them.

A finished trial is not run again, and neither is one that a finished trial says would be the same
(`trial_kinds.SharesTrials`).  A first interruption waits for running trials and stores them; a second one
does not wait, and kills the workers of this machine.  The findings do not depend on which worker runs which
trial, nor on the order.
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
from ipaddress import ip_address
from itertools import count
from math import ceil
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import urlsplit

from aeros.distribution import install_command
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
"""Most trials of a chunk, unless one seed has more: a trial takes seconds on physics."""

_CHUNKS_PER_WORKER: Final = 2
"""Chunks submitted for each worker: one that runs and one that waits."""

_POLL_INTERVAL_S: Final = 0.1
"""Seconds between checks for an interruption."""


class Chunk(NamedTuple):
    """Trials of one scheduling group, for one worker.

    Attributes:
        paths: files and folders that the worker loads its inputs from.
        inputs_digest: the digest that the worker's inputs must have.
        trials_by_seed: seeds, each with the conditions to try with it.
        spill_path: file for finished trials, see `trial_store.SpillFile`.
    """

    paths: InputPaths
    inputs_digest: str
    trials_by_seed: tuple[tuple[int, tuple[TrialCondition, ...]], ...]
    spill_path: Path

    @property
    def trials(self) -> int:
        """Number of trials."""
        return sum(len(conditions) for _, conditions in self.trials_by_seed)


@dataclass(slots=True)
class RunProgress:
    """Progress of a run.

    Attributes:
        done: trials finished.
        total: trials to run.
        is_interrupted: True if the user interrupted the run.
    """

    done: int
    total: int
    is_interrupted: bool = False


class ChunkResult(NamedTuple):
    """Result of a chunk.

    Attributes:
        number: trials finished.
        trials: those that the caller does not find in the spill file.
    """

    number: int
    trials: tuple[StoredTrial, ...]


_Answer = Future[ChunkResult]


class SecondInterruptError(KeyboardInterrupt):
    """A second interruption: running trials are not waited for, and lost."""


class InputsMismatchError(Exception):
    """A worker has other modules, another site or other code than the caller."""


def run_chunk(chunk: Chunk) -> ChunkResult:
    """Run the trials of a chunk in a worker.

    A condition is skipped if a trial that has run says that it would be the same.  A worker process of this
    machine returns no findings: its answer fits into its pipe at once (`PIPE_BUF`).  A process that has read
    half of a longer answer would wait forever if its writer were killed, as other processes can write to that
    pipe.

    Args:
        chunk: the trials.

    Returns:
        How many trials were finished, with their findings where the caller may not see the spill file.

    Raises:
        InputsMismatchError: this worker has other inputs than the caller.
    """
    premises = load_inputs(chunk.paths)
    if premises.digest != chunk.inputs_digest:
        raise InputsMismatchError("worker inputs differ: modules, site or AEROS version")
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
    """Find, among a family's trials with one seed, one that would have found the same with `number`."""
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
    """Run the trials of conditions and seeds that the store does not have.

    Only for the main thread, which receives Ctrl-C.

    Args:
        conditions: conditions to run trials of; equal ones are run once.
        seeds: seeds of the trials of each condition.
        where: modules and site.
        executor: runs chunks in its workers.
        workers: their number.
        store: keeps finished trials.
        on_progress: called whenever trials were stored, and at the start.

    Raises:
        KeyboardInterrupt: the user interrupted the run; all that was running is stored.
        SecondInterruptError: another interruption came before that.
        InputsMismatchError: a worker has other inputs.
    """
    premises = load_inputs(where).digest
    chunks = list(_missing(dict.fromkeys(conditions), seeds, where, premises, store, workers))
    progress = RunProgress(0, sum(chunk.trials for chunk in chunks))
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
    on_progress: Callable[[RunProgress], None],
) -> None:
    done, _ = wait(running, _POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
    # Failed chunks come last, so that all others are stored first.
    for future in sorted(done, key=lambda one: one.exception() is not None):
        chunk = running.pop(future)
        number, trials = future.result()
        if trials:
            store.append(trials, chunk.spill_path)
        elif store.merge_spill(chunk.spill_path) < number:
            raise InternalError(f"{chunk.spill_path} lacks some of the {number} trials that are finished")
        progress.done += number
    if done:
        on_progress(progress)


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
        # Every worker gets a part of every group, however few trials it has.
        size = max(1, min(MAX_CHUNK_TRIALS[plant] // len(company), ceil(len(wanted) / workers)))
        for first in range(0, len(wanted), size):
            chosen = tuple(wanted[first : first + size])
            yield Chunk(where, premises, chosen, store.spill_path(next(numbers)))


def _remaining(
    company: Sequence[TrialCondition], seed: int, premises: str, store: TrialStore
) -> list[TrialCondition]:
    """Return the conditions without a stored trial of that seed; store those known to be the same."""
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
    # Conditions that are listed last usually take longest, so the others find their requests in the cache.
    return left[::-1]


@contextmanager
def local_executor(workers: int) -> Iterator[tuple[Executor, int]]:
    """Start worker processes on this machine, and end them afterwards.

    Args:
        workers: their number.

    Yields:
        The executor, and the number of its workers.

    Raises:
        KeyboardInterrupt: the user interrupted while the workers were ending; they are killed.
        BrokenExecutor: a worker process ended by itself.
        SecondInterruptError: the user interrupted the block twice.
    """
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(workers, initializer=_init_worker, initargs=(os.getpid(),))
    is_patient = True
    try:
        yield pool, workers
    except (SecondInterruptError, BrokenExecutor):
        # A broken pool ends no workers if it fails while it tells a cancelled future that it is broken.
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
    """State of this process as a worker."""

    is_here = False
    """True if the process serves another process of this machine, which sees the same files."""


def _init_worker(parent: int) -> None:
    """Ignore interruptions, which the parent handles, and exit if the parent has died."""
    _WorkerState.is_here = True
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, args=(parent,), daemon=True).start()


def _exit_with_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


class TlsFiles(NamedTuple):
    """Files, in PEM, by which a client and a cluster know each other.

    Attributes:
        authority: certificate of the authority that signs for both.
        certificate: certificate of this client.
        key: private key of this client.
    """

    authority: Path
    certificate: Path
    key: Path


def executor_at(
    address: str | None, workers: int, tls: TlsFiles | None = None
) -> AbstractContextManager[tuple[Executor, int]]:
    """Choose the processes of this machine, or those of a cluster.

    Without TLS, every process that reaches a scheduler can run code on its workers. So one on another machine
    needs TLS.

    Args:
        address: `dask://HOST:PORT`; None for this machine.
        workers: number of processes on this machine.
        tls: files for an encrypted connection; None for a plain one.

    Returns:
        A context with the executor and the number of its workers.

    Raises:
        MisuseError: the address is none, it needs TLS, or a package is missing.
    """
    if address is None:
        if tls is not None:
            raise MisuseError("the files of TLS are for a cluster: name one with `--executor`")
        return local_executor(workers)
    if not address.startswith("dask://"):
        raise MisuseError(f"`{address}` is not an executor; expected `dask://HOST:PORT`")
    if tls is None and not _is_this_machine(address):
        raise MisuseError(
            f"`{address}` is on another machine and the connection would not be encrypted: anyone who can "
            "reach such a scheduler can run code on its workers; give --tls-ca, --tls-cert and --tls-key, or "
            "connect through a tunnel (`ssh -L 8786:localhost:8786 HOST`, then dask://localhost:8786)"
        )
    try:
        from aeros.experiments.cluster import dask_executor
    except ImportError as error:
        needs = f"`{address}` needs {install_command('distributed')} ({error.name} is missing)"
        raise MisuseError(needs) from error
    return dask_executor(address.removeprefix("dask://"), tls)


def _is_this_machine(address: str) -> bool:
    try:
        host = urlsplit(address).hostname or ""
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
