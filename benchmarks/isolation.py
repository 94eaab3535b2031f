"""Measure the cost of isolation: `python -m benchmarks.isolation` prints medians."""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.in_process_run import InProcessRun
from aeros.runtime.skills.load import CertifiedCode
from aeros.spec.obligations.skill_syntax.allowed_names import ALLOWED_MODULES

ACTIONS = 500
CODE = f"""
from aeros.skill import act
def lift(observed, inputs):
    for n in range({ACTIONS}):
        x, y, z = observed["tool_position"]
        observed = yield act("move", target=(x, y, z), speed=0.1, count=n)
"""
OBSERVED = {"tool_position": (0.3, 0.0, 0.5), "human_distance": 20.0, "holding": False}


def main() -> None:
    """Measure, and print medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--invocations", type=int, default=30, help="how many are timed (default: 30)")
    invocations = parser.parse_args().invocations
    print(f"{platform.platform()}, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}")
    code = CertifiedCode(CodeFile("bench", "skills.py", "/skills.py", CODE.encode()), "lift")
    began = time.perf_counter()
    nursery = ZygotePool(sorted(ALLOWED_MODULES))
    wrapped = "in bubblewrap" if nursery.missing[IsolationLayer.BUBBLEWRAP] is None else "without bubblewrap"
    print(f"first zygote, started and probed, {wrapped}: {1e3 * (time.perf_counter() - began):.0f} ms")
    opened, trips, closed = [], [], []
    for _ in range(invocations):
        began = time.perf_counter()
        run = IsolatedRun(nursery, APPLY_LAYER, code, {}, 60.0)
        opened.append(time.perf_counter() - began)
        run.resume(OBSERVED, 60.0)
        for _ in range(ACTIONS - 1):
            began = time.perf_counter()
            run.resume(OBSERVED, 60.0)
            trips.append(time.perf_counter() - began)
        began = time.perf_counter()
        run.close()
        closed.append(time.perf_counter() - began)
    nursery.close()
    here = []
    run_here = InProcessRun(code.file.generator_function("lift"), {})
    for _ in range(ACTIONS):
        began = time.perf_counter()
        run_here.resume(OBSERVED, 60.0)
        here.append(time.perf_counter() - began)
    print(f"an invocation: opened in {1e3 * statistics.median(opened):.2f} ms, ", end="")
    print(f"closed in {1e3 * statistics.median(closed):.2f} ms")
    spread = statistics.quantiles(trips, n=100)
    print(f"an action: {1e6 * statistics.median(trips):.0f} µs, p99 {1e6 * spread[98]:.0f} µs; ", end="")
    print(f"in this process {1e6 * statistics.median(here):.1f} µs")


if __name__ == "__main__":
    main()
