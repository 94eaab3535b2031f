"""Measure the time of a past-time condition for each sample: `python -m benchmarks.monitors`.

Compares AEROS with reelay and rtamt.

One stream of a real x, a sample each second; `historically` and `once` over windows of 10 to 5,000 s of
`x < 1`.  AEROS gets what its executor gives it, readings with times, and checks their form and age; reelay
gets a dictionary.  The input of each is made before it is timed, as a plant makes it, and that is timed by
itself.  Monitors agree on every sample.  Then NaN, or nothing, comes in place of a sample, and the output of
each is shown.  Monitors that are not installed are left out: `pip install '.[benchmark]'`.
"""

from __future__ import annotations

import gc
import random
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading, Readings
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from benchmarks.command import build_parser, print_json

_OPERATORS = ("historically", "once")
_SITE = """schema: aeros/site/1
id: monitors
description: One real that is watched.
state:
  x: {{type: real, unit: m, range: [0, 2], sensor: eye, max_age: 1500 ms}}
actions:
  stop: {{description: protective stop, risk: low, protective: true}}
  move: {{description: move, risk: low, actuators: [arm]}}
invariants:
  - {{id: past, on: [move], require: {operator} within {window} s x < 1 m, rationale: x, source: x}}
policy:
  risk_ceiling: low
  access: {{actuators: [arm], sensors: [eye]}}
  limits: {{skill_timeout: 60 s, retries: 2, replans: 5}}
resources: {{arm: 1}}
"""

Sample = float | None
"""Measured value; None if there is no measurement."""


@dataclass(frozen=True)
class Monitor:
    """One engine's monitor of one condition.

    Attributes:
        prepare_sample: makes the engine's input from the number of a sample, from 1 on, and its value.
        update: reads the next input; returns `true`, `false` or `unknown`, or how it failed.
    """

    prepare_sample: Callable[[int, Sample], Any]
    update: Callable[[Any], str]


def aeros(operator: str, window: int) -> Monitor:
    """Build the histories of a site with this rule."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "site.yaml"
        path.write_text(_SITE.format(operator=operator, window=window), encoding="utf-8")
        site = load_site(path, Diagnostics())
    if site is None:
        sys.exit("the site of the benchmark is not accepted")
    histories = HistoryTracker(site)
    (name,) = histories.names
    advance = histories.advance
    # Every rule is kept as what happened once: `historically c` is `not once not c`.
    is_negated = operator == "historically"

    def prepare_sample(number: int, sample: Sample) -> tuple[Readings, float]:
        now = float(number)
        return {} if sample is None else {"x": Reading(sample, now)}, now

    def update(given: tuple[Readings, float]) -> str:
        known = advance(*given)
        if name not in known:
            return "unknown"
        return "true" if known[name] is not is_negated else "false"

    return Monitor(prepare_sample, update)


def reelay(operator: str, window: int) -> Monitor:
    """Build reelay's monitor in discrete time, with repeated results kept."""
    monitor = import_module("reelay").discrete_timed_monitor(
        pattern=f"{operator}[0:{window}]{{x < 1.0}}", condense=False
    )

    def prepare_sample(_: int, sample: Sample) -> dict[str, float]:
        return {} if sample is None else {"x": sample}

    def update(given: dict[str, float]) -> str:
        result = monitor.update(given)
        return "true" if result["value"] else "false"

    return Monitor(prepare_sample, update)


def rtamt(operator: str, window: int) -> Monitor:
    """Build rtamt's online monitor in discrete time; robustness above zero is true."""
    monitor = import_module("rtamt").StlDiscreteTimeSpecification()
    monitor.declare_var("x", "float")
    monitor.spec = f"{operator}[0,{window}](x < 1.0)"
    monitor.parse()

    def prepare_sample(number: int, sample: Sample) -> tuple[int, list[tuple[str, float]]]:
        return number - 1, [] if sample is None else [("x", sample)]

    def update(given: tuple[int, list[tuple[str, float]]]) -> str:
        return "true" if monitor.update(*given) > 0 else "false"

    return Monitor(prepare_sample, update)


MONITORS: Mapping[str, Callable[[str, int], Monitor]] = {"AEROS": aeros, "reelay": reelay, "rtamt": rtamt}


