"""How long task runs on the symbolic plant take: `python -m benchmarks.symbolic`.

Each run is `make dumplings` from its beginning to its measured goal: agent with its memory, gate, monitor and
audit record as in `aeros run`, in one process; modules are proved and the gate is compiled once.  Skills run
in this process, as of modules that the site trusts.  Records are made durable many at a time
(`durability: batched`), agent and log are kept where --folder says: in memory, unless it says otherwise.

Processor time is counted, as other work on the machine does not add to it, and for each part without the
parts that it calls.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from aeros.agent.loop import awake
from aeros.agent.memory import Memory
from aeros.runtime import deciding
from aeros.runtime.audit import AuditLog
from aeros.runtime.configuration import Configuration
from aeros.runtime.executor import Executor
from aeros.runtime.gate import Gate
from aeros.runtime.monitor import Monitors
from aeros.runtime.proving import prove
from aeros.runtime.skill_run import SkillRun, run_in_process
from aeros.sim.symbolic import SymbolicPlant
from aeros.spec.doubles import as_doubles
from aeros.spec.folders import reference_site
from aeros.spec.model import Durability

_TASK: Final = "make_dumplings"

_REST: Final = "agent, executor and the rest"

_PARTS: Final[tuple[tuple[str, Any, tuple[str, ...]], ...]] = (
    ("plant", SymbolicPlant, ("__init__", "observe", "plan", "begin", "advance", "skill_ended")),
    ("gate", Gate, ("decide",)),
    ("monitor", Monitors, ("__init__", "__call__", "watch", "forget")),
    ("audit record", AuditLog, ("append",)),
    ("digest of what is measured", deciding, ("decision_details",)),
    ("agent's memory", Memory, ("begin", "end", "remember", "learn", "interrupt", "end_session")),
    ("skill code", SkillRun, ("resume",)),
)
"""What is told apart: classes or modules, and the functions of theirs by which the rest calls them."""


class Shares:
    """Processor seconds spent in each part, and in nothing that it calls of another."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._inside: list[str] = []
        self._since = time.process_time()

    def _pass(self, part: str | None) -> None:
        now = time.process_time()
        self.seconds[self._inside[-1] if self._inside else _REST] += now - self._since
        self._since = now
        if part is None:
            self._inside.pop()
        else:
            self._inside.append(part)

    def counted(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        """`method`, its time counted for `part`."""

        def call(*arguments: Any, **named: Any) -> Any:
            self._pass(part)
            try:
                return method(*arguments, **named)
            finally:
                self._pass(None)

        return call


@contextmanager
def told_apart(shares: Shares) -> Iterator[None]:
    """Count the time of each part while the block runs."""
    kept = [(owner, name, owner.__dict__[name]) for _, owner, names in _PARTS for name in names]
    for part, owner, names in _PARTS:
        for name in names:
            setattr(owner, name, shares.counted(part, owner.__dict__[name]))
    try:
        yield
    finally:
        for owner, name, method in kept:
            setattr(owner, name, method)


def run_tasks(configuration: Configuration, runs: int, folder: Path) -> tuple[int, int, int]:
    """Runs that reached their goal, steps, and records; seeds are 0, 1, and so on."""
    initial = as_doubles(configuration.modules[_TASK].tasks[_TASK].initial)
    gate = Gate(configuration)
    reached = steps = 0
    with AuditLog(folder / "audit.jsonl", durability=Durability.BATCHED) as audit:
        for seed in range(runs):
            plant = SymbolicPlant(configuration.site, configuration.modules, seed, initial)
            with (
                Executor(configuration, gate, plant, audit, run_in_process) as executor,
                awake(folder / "state", configuration.site.id, executor) as agent,
            ):
                report = agent.run("make dumplings")
            reached += report.reached
            steps += len(report.steps)
        records = audit.append("benchmark-ended", {})
    return reached, steps, records


def main(argv: list[str]) -> None:
    """Measure, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"), help="where agent and log are kept")  # noqa: S108
    arguments = parser.parse_args(argv)
    configuration, _ = prove([Path(__file__).parents[1] / "ecms"], reference_site(), certified=True)
    # Once for what is imported and compiled at first use.
    for runs in (5, arguments.runs):
        shares = Shares()
        with tempfile.TemporaryDirectory(dir=arguments.folder) as folder, told_apart(shares):
            began, began_cpu = time.perf_counter(), time.process_time()
            reached, steps, records = run_tasks(configuration, runs, Path(folder))
            cpu, wall = time.process_time() - began_cpu, time.perf_counter() - began
    print(
        f"{runs} runs, {reached} to their goal; {steps / runs:.2f} steps, {records / runs:.0f} records each"
    )
    print(f"{1000 * cpu / runs:.1f} ms of processor a run, {1000 * wall / runs:.1f} ms by the clock")
    for part, seconds in sorted(shares.seconds.items(), key=lambda one: -one[1]):
        print(f"  {part:30} {1000 * seconds / runs:6.1f} ms  {100 * seconds / cpu:3.0f} %")
    print(f"10,000 runs: {10_000 * cpu / runs / 60:.1f} minutes of one processor")


if __name__ == "__main__":
    main(sys.argv[1:])
