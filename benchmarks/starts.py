"""Count how often a task reaches its goal from random starts: `python -m benchmarks.starts "make dumplings"`.

Each run is `aeros run` in a process and with a memory of its own, on the physics plant unless --plant names
another, without a recording of poses; seeds are 0, 1, and so on from --first-seed, and each gives another
start (docs/starts.md).  With --faults or --people things go wrong or a person walks about; with --deviation
the cell is not as the robot takes it to be (benchmarks/deviations.py).  A run counts as reached if the goal
is true in the simulator, which the agent does not see; what the agent believes is counted beside
it.  Processor time is of the whole process, its start included.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from math import sqrt
from pathlib import Path
from typing import Any, Final

from aeros.spec.migrations.renamed_names import current_event
from benchmarks.command import build_parser, print_json

_ROOT: Final = Path(__file__).parents[1]

_NORMAL_95: Final = 1.959964
"""Two-sided 95 % quantile of the normal distribution."""


def wilson(reached: int, runs: int) -> tuple[float, float]:
    """Compute Wilson's 95 % interval of the probability of success."""
    share, z2 = reached / runs, _NORMAL_95**2
    middle = (share + z2 / (2 * runs)) / (1 + z2 / runs)
    half = _NORMAL_95 / (1 + z2 / runs) * sqrt(share * (1 - share) / runs + z2 / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)


def run_once(instruction: str, options: Sequence[str], deviation: str | None, seed: int) -> dict[str, Any]:
    """Run once, and return the figures of the run."""
    program = ["-m", "aeros"]
    if deviation is not None:
        program = ["-c", "from benchmarks.deviations import main; main()", deviation]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        where = ("--out", str(out), "--state", str(Path(folder) / "state"))
        command = [sys.executable, *program, "run", instruction, "--seed", str(seed), *options, *where]
        began = time.perf_counter()
        with (Path(folder) / "said").open("w+", encoding="utf-8") as output:
            process = subprocess.Popen(command, cwd=_ROOT, stdout=output, stderr=output)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            real = time.perf_counter() - began
            output.seek(0)
            words = output.read()
        processor = {"seed": seed, "processor_s": used.ru_utime + used.ru_stime, "real_s": real}
        trace = _lines(out / "trace.jsonl")
        if not trace:
            raise SystemExit(f"seed {seed} did not run:\n{words}")
        figures = read_run(trace, _lines(out / "audit.jsonl"), words)
        return processor | figures | read_extremes(_lines(out / "measured.jsonl"))


def read_run(trace: Sequence[dict[str, Any]], audit: Iterable[dict[str, Any]], words: str) -> dict[str, Any]:
    """Read the figures of one run from its trace and its audit log.

    believed: the agent took the goal as reached.  reached: it was true in the simulator; false too where the
    scene defines no truth, and then not refereed.
    stops: steps that the monitor ended.  faults: that began.  after_fault_s: simulated s from the last
    beginning or end of one to the end of the run; None without any.  way: each step that ended, and how.
    words: what the run printed, whose end is the reason where it broke off.
    """
    last = trace[-1]
    ended = last["details"] if last["kind"] == "run-ended" else {"reached": False, "reason": words[-500:]}
    records = list(audit)
    verdicts = [one["details"]["verdict"] for one in records if one["event"] == "decision"]
    reasons = [one["details"]["reason"] for one in records if one["event"] == "step-ended"]
    faults = [one["time"] for one in trace if current_event(one["kind"]) in ("fault-started", "fault-ended")]
    judged = [one["details"]["true"] for one in records if one["event"] == "goal-judged"]
    return {
        "reached": judged == [True],
        "believed": ended["reached"],
        "refereed": judged in ([True], [False]),
        "reason": ended["reason"],
        "steps": ended.get("steps"),
        "retries": ended.get("retries"),
        "recoveries": ended.get("recoveries"),
        "replans": ended.get("replans"),
        "denied": verdicts.count("DENY"),
        "attenuated": verdicts.count("ATTENUATE"),
        "stops": sum(reason.startswith("monitor:") for reason in reasons),
        "faults": sum(current_event(one["kind"]) == "fault-started" for one in trace),
        "simulated_s": last["time"],
        "after_fault_s": last["time"] - faults[-1] if faults else None,
        "way": [one["text"] for one in trace if one["kind"] in ("step-ended", "step-not-started")],
    }