def sample_stream(count: int, window: int) -> list[float]:
    """Generate samples: long stretches of one value, with up to three samples of the other between them."""
    chance = random.Random(1)  # noqa: S311 - repeats, and guards nothing
    found: list[float] = []
    while len(found) < count:
        usual = chance.choice([0.5, 1.5])
        found += [usual] * chance.randint(1, 2 * window)
        found += [2.0 - usual] * chance.randint(1, 3)
    return found[:count]


class MonitorTiming(NamedTuple):
    """Output of a monitor at each sample, and the mean time of a sample, µs.

    Attributes:
        outputs: one for each sample.
        us: time of an update.
        preparation_us: time to make the engine's input of a sample, not part of `us`.
    """

    outputs: list[str]
    us: float
    preparation_us: float


def measure(monitor: Monitor, samples: Sequence[float]) -> MonitorTiming:
    """Measure one pass over the samples: processor time, without garbage collection, as `timeit` does."""
    clock, update, prepare_sample = time.process_time, monitor.update, monitor.prepare_sample
    gc.disable()
    try:
        preparation_start = clock()
        inputs = [prepare_sample(number, sample) for number, sample in enumerate(samples, 1)]
        started = clock()
        outputs = [update(one) for one in inputs]
        ended = clock()
    finally:
        gc.enable()
    return MonitorTiming(
        outputs, (ended - started) / len(samples) * 1e6, (started - preparation_start) / len(samples) * 1e6
    )


def windows(sizes: Sequence[int], count: int, rounds: int, absent: Sequence[str]) -> list[dict[str, Any]]:
    """Measure the median over rounds for each operator and window; all monitors agree on every sample."""
    rows: list[dict[str, Any]] = []
    for operator in _OPERATORS:
        for window in sizes:
            samples = sample_stream(count, window)
            passes: dict[str, list[MonitorTiming]] = {name: [] for name in MONITORS if name not in absent}
            for _ in range(rounds):
                for name, each in passes.items():
                    few = samples[: max(20, count // 50)] if name == "rtamt" and window > 100 else samples
                    each.append(measure(MONITORS[name](operator, window), few))
                for name, each in passes.items():
                    if each[-1].outputs != passes["AEROS"][-1].outputs[: len(each[-1].outputs)]:
                        sys.exit(f"{name} differs: {operator}[0:{window}]")
            medians = {
                field: {
                    name: statistics.median(getattr(one, field) for one in each)
                    for name, each in passes.items()
                }
                for field in ("us", "preparation_us")
            }
            rows.append({"operator": operator, "window": window, **medians})
    return rows


def after_corruption(absent: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return the output of `historically` for a good sample, then for NaN or nothing in place of the next."""
    found: dict[str, dict[str, str]] = {}
    for name, make in MONITORS.items():
        if name in absent:
            continue
        found[name] = {}
        for label, sample in (("nan", float("nan")), ("missing", None)):
            monitor = make("historically", 10)
            monitor.update(monitor.prepare_sample(1, 0.5))
            try:
                found[name][label] = monitor.update(monitor.prepare_sample(2, sample))
            except Exception as error:
                found[name][label] = f"raises {type(error).__name__}"
    return found


def main() -> None:
    """Measure, and print a table or JSON."""
    parser = build_parser(__doc__, quick="one small window")
    parser.add_argument("--windows", type=int, nargs="+", default=[10, 100, 1000, 5000])
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    sizes, count, rounds = arguments.windows, arguments.samples, arguments.rounds
    if arguments.quick:
        sizes, count, rounds = [10], 100, 1
    absent = [name for name in MONITORS if name != "AEROS" and find_spec(name) is None]
    rows, corrupted = windows(sizes, count, rounds, absent), after_corruption(absent)
    if arguments.format == "json":
        print_json({"windows": rows, "after_corruption": corrupted, "absent": absent})
        return
    names = list(rows[0]["us"])
    print("µs of processor time per sample, and to make what is taken of one\n")
    print(f"| condition | {' | '.join(names)} |\n|---|{'--:|' * len(names)}")
    for row in rows:
        cells = " | ".join(f"{row['us'][name]:.2f} + {row['preparation_us'][name]:.2f}" for name in names)
        print(f"| `{row['operator']}[0:{row['window']}]` | {cells} |")
    print("\n`historically` after a true sample:")
    for name, outputs in corrupted.items():
        print(f"- {name}: NaN: {outputs['nan']}; nothing: {outputs['missing']}")
    for name in absent:
        print(f"\nskipped: {name} is not installed")


if __name__ == "__main__":
    main()
