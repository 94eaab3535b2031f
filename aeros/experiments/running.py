"""Runs trials on any `concurrent.futures.Executor`, and keeps each as soon as it is finished.

What is finished already is not run again.  An interruption lets what is under way finish and be kept; a
second one does not wait.  Which worker runs what, and in which order, has no bearing on what is found.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Final, NamedTuple

from aeros.experiments.condition import Condition
from aeros.experiments.kinds import Found, digest_of, kind_of
from aeros.experiments.premises import Where, premises_of
from aeros.experiments.store import Kept, Store
from aeros.spec.diagnostics import Diagnostic
from aeros.spec.errors import UserError

AT_ONCE: Final[Mapping[str, int]] = {"symbolic": 20, "physics": 1}
"""Trials that a worker runs for one answer: those of one take seconds on physics, those of the other none."""

_AHEAD: Final = 2
"""Chunks given out for each worker: one that it runs and one that waits."""


class Chunk(NamedTuple):
    """Trials of one condition, for one worker.

    premises: the digest that the worker's own must have.
    """

    where: Where
    premises: str
    condition: Condition
    seeds: tuple[int, ...]


@dataclass(slots=True)
class Progress:
    """How far it has come: trials done of so many, and when it began."""

    done: int
    total: int
    began: float

    @property
    def seconds_left(self) -> float | None:
        """At the pace so far."""
        spent = time.monotonic() - self.began
        return spent * (self.total - self.done) / self.done if self.done else None


class OtherPremisesError(Exception):
    """A worker has other modules, another site or other code than whoever asked."""


def run_chunk(chunk: Chunk) -> list[tuple[int, Found]]:
    """What each trial of `chunk` found; what a worker runs."""
    premises = premises_of(chunk.where)
    if premises.digest != chunk.premises:
        raise OtherPremisesError("a worker has other modules, another site or another release of AEROS")
    with kind_of(chunk.condition.kind).opened(chunk.condition, premises) as trial:
        return [(seed, trial(seed)) for seed in chunk.seeds]


def run_trials(
    conditions: Iterable[Condition],
    seeds: Sequence[int],
    where: Where,
    executor: Executor,
    workers: int,
    store: Store,
    tell: Callable[[Progress], None],
) -> None:
    """Run whatever the store does not have of `conditions` for `seeds`.

    tell: hears whenever trials were kept.  Raises KeyboardInterrupt once what was under way is kept.
    """
    premises = premises_of(where).digest
    chunks = list(_missing(dict.fromkeys(conditions), seeds, where, premises, store))
    progress = Progress(0, sum(len(chunk.seeds) for chunk in chunks), time.monotonic())
    tell(progress)
    queue, running = iter(chunks), dict[Future[list[tuple[int, Found]]], Chunk]()
    try:
        while True:
            while len(running) < _AHEAD * workers and (chunk := next(queue, None)) is not None:
                running[executor.submit(run_chunk, chunk)] = chunk
            if not running:
                return
            _keep_finished(running, store, progress, tell)
    except KeyboardInterrupt:
        for future in list(running):
            if future.cancel():
                del running[future]
        while running:
            _keep_finished(running, store, progress, tell)
        raise
    finally:
        for future in running:
            future.cancel()


def _keep_finished(
    running: dict[Future[list[tuple[int, Found]]], Chunk],
    store: Store,
    progress: Progress,
    tell: Callable[[Progress], None],
) -> None:
    done, _ = wait(running, return_when=FIRST_COMPLETED)
    for future in done:
        chunk = running.pop(future)
        found = future.result()
        digest = digest_of(chunk.condition, chunk.premises)
        store.keep(Kept(digest, seed, one) for seed, one in found)
        progress.done += len(found)
    tell(progress)


def _missing(
    conditions: Iterable[Condition], seeds: Sequence[int], where: Where, premises: str, store: Store
) -> Iterator[Chunk]:
    for condition in conditions:
        digest = digest_of(condition, premises)
        left = [seed for seed in seeds if (digest, seed) not in store.trials]
        size = AT_ONCE[condition.plant]
        for first in range(0, len(left), size):
            yield Chunk(where, premises, condition, tuple(left[first : first + size]))


def processors() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def local(workers: int) -> Iterator[tuple[Executor, int]]:
    """Processes on this machine, and how many."""
    pool = ProcessPoolExecutor(workers, initializer=_serve, initargs=(os.getpid(),))
    try:
        yield pool, workers
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _serve(parent: int) -> None:
    """Leave interruptions to whoever keeps what is found, and end where that has ended without a word."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def executor_at(address: str | None, workers: int) -> AbstractContextManager[tuple[Executor, int]]:
    """The processes of this machine, or those of a cluster at `dask://HOST:PORT`.  Raises `UserError`."""
    if address is None:
        return local(workers)
    if not address.startswith("dask://"):
        raise UserError([Diagnostic("AE002", f"`{address}` is no executor; expected `dask://HOST:PORT`")])
    try:
        from aeros.experiments.cluster import cluster
    except ImportError as error:
        headline = f"`{address}` needs `pip install 'aeros[distributed]'` ({error.name} is missing)"
        raise UserError([Diagnostic("AE002", headline)]) from error
    return cluster("tcp://" + address.removeprefix("dask://"))
