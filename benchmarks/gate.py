"""Measure the time of one decision, in AEROS and in other engines: `python -m benchmarks.gate`.

All engines decide the same requests in one process, in turns, and must agree on every one of them.
Then an allowed request is corrupted in twelve ways, and the benchmark counts what each engine still allows.
Engines that are not installed are left out: `pip install '.[benchmark]'`.
"""

from __future__ import annotations

import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.skill import Action
from benchmarks.command import build_parser, print_json
from benchmarks.gate_policy import (
    NOW,
    BenchmarkRequest,
    checked_policy,
    configuration,
    naive_policy,
    requests,
)
from benchmarks.other_engines import OTHER_ENGINES

Call = Callable[[], bool]
HAND_WRITTEN_ENGINE = "by hand, checked"

CORRUPTED: tuple[tuple[str, Any], ...] = (
    ("speed", float("nan")),
    ("speed", None),
    ("speed", "0.1"),
    ("force", float("nan")),
    ("force", float("-inf")),
    ("force", True),
    ("x", float("nan")),
    ("human", 0),
    ("human", None),
    ("risk", "MEDIUM"),
    ("skill", "wipe "),
    ("actuators", None),
)
"""Fields of an allowed request beside a person, and what stands in them instead."""


def _aeros(gate: CompiledGate) -> Callable[[BenchmarkRequest], Call]:
    """Return the call that a runtime makes for each action; the request is prepared before it is timed."""

    def prepared(asked: BenchmarkRequest) -> Call:
        values = dict(asked.attributes)
        caller = Caller("surfaces", values["skill"], {})
        readings = {"human": Reading(values["human"], NOW)}
        action = Action(asked.kind, {name: values[name] for name in ("x", "y", "z", "speed", "force")})
        decide, usage = gate.decide, dict[str, int]()
        return lambda: decide(caller, readings, action, NOW, usage).kind is DecisionKind.ALLOW

    return prepared


def _engine_call(decide: Callable[[Mapping[str, Any]], bool]) -> Callable[[BenchmarkRequest], Call]:
    def prepared(asked: BenchmarkRequest) -> Call:
        values = dict(asked.attributes)
        return lambda: decide(values)

    return prepared


def engines(folder: Path) -> tuple[dict[str, Callable[[BenchmarkRequest], Call]], list[str]]:
    """List every installed engine by name, and the names of those that are not installed."""
    proved = configuration(folder)
    found = {
        "by hand, naive": _engine_call(naive_policy),
        HAND_WRITTEN_ENGINE: _engine_call(checked_policy),
        "AEROS compiled": _aeros(CompiledGate(proved)),
        "AEROS z3": _aeros(CompiledGate(proved, GateMode.Z3)),
    }
    absent = []
    for name, (module, make) in OTHER_ENGINES.items():
        if find_spec(module) is None:
            absent.append(name)
        else:
            found[name] = _engine_call(make())
    return found, absent


def measure(calls: Mapping[str, Sequence[Call]], rounds: int) -> dict[str, list[float]]:
    """Measure the best time of each call of each engine, µs, over rounds that the engines take in turns."""
    clock = time.perf_counter
    empty = min(_time_call(clock, lambda: True) for _ in range(1000))
    best = {name: [float("inf")] * len(made) for name, made in calls.items()}
    for _ in range(rounds):
        for name, made in calls.items():
            times = best[name]
            for number, call in enumerate(made):
                times[number] = min(times[number], _time_call(clock, call))
    # What reading the clock and calling a function that does nothing take is no part of a decision.
    return {name: [max(one - empty, 0.0) * 1e6 for one in times] for name, times in best.items()}


def _time_call(clock: Callable[[], float], call: Call) -> float:
    started = clock()
    call()
    return clock() - started


