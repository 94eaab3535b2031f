"""Measure loading a module while a robot runs: `python -m benchmarks.registry.swap`.

A swap installs, configures and activates one module in one change, with its proof and its signed record,
and then changes the gate in a running executor. *Install*, *configure* and *activate* are the same as three
changes. All proofs of single modules are in a cache of its own, in a temporary folder, as after the first
installation. Next to seconds by the clock stand processor seconds of this process, which other load of the
machine affects less, and the number of times that the program itself waited for the disk (SQLite's own
waits are not counted).

`--sizes` also measures one more synthetic module beside N active ones
(`aeros/experiments/trials/synthetic.py`), each time another that was never proved; the proofs of the N are
made first, which is not measured.  *First* is the first swap: of `clean_table`, it makes the proof.  All
other figures are medians.
"""

from __future__ import annotations

import os
import platform
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from aeros.experiments.trials.synthetic import write_module, write_modules
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.registry.bundle_store import bundle_digest, module_files, store_bundle
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.runtime.registry.stored_modules import policy_file
from aeros.spec.model.configured import UNCONFIGURED
from aeros.spec.text.discovery import reference_modules_path, reference_site_path
from benchmarks.command import build_parser, print_json

_STEPS = ("install", "configure", "activate", "at once", "gate", "swap")
_FIRST_NEW = 1000  # of the second thousand: no module of a site has this number


class Stopwatch:
    """Seconds by the clock and of the processor, and waits for the disk, of one step after another."""

    def __init__(self) -> None:
        self.waits = 0
        self.steps: dict[str, tuple[float, float, int]] = {}

    def measure(self, name: str, act: Callable[[], object]) -> Any:
        """Do something, and add what it took to the step `name`; return its result."""
        clock, processor, waits = time.perf_counter(), time.process_time(), self.waits
        found = act()
        clock, processor = time.perf_counter() - clock, time.process_time() - processor
        self.steps[name] = clock, processor, self.waits - waits
        return found

    @contextmanager
    def counting_waits(self) -> Iterator[None]:
        """Count the calls of `os.fsync` and `os.fdatasync`."""
        kept = {name: getattr(os, name) for name in ("fsync", "fdatasync")}

        def counted(name: str) -> Callable[[int], None]:
            def call(descriptor: int) -> None:
                self.waits += 1
                kept[name](descriptor)

            return call

        try:
            for name in kept:
                setattr(os, name, counted(name))
            yield
        finally:
            for name, function in kept.items():
                setattr(os, name, function)


def swap(registry: Registry, governor: RegistryGovernor, gate: CompiledGate, folder: Path) -> Stopwatch:
    """Load the module in `folder` in three changes and in one, change the gate, and take it out again."""
    watch, name = Stopwatch(), folder.name
    with watch.counting_waits():
        watch.measure("install", lambda: registry.install(folder))
        watch.measure("configure", lambda: registry.configure(name))
        watch.measure("activate", lambda: registry.activate(name))
        registry.deactivate(name)
        registry.remove(name)
        watch.measure("at once", lambda: registry.install(folder, active=UNCONFIGURED))
        watch.measure("gate", lambda: gate.with_configuration(governor.configuration()[1]))
    change, following = watch.steps["at once"], watch.steps["gate"]
    watch.steps["swap"] = change[0] + following[0], change[1] + following[1], change[2] + following[2]
    registry.deactivate(name)
    registry.remove(name)
    return watch


def measure_swaps(
    registry: Registry, folder: Callable[[int], Path], runs: int
) -> dict[str, dict[str, dict[str, float]]]:
    """Swap repeatedly in a running robot; return the figures of each step, of the first and of the others."""
    with RegistryGovernor(registry) as governor:
        gate = CompiledGate(governor.configuration()[1])
        watches = [swap(registry, governor, gate, folder(number)) for number in range(runs + 1)]
    return {
        step: {"first": _figures(watches[:1], step), "median": _figures(watches[1:], step)} for step in _STEPS
    }


def _figures(watches: list[Stopwatch], step: str) -> dict[str, float]:
    rows = [watch.steps[step] for watch in watches]
    names = ("clock_ms", "processor_ms", "waits")
    scales = (1e3, 1e3, 1)
    columns = zip(*rows, strict=True)
    return {
        name: statistics.median(column) * scale
        for name, scale, column in zip(names, scales, columns, strict=True)
    }


def shipped(folder: Path, runs: int) -> dict[str, dict[str, dict[str, float]]]:
    """Swap `clean_table` in and out beside `make_dumplings`, as experiment 6 does."""
    modules = reference_modules_path()
    registry = Registry(folder / "state")
    registry.install(modules / "make_dumplings")
    registry.configure("make_dumplings")
    registry.activate("make_dumplings")
    return measure_swaps(registry, lambda _: modules / "clean_table", runs)


def synthetic(folder: Path, count: int, runs: int) -> dict[str, dict[str, dict[str, float]]]:
    """Swap one more synthetic module in and out beside `count` active ones, each time another."""
    registry = Registry(folder / f"state_{count}")
    activate_all(registry, write_modules(folder / f"modules_{count}", count))
    return measure_swaps(registry, lambda number: write_module(folder / "new", _FIRST_NEW + number), runs)


def activate_all(registry: Registry, folders: list[Path]) -> None:
    """Put all modules in force with one change, as each change by itself is proved."""
    with registry._transactions.change_lock() as old:
        modules: Mapping[str, InstalledModule] = {
            folder.name: InstalledModule(
                folder.name, "1.0.0", bundle_digest(module_files(folder)), ModuleState.ACTIVE
            )
            for folder in folders
        }
        content = reference_site_path().read_bytes()
        new = RegistrySnapshot(site=policy_file(content), modules=modules)
        with registry._transactions.stored_policy(new, content):
            for folder in folders:
                store_bundle(module_files(folder), registry.folder / "modules", folder.name)
            configuration, _ = registry._prove_snapshot(new)
            registry._transactions.commit(old, new, "all synthetic modules", configuration)


def main() -> None:
    """Measure, and print tables or JSON."""
    parser = build_parser(__doc__, quick="few runs, and few modules")
    parser.add_argument("--sizes", type=int, nargs="*", default=[])
    parser.add_argument("--runs", type=int, default=21)
    arguments = parser.parse_args()
    sizes, runs = ([2], 1) if arguments.quick else (arguments.sizes, arguments.runs)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["AEROS_CACHE"] = str(folder / "cache")
        found: dict[str, Any] = {"python": platform.python_version(), "shipped": shipped(folder, runs)}
        found["synthetic"] = {str(size): synthetic(folder, size, min(runs, 5)) for size in sizes}
    if arguments.format == "json":
        print_json(found)
        return
    _print_table("clean_table beside make_dumplings", found["shipped"])
    for size, row in found["synthetic"].items():
        _print_table(f"one more beside {size} active modules", row)


def _print_table(title: str, rows: Mapping[str, Mapping[str, Mapping[str, float]]]) -> None:
    print(f"| {title} | clock, ms | processor, ms | waits | first: clock, ms | processor, ms |")
    print("|:--|--:|--:|--:|--:|--:|")
    for step, row in rows.items():
        first, median = row["first"], row["median"]
        shown = f"{median['clock_ms']:.1f} | {median['processor_ms']:.1f} | {median['waits']:.0f}"
        print(f"| {step} | {shown} | {first['clock_ms']:.0f} | {first['processor_ms']:.0f} |")
    print()


if __name__ == "__main__":
    main()