def read_extremes(measured: Iterable[dict[str, Any]]) -> dict[str, float | None]:
    """Read the greatest contact force, N, and the least distance of a person, m, that a run measured.

    None where nothing measures it.  Between two moments that are recorded there may have been more.
    """
    states = [one["state"] for one in measured]
    forces = [one["contact_force"][0] for one in states if "contact_force" in one]
    distances = [one["human_distance"][0] for one in states if "human_distance" in one]
    return {"force_max": max(forces, default=None), "distance_min": min(distances, default=None)}


def _lines(path: Path) -> list[dict[str, Any]]:
    """Read the records of a log; none where it is missing."""
    return (
        [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []
    )


def format_run(run: dict[str, Any]) -> str:
    """Format one run as a line, or as several where it failed."""
    counts = ", ".join(
        f"{run[name]} {name}" for name in ("steps", "replans", "denied", "stops", "faults") if run[name]
    )
    times = f"{run['simulated_s']:.1f} s simulated, {run['processor_s']:.1f} s of processor"
    word = "reached" if run["reached"] else "unknown" if run["believed"] and not run["refereed"] else "FAILED"
    line = f"{run['seed']:5}  {word:7}  {counts}; {times}"
    if word != "FAILED":
        return line
    return "\n         ".join((line, str(run["reason"]), *run["way"]))


def summarize(runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Sum up all runs."""
    reached = sum(run["reached"] for run in runs)
    found: dict[str, Any] = {
        "runs": len(runs),
        "reached": reached,
        "believed": sum(run["believed"] for run in runs),
        "false_claims": sum(run["believed"] and not run["reached"] and run["refereed"] for run in runs),
        "not_refereed": sum(not run["refereed"] for run in runs),
        "wilson_95": wilson(reached, len(runs)),
        "failed_seeds": [run["seed"] for run in runs if not run["reached"]],
    }
    for name in ("steps", "retries", "recoveries", "replans", "denied", "attenuated", "stops", "faults"):
        found[name] = sum(run[name] or 0 for run in runs)
    for name in ("simulated_s", "processor_s", "real_s"):
        found[name] = sum(run[name] for run in runs)
    return found


def format_summary(found: dict[str, Any]) -> str:
    """Format the sum of all runs in words."""
    low, high = (100 * end for end in found["wilson_95"])
    runs = found["runs"]
    return (
        f"{found['reached']} of {runs} reached the goal in truth: {100 * found['reached'] / runs:.0f} %, "
        f"95 % interval {low:.1f} to {high:.1f} %; {found['believed']} believed it, "
        f"{found['false_claims']} falsely; {found['not_refereed']} were not refereed\n"
        f"{found['steps']} steps, {found['retries']} retries, {found['recoveries']} recoveries, "
        f"{found['replans']} re-plans, {found['denied']} denials, {found['attenuated']} attenuated, "
        f"{found['stops']} protective stops, {found['faults']} faults\n"
        f"each {found['simulated_s'] / runs:.1f} s simulated, "
        f"{found['processor_s'] / runs:.1f} s of processor, {found['real_s'] / runs:.1f} s by the clock"
    )


def main() -> None:
    """Run, print each result as its run ends, and their sum."""
    parser = build_parser(__doc__, quick="one run")
    parser.add_argument("instruction", nargs="?", default="make dumplings")
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1, help="runs at the same time")
    for option in ("plant", "faults", "people"):
        parser.add_argument(f"--{option}", help="as of `aeros run`")
    parser.add_argument("--deviation", help="of the cell, by name (benchmarks/deviations.py)")
    arguments = parser.parse_args()
    options = ["--no-film"]
    for option in ("plant", "faults", "people"):
        if (given := getattr(arguments, option)) is not None:
            options += [f"--{option}", given]
    seeds = range(arguments.first_seed, arguments.first_seed + (1 if arguments.quick else arguments.runs))
    runs = []
    with ThreadPoolExecutor(arguments.jobs) as threads:
        for run in threads.map(partial(run_once, arguments.instruction, options, arguments.deviation), seeds):
            runs.append(run)
            if arguments.format == "text":
                print(format_run(run), flush=True)
    found = summarize(runs)
    if arguments.format == "json":
        print_json({"instruction": arguments.instruction, "options": options, **found, "each": runs})
    else:
        print(format_summary(found))


if __name__ == "__main__":
    main()
