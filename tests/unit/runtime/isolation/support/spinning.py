"""Skills that compute without end in a worker, and the kernel's account of their processor time."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.kernel import child_processes
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.processor_share import processor_time
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.runtime.skills.load import CertifiedCode

SPIN = """
from aeros.skill import act
def lift(observed, inputs):
    yield act("ready")
    while True:
        pass
"""
FORK_AND_SPIN = """
import os
from aeros.skill import act
def lift(observed, inputs):
    yield act("ready")
    os.fork() or os.fork()
    while True:
        pass
"""


def start(pool: ZygotePool, text: str, limits: ProcessLimits) -> IsolatedRun:
    """Load code in a worker without layers of its own."""
    code = CertifiedCode(CodeFile("m", "s.py", "/s.py", text.encode()), "lift")
    return IsolatedRun(pool, (), code, {}, 20.0, limits)


def zygote_of(run: IsolatedRun) -> int:
    process = run._zygote._process
    assert process is not None
    return process.pid


def descendants(pid: int) -> list[int]:
    children = child_processes(pid)
    return [*children, *(other for child in children for other in descendants(child))]


def share_used(run: IsolatedRun, seconds: float = 1.0) -> tuple[float, SkillRunResult]:
    """Let a skill compute, and kill it.

    Returns:
        Processor time of all its processes for each second, and its end.
    """
    ended: list[SkillRunResult] = []

    def compute() -> None:
        found = run.resume({}, seconds + 1.0)
        assert isinstance(found, SkillRunResult)
        ended.append(found)

    thread = threading.Thread(target=compute)
    thread.start()
    time.sleep(0.2)
    began, processes = time.monotonic(), descendants(zygote_of(run))
    before = _used(processes)
    thread.join(seconds)
    after, over = _used(processes), time.monotonic()
    thread.join()
    return (after - before) / (over - began), ended[0]


def _used(processes: Iterable[int]) -> float:
    return sum(map(processor_time, processes))
