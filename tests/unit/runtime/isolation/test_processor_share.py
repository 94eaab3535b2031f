"""Without control groups a worker is paused while it is ahead of its share."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.isolation import zygote_pool as pools
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.processor_share import (
    ProcessorCredit,
    WatchedWorker,
    processor_time,
)
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.skill import act
from tests.unit.runtime.isolation.support.spinning import FORK_AND_SPIN, SPIN, share_used, start

COMPUTE = """
from aeros.skill import act
def lift(observed, inputs):
    yield act("ready")
    yield act("sum", value=sum(range(1000000)))
"""


@pytest.fixture(scope="module")
def watched() -> Iterator[ZygotePool]:
    """Zygotes of a host without control groups."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pools, "find_bubblewrap", lambda: None)
        pool = ZygotePool(["time"])
    pool.missing[IsolationLayer.CGROUPS] = "the kernel has none"
    yield pool
    pool.close()


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_a_worker_that_spins_gets_its_share_and_is_timed_out(watched: ZygotePool, share: float) -> None:
    run = start(watched, SPIN, ProcessLimits(processor=share))
    assert run.resume({}, 20.0) == act("ready")
    used, ended = share_used(run)
    # Wider than that of control groups: the zygote itself may have to wait for a processor.
    assert 0 < used <= share + 0.2
    assert ended.status is StepStatus.TIMED_OUT


def test_a_worker_computes_the_same_with_a_share_and_without(watched: ZygotePool) -> None:
    for limits in (ProcessLimits(), ProcessLimits(processor=0.2)):
        run = start(watched, COMPUTE, limits)
        expected = [act("ready"), act("sum", value=sum(range(1000000)))]
        assert [run.resume({}, 20.0), run.resume({}, 20.0)] == expected
        run.close()


def test_a_worker_that_starts_a_process_of_its_own_is_killed(watched: ZygotePool) -> None:
    run = start(watched, FORK_AND_SPIN, ProcessLimits(processor=0.4))
    assert run.resume({}, 20.0) == act("ready")
    ended = run.resume({}, 20.0)
    assert getattr(ended, "reason", "") == "the skill's process hung up or was killed"


@given(
    st.floats(0.01, 0.99),
    st.lists(st.tuples(st.floats(0.001, 0.3), st.floats(0, 1)), min_size=1, max_size=60),
)
def test_credit_bounds_the_time_of_a_process_that_obeys(
    share: float, steps: list[tuple[float, float]]
) -> None:
    """At every look a process has used its share, a burst, and what it ran beyond the look at most."""
    credit = ProcessorCredit(share, 0.0, 0.0)
    now = used = slack = 0.0
    next_look = 0.0
    for delay, activity in steps:
        length = next_look + delay * 0.01  # the zygote comes a little late
        spent = 0.0 if credit.is_paused else activity * length
        now, used = now + length, used + spent
        slack = max(slack, spent)
        next_look = credit.update(now, used)
        assert next_look > 0
        assert used <= share * now + share * 0.1 + slack + 1e-9


@given(st.floats(0.01, 0.99))
def test_a_process_that_was_paused_goes_on(share: float) -> None:
    credit = ProcessorCredit(share, 0.0, 0.0)
    wait = credit.update(0.5, 0.5)
    assert credit.is_paused == (share * 0.1 <= 0.5 * (1 - share) + 1e-12)
    if credit.is_paused:
        credit.update(0.5 + wait, 0.5)
        assert not credit.is_paused


def test_a_worker_that_has_ended_is_watched_no_more() -> None:
    with subprocess.Popen(["true"]) as process:
        worker = WatchedWorker(process.pid, 0.5)
        process.wait()
    assert worker.watch() > 0
    with pytest.raises(OSError, match="Invalid argument"):
        processor_time(process.pid)
