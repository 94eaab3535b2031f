"""Knock things about during runs, and judge by the simulator's truth what the robot made of it.

`knocks.toml` declares the knocks. Each is run with some seeds. A knock after which the goal is still within
reach and view is to be recovered from; any other is to be given up, with a reason, within `CLEAR_WITHIN` of
simulated time after the knock. Everything else is wrong: a false claim, a goal given up that could be
reached, or a long time without either.
"""

from __future__ import annotations

import json
import tempfile
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final, NamedTuple

from benchmarks.command import build_parser, print_json
from benchmarks.starts import run_once

KNOCKS: Final = Path(__file__).with_suffix(".toml")

CLEAR_WITHIN: Final = 30.0
"""Time within which what cannot be reached is to be given up, simulated s."""


class Knock(NamedTuple):
    """A thing that somebody does during a run.

    Attributes:
        name: unique.
        instruction: of the run.
        can: `recover` or `give-up`.
        fault: as in a faults file, without its rate.
        also: a second fault of the same run; None for none.
    """

    name: str
    instruction: str
    can: str
    fault: dict[str, Any]
    also: dict[str, Any] | None = None


def read_knocks() -> list[Knock]:
    """Read all knocks."""
    return [Knock(**one) for one in tomllib.loads(KNOCKS.read_text(encoding="utf-8"))["knock"]]


def faults_of(knock: Knock) -> dict[str, Any]:
    """Make a faults file of a knock, as JSON values."""
    name = knock.name.replace("-", "_")
    declared = {name: knock.fault} | ({} if knock.also is None else {f"{name}_also": knock.also})
    faults = {name: {**fault, "rate": 1, "at_most": 1} for name, fault in declared.items()}
    return {"schema": "aeros/faults/1", "faults": faults}


def judge(knock: Knock, run: dict[str, Any]) -> str:
    """Judge a run.

    Returns:
        `unharmed` if the knock did not happen; `recovered`; `given-up`, rightly and in time; or the fault.
    """
    if not run["faults"]:
        return "unharmed"
    if run["reached"]:
        return "recovered"
    if run["believed"]:
        return "false claim"
    if knock.can == "recover":
        return "given up wrongly"
    return "given-up" if run["after_fault_s"] <= CLEAR_WITHIN else "given up late"


def run_knock(knock: Knock, seed: int) -> dict[str, Any]:
    """Run one knock with one seed, and return the figures of the run with its judgement."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "knock.yaml"
        path.write_text(json.dumps(faults_of(knock)), encoding="utf-8")
        run = run_once(knock.instruction, ["--no-film", "--faults", str(path)], None, seed)
    return {"knock": knock.name, "can": knock.can, "judgement": judge(knock, run), **run}


def summarize(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Count judgements, of what can be recovered from and of what cannot."""
    of = {
        can: Counter(run["judgement"] for run in runs if run["can"] == can and run["faults"])
        for can in ("recover", "give-up")
    }
    return {"runs": len(runs), "unharmed": sum(not run["faults"] for run in runs), **of}


def main() -> None:
    """Run, print each result as its run ends, and their sum."""
    parser = build_parser(__doc__, quick="one run")
    parser.add_argument("only", nargs="*", help="beginnings of the names of the knocks; all if none is given")
    parser.add_argument("--runs", type=int, default=3, help="seeds of each knock")
    parser.add_argument("--first-seed", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1, help="runs at the same time")
    arguments = parser.parse_args()
    knocks = [
        one
        for one in read_knocks()
        if not arguments.only or any(one.name.startswith(begin) for begin in arguments.only)
    ]
    each = [
        (knock, seed)
        for knock in knocks
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.runs)
    ]
    runs = []
    with ThreadPoolExecutor(arguments.jobs) as threads:
        for run in threads.map(lambda one: run_knock(*one), each[:1] if arguments.quick else each):
            runs.append(run)
            if arguments.format == "text":
                print(format_run(run), flush=True)
    found = summarize(runs)
    if arguments.format == "json":
        print_json({**found, "each": runs})
    else:
        for can in ("recover", "give-up"):
            counts = ", ".join(f"{number} {word}" for word, number in sorted(found[can].items()))
            print(f"to be {'recovered from' if can == 'recover' else 'given up'}: {counts or 'none'}")


def format_run(run: dict[str, Any]) -> str:
    """Format one run as a line, or as several where it is not as it should be."""
    after = f"{run['after_fault_s']:.0f} s after" if run["faults"] else "-"
    line = f"{run['knock']:34} {run['seed']:5}  {run['judgement']:18} {after}, {run['processor_s']:.0f} s"
    if run["judgement"] == "recovered":
        return line
    way = run["way"] if run["judgement"] not in ("given-up", "unharmed") else ()
    return "\n      ".join((line, str(run["reason"]), *way))


if __name__ == "__main__":
    main()