def count_fail_open(prepare: Callable[[BenchmarkRequest], Call], allowed: BenchmarkRequest) -> list[str]:
    """List the corrupted fields with which the request is still allowed."""
    found = []
    for field, value in CORRUPTED:
        corrupted = replace(allowed, attributes={**allowed.attributes, field: value})
        if field == "risk":  # of AEROS's requests the kind says the risk
            corrupted = replace(corrupted, kind=allowed.kind.upper())
        if field == "actuators":
            corrupted = replace(corrupted, kind=f"{allowed.kind}_with_nothing")
        if _allows(prepare, corrupted):
            found.append(f"{field} = {value!r}")
    return found


def _allows(prepare: Callable[[BenchmarkRequest], Call], asked: BenchmarkRequest) -> bool:
    try:
        return prepare(asked)()
    except Exception:  # an engine that raises does not allow
        return False


def run(count: int, rounds: int) -> dict[str, Any]:
    """Run the whole measurement."""
    with tempfile.TemporaryDirectory() as folder:
        found, absent = engines(Path(folder))
    asked = requests(count)
    calls = {name: [prepare(one) for one in asked] for name, prepare in found.items()}
    answers = {name: [call() for call in made] for name, made in calls.items()}
    expected = answers["by hand, naive"]
    disagreeing = {
        name: sum(one is not other for one, other in zip(given, expected, strict=True))
        for name, given in answers.items()
    }
    if any(disagreeing.values()):
        sys.exit(f"engines disagree: {disagreeing}")
    near = next(
        one for one, is_allowed in zip(asked, expected, strict=True) if is_allowed and one.attributes["human"]
    )
    times = measure(calls, rounds)
    hand = statistics.median(times[HAND_WRITTEN_ENGINE])
    rows = [
        {
            "engine": name,
            "version": _version(name),
            "p50_us": statistics.median(each),
            "p99_us": sorted(each)[int(0.99 * (len(each) - 1))],
            "to_hand_written": statistics.median(each) / hand,
            "p50_us_allowed": _median_where(True, each, expected),
            "p50_us_denied": _median_where(False, each, expected),
            "fail_opens": count_fail_open(found[name], near),
        }
        for name, each in times.items()
    ]
    return {
        "requests": count,
        "allowed": sum(expected),
        "rounds": rounds,
        "python": platform.python_version(),
        "absent": absent,
        "engines": rows,
    }


def _median_where(verdict: bool, times: Sequence[float], expected: Sequence[bool]) -> float:
    return statistics.median(one for one, allowed in zip(times, expected, strict=True) if allowed is verdict)


def _version(engine: str) -> str:
    try:
        return version(engine.split()[0].lower())
    except PackageNotFoundError:
        return ""


def main() -> None:
    """Measure, and print a table or JSON."""
    parser = build_parser(__doc__, quick="few requests once")
    parser.add_argument("--requests", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=7, help="of each call the best of so many is taken")
    arguments = parser.parse_args()
    count, rounds = (50, 1) if arguments.quick else (arguments.requests, arguments.rounds)
    found = run(count, rounds)
    if arguments.format == "json":
        print_json(found)
        return
    print(f"{found['requests']} requests, {found['allowed']} allowed, all engines agree; µs per decision\n")
    print(
        "| engine | p50 | p99 | p50 where allowed | where denied | to by hand, checked"
        " | allowed though corrupted, of 12 |"
    )
    print("|---|--:|--:|--:|--:|--:|---|")
    for row in sorted(found["engines"], key=lambda row: row["p50_us"]):
        opens = row["fail_opens"]
        print(
            f"| {row['engine']} {row['version']} | {row['p50_us']:.2f} | {row['p99_us']:.2f}"
            f" | {row['p50_us_allowed']:.2f} | {row['p50_us_denied']:.2f} | {row['to_hand_written']:.1f}"
            f" | {len(opens)}{': ' if opens else ''}{'; '.join(opens)} |"
        )
    for name in found["absent"]:
        print(f"\nskipped: {name} is not installed")


if __name__ == "__main__":
    main()
