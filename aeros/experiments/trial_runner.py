"""Runs trials on any `concurrent.futures.Executor`, and keeps them as soon as a worker is done with them.

What is finished already is not run again, and neither is what a finished trial says would be the same
(`kinds.Sharing`).  An interruption lets what is under way finish and be kept; a second one does not wait, and
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

from aeros.experiments.condition import Condition
from aeros.experiments.inputs import Where, premises_of
from aeros.experiments.interruptions import Interruptions
from aeros.experiments.trial_kinds import ALIKE, Found, Trial, company_of, digest_of, family_of, kind_of
from aeros.experiments.trial_store import Aside, Kept, Store
from aeros.spec.diagnostics.errors import InternalError, MisuseError

AT_ONCE: Final[Mapping[str, int]] = {"symbolic": 200, "physics": 1}
"""Trials that a worker runs for one answer at most, or those of one seed: one takes seconds on physics."""

_AHEAD: Final = 2
"""Chunks given out for each worker: one that it runs and one that waits."""

_LOOK_EVERY: Final = 0.1
"""Seconds between looks at whether somebody interrupts."""


class Chunk(NamedTuple):
    """Trials of conditions that keep company, for one worker.

    premises: the digest that the worker's own must have.
    wanted: seeds, each with the conditions that it is wanted of.
    aside: the file for what is finished of it, see `store.Aside`.
    """

    where: Where
    premises: str
    wanted: tuple[tuple[int, tuple[Condition, ...]], ...]
    aside: Path

    @property
    def trials(self) -> int:
        """How many are wanted."""
        return sum(len(conditions) for _, conditions in self.wanted)


@dataclass(slots=True)
class Progress:
    """How far it has come: trials done of so many, when it began, and whether it was interrupted."""

    done: int
    total: int
    began: float
    is_ending: bool = False

    @property
    def seconds_left(self) -> float | None:
        """At the pace so far."""
        spent = time.monotonic() - self.began
        return spent * (self.total - self.done) / self.done if self.done else None


class Finished(NamedTuple):
    """What came of a chunk: so many trials, and those of them that whoever asked does not find aside."""

    number: int
    trials: tuple[Kept, ...]


_Answer = Future[Finished]


class AbandonedError(KeyboardInterrupt):
    """A second interruption: what is under way is not waited for, and lost."""


class OtherPremisesError(Exception):
    """A worker has other modules, another site or other code than whoever asked."""


def run_chunk(chunk: Chunk) -> Finished:
    """What each trial of `chunk` found; what a worker runs.

    A condition of which a trial that has run says that it would have been the same is not tried again.
    A process of the pool here hands nothing over: its answer fits into its pipe at once (`PIPE_BUF`).  Who
    has read half of a longer one waits for ever where its writer is killed, as others can write there, too.
    """
    premises = premises_of(chunk.where)
    if premises.digest != chunk.premises:
        raise OtherPremisesError("a worker has other modules, another site or another release of AEROS")
    finished: list[Kept] = []
    with ExitStack() as stack:
        aside = stack.enter_context(Aside(chunk.aside))
        trials: dict[Condition, Trial] = {}
        for seed, conditions in chunk.wanted:
            had: dict[str, list[Found]] = {}
            for condition in conditions:
                family, number = family_of(condition)
                one = _the_same(number, had.setdefault(family, []))
                if one is None:
                    if condition not in trials:
                        opened = kind_of(condition.kind).opened(condition, premises)
                        trials[condition] = stack.enter_context(opened)
                    one = trials[condition](seed)
                    had[family].append(one)
                finished.append(Kept(digest_of(condition, chunk.premises), seed, one))
                aside.keep(finished[-1])
    return Finished(len(finished), () if _Serving.is_here else tuple(finished))


def _the_same(number: float, had: Iterable[Found]) -> Found | None:
    """Of a family's trials with one seed, the one that its condition with that number would have found."""
    for one in had:
        low, high = one.get(ALIKE, (number, number))
        if low < number < high:
            return one
    return None


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

    For the main thread alone, which Ctrl-C comes to.
    tell: hears whenever trials were kept.  Raises KeyboardInterrupt once what was under way is kept, and
    `AbandonedError` where another interruption comes before that.
    """
    premises = premises_of(where).digest
    chunks = list(_missing(dict.fromkeys(conditions), seeds, where, premises, store, workers))
    progress = Progress(0, sum(chunk.trials for chunk in chunks), time.monotonic())
    tell(progress)
    queue, running = iter(chunks), dict[_Answer, Chunk]()
    with Interruptions() as interrupted:
        try:
            while True:
                while len(running) < _AHEAD * workers and not interrupted.count:
                    if (chunk := next(queue, None)) is None:
                        break
                    running[executor.submit(run_chunk, chunk)] = chunk
                if interrupted.count and not progress.is_ending:
                    progress.is_ending = True
                    tell(progress)
                    running = {future: chunk for future, chunk in running.items() if not future.cancel()}
                if interrupted.count > 1:
                    raise AbandonedError
                if not running:
                    break
                _keep_finished(running, store, progress, tell)
        finally:
            for future in running:
                future.cancel()
    if interrupted.count:
        raise KeyboardInterrupt


def _keep_finished(
    running: dict[_Answer, Chunk],
    store: Store,
    progress: Progress,
    tell: Callable[[Progress], None],
) -> None:
    done, _ = wait(running, _LOOK_EVERY, return_when=FIRST_COMPLETED)
    # What was refused comes last, so that all else is kept.
    for future in sorted(done, key=lambda one: one.exception() is not None):
        chunk = running.pop(future)
        number, trials = future.result()
        if trials:
            store.keep(trials, chunk.aside)
        elif store.take_in(chunk.aside) < number:
            raise InternalError(f"{chunk.aside} lacks some of the {number} trials that are finished")
        progress.done += number
    if done:
        tell(progress)


def _missing(
    conditions: Iterable[Condition],
    seeds: Sequence[int],
    where: Where,
    premises: str,
    store: Store,
    workers: int,
) -> Iterator[Chunk]:
    numbers = count()
    companies: dict[tuple[str, str, str], list[Condition]] = {}
    for condition in conditions:
        key = condition.kind, condition.plant, company_of(condition)
        companies.setdefault(key, []).append(condition)
    for (_, plant, _), company in companies.items():
        wanted = [(seed, tuple(left)) for seed in seeds if (left := _left(company, seed, premises, store))]
        # Every worker has a part of every company, however few they are.
        size = max(1, min(AT_ONCE[plant] // len(company), ceil(len(wanted) / workers)))
        for first in range(0, len(wanted), size):
            chosen = tuple(wanted[first : first + size])
            yield Chunk(where, premises, chosen, store.aside(next(numbers)))


def _left(company: Sequence[Condition], seed: int, premises: str, store: Store) -> list[Condition]:
    """Those of which no trial with that seed is there, nor one that says that it would be the same."""
    digests = {condition: digest_of(condition, premises) for condition in company}
    had: dict[str, list[Found]] = {}
    for condition, digest in digests.items():
        if (one := store.trials.get((digest, seed))) is not None:
            had.setdefault(family_of(condition)[0], []).append(one)
    left = []
    for condition, digest in digests.items():
        if (digest, seed) in store.trials:
            continue
        family, number = family_of(condition)
        same = _the_same(number, had.get(family, ()))
        if same is None:
            left.append(condition)
        else:
            store.keep([Kept(digest, seed, same)])
    # What is listed last goes on longest, as a rule, so the others find that what they ask has been asked.
    return left[::-1]


@contextmanager
def local(workers: int) -> Iterator[tuple[Executor, int]]:
    """Processes on this machine, and how many."""
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(workers, initializer=_serve, initargs=(os.getpid(),))
    is_patient = True
    try:
        yield pool, workers
    except (AbandonedError, BrokenExecutor):
        # The pool dismisses no worker any more where one that it had cancelled was to hear that it is broken.
        is_patient = False
        raise
    finally:
        with Interruptions() as interrupted:
            pool.shutdown(wait=False, cancel_futures=True)
            while left := [one for one in multiprocessing.active_children() if one not in others]:
                if interrupted.count or not is_patient:
                    for worker in left:
                        worker.kill()
                left[0].join(_LOOK_EVERY)
        if interrupted.count:
            raise KeyboardInterrupt


class _Serving:
    """What kind of process this is."""

    is_here = False
    """Whether it works for another one of this machine, which sees the same files."""


def _serve(parent: int) -> None:
    """Leave interruptions to whoever keeps what is found, and end where that has ended without a word."""
    _Serving.is_here = True
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def executor_at(address: str | None, workers: int) -> AbstractContextManager[tuple[Executor, int]]:
    """The processes of this machine, or those of a cluster at `dask://HOST:PORT`.  Raises `MisuseError`."""
    if address is None:
        return local(workers)
    if not address.startswith("dask://"):
        raise MisuseError(f"`{address}` is no executor; expected `dask://HOST:PORT`")
    try:
        from aeros.experiments.cluster import cluster
    except ImportError as error:
        needs = f"`{address}` needs `pip install 'aeros[distributed]'` ({error.name} is missing)"
        raise MisuseError(needs) from error
    return cluster("tcp://" + address.removeprefix("dask://"))
