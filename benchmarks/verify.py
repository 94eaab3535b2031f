"""Measure the time of `aeros verify`, cold and warm: `python -m benchmarks.verify`.

Every figure is of a whole process, from start to exit.  *Cold* is `--no-cache`; *warm* finds what an
earlier run proved in a store of its own, in a temporary folder.  Byte code is compiled beforehand, as an
installer does.  Runs of all kinds take turns, so that other load of the machine affects all of them alike.
Next to seconds stand processor seconds, of all processes together, which depend less on other load, and the
ratio to a bare `python -c pass` of the same run.
"""

from __future__ import annotations

import math
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from aeros.experiments.trials.synthetic import write_module, write_modules
from benchmarks.command import build_parser, print_json

_ROOT = Path(__file__).parents[1]
_PYTHON = (sys.executable,)
_VERIFY = (sys.executable, "-m", "aeros", "verify")


def _environment(folder: Path, *, quick: bool) -> dict[str, str]:
    """Return the environment of commands; only a quick run takes the byte code that is there."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    bytecode = {} if quick else {"PYTHONPYCACHEPREFIX": str(folder / "bytecode")}
    return kept | bytecode | {"AEROS_CACHE": str(folder / "cache"), "PYTHONPATH": str(_ROOT)}


def _seconds(command: Sequence[str], environment: Mapping[str, str]) -> tuple[float, float]:
    """Run a command; return seconds by the clock and of processors."""
    started, used = time.perf_counter(), _child_cpu_seconds()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - started, _child_cpu_seconds() - used


def _child_cpu_seconds() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return children.ru_utime + children.ru_stime


def reference(environment: Mapping[str, str], runs: int) -> dict[str, dict[str, float]]:
    """Measure median seconds of the three reference modules, and of the commands to compare them with."""
    ecms = str(_ROOT / "ecms")
    commands = {
        "python -c pass": (*_PYTHON, "-c", "pass"),
        "python -c 'import z3'": (*_PYTHON, "-c", "import z3"),
        "cold": (*_VERIFY, ecms, "--no-lock", "--no-cache"),
        "warm": (*_VERIFY, ecms, "--no-lock"),
    }
    if runs > 1:
        for command in commands.values():
            _seconds(command, environment)
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(runs):
        for name, command in commands.items():
            times[name].append(_seconds(command, environment))
    return {
        name: dict(
            zip(("clock", "processor"), map(statistics.median, zip(*values, strict=True)), strict=True)
        )
        for name, values in times.items()
    }


def synthetic(
    folder: Path, environment: Mapping[str, str], count: int, jobs: int, rounds: int
) -> dict[str, Any]:
    """Measure seconds of synthetic modules cold, warm, and with one changed; and the memory of the first.

    Warm, and with one changed, is the median of `rounds` runs.
    """
    modules = folder / f"site_{count}"
    write_modules(modules, count)
    row: dict[str, Any] = {"modules": count}
    cold = (*_VERIFY, str(modules), "--no-cache", "--jobs", str(jobs))
    used = _child_cpu_seconds()
    row["cold"], row["memory"] = _peak_memory(cold, environment)
    row["processor"] = _child_cpu_seconds() - used
    again = (*_VERIFY, str(modules), "--jobs", str(jobs))
    _seconds(again, environment)
    row["warm"] = statistics.median(_seconds(again, environment)[0] for _ in range(rounds))
    changed = []
    for number in range(rounds):
        write_module(modules, count // 2, version=f"1.0.{number + 1}")
        changed.append(_seconds(again, environment)[0])
    row["one changed"] = statistics.median(changed)
    return row


def _peak_memory(command: Sequence[str], environment: Mapping[str, str]) -> tuple[float, int]:
    """Measure seconds, and the most bytes that the process and its children held together, sampled."""
    started, most = time.perf_counter(), 0
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)
    while process.poll() is None:
        most = max(most, sum(map(_resident_bytes, _process_tree(process.pid))))
        time.sleep(0.2)  # to ask takes the processor that is measured
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return time.perf_counter() - started, most


def _process_tree(pid: int) -> Iterator[int]:
    """Yield a process and its children, where the system lists them (Linux)."""
    yield pid
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return
    for child in children:
        yield from _process_tree(int(child))


def _resident_bytes(pid: int) -> int:
    """Return the bytes that a process holds; shared ones count in part."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:")), 0)


def exponent(rows: Sequence[Mapping[str, Any]]) -> float | None:
    """Fit seconds ~ modules^k by least squares; return k, or None for a single size."""
    if len({row["modules"] for row in rows}) < 2:
        return None
    points = [(math.log(row["modules"]), math.log(row["processor"])) for row in rows]
    x, y = (statistics.fmean(point[axis] for point in points) for axis in (0, 1))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


def main() -> None:
    """Measure, and print tables or JSON."""
    parser = build_parser(__doc__, quick="few and small runs")
    parser.add_argument("--sizes", type=int, nargs="+", default=[10, 50, 200, 1000])
    parser.add_argument("--runs", type=int, default=11)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    sizes, runs, rounds = ([2], 1, 1) if arguments.quick else (arguments.sizes, arguments.runs, 3)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = _environment(folder, quick=arguments.quick)
        medians = reference(environment, runs)
        rows = [synthetic(folder, environment, size, arguments.jobs, rounds) for size in sizes]
    found: dict[str, Any] = {
        "python": platform.python_version(),
        "reference": medians,
        "synthetic": rows,
        "exponent": exponent(rows),
    }
    if arguments.format == "json":
        print_json(found)
        return
    bare = medians["python -c pass"]["clock"]
    print("| the three modules | s | processor, s | × bare Python |\n|:--|--:|--:|--:|")
    for name, one in medians.items():
        print(f"| {name} | {one['clock']:.3f} | {one['processor']:.3f} | {one['clock'] / bare:.1f} |")
    print("\n| modules | cold, s | processor, s | warm, s | one changed, s | memory, MiB |")
    print("|--:|--:|--:|--:|--:|--:|")
    for row in rows:
        shown = " | ".join(f"{row[key]:.2f}" for key in ("cold", "processor", "warm", "one changed"))
        print(f"| {row['modules']} | {shown} | {row['memory'] / 2**20:.0f} |")
    if found["exponent"] is not None:
        print(f"\nprocessor ~ modules^{found['exponent']:.2f}")


if __name__ == "__main__":
    main()
