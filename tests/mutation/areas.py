"""Areas of the kernel: their code and the tests that are tried on its mutants, as `areas.toml` lists them."""

from __future__ import annotations

import importlib
import re
import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class Area:
    """One area.

    Attributes:
        name: its name, that of its results file, too.
        code: patterns of paths of its code.
        tests: files and folders of its tests.
        warm: cached functions of tests, `module:function`, to be called before the first fork.
        whole: tests about all of its code at once, which `--near` tries on every mutant.
        floor: percent of the tried mutants that must be killed; equivalent ones count as not killed.
    """

    name: str
    code: tuple[str, ...]
    tests: tuple[str, ...]
    warm: tuple[str, ...] = ()
    whole: tuple[str, ...] = ()
    floor: float = 95.0

    def warm_up(self) -> None:
        """Call what tests would compute anew in each fork, by code of other areas."""
        for name in self.warm:
            module, _, function = name.partition(":")
            getattr(importlib.import_module(module), function)()

    def files(self) -> list[str]:
        """Return the paths of its code; an empty package has none."""
        found = {path for pattern in self.code for path in Path().glob(pattern)}
        return sorted(str(path) for path in found if path.name != "__init__.py")

    def modules(self) -> list[str]:
        """Return the names of its modules."""
        return [".".join(Path(name).with_suffix("").parts) for name in self.files()]

    def proves(self) -> bool:
        """Tell if it is of the code that proves, whose mutants leave wrong proofs in caches."""
        return any(pattern.startswith("aeros/spec/") for pattern in self.code)


def read_areas() -> dict[str, Area]:
    """Read `areas.toml`."""
    text = Path(__file__).with_name("areas.toml").read_text(encoding="utf-8")
    return {
        name: Area(
            name,
            **{key: tuple(one.get(key, ())) for key in ("code", "tests", "warm", "whole")},
            floor=one.get("floor", 95.0),
        )
        for name, one in tomllib.loads(text).items()
    }


@cache
def tests_near(area: Area, module: str) -> tuple[str, ...]:
    """Return the test files near a module, nearest first."""
    package, _, stem = module.rpartition(".")
    folder = Path("tests/unit", *package.split(".")[1:])
    mirrors = [*folder.glob(f"test_{stem}.py"), *folder.glob(f"test_{stem}_*.py")]
    files = sorted(
        path for one in map(Path, area.tests) for path in ([one] if one.is_file() else one.rglob("test_*.py"))
    )
    names = re.compile(rf"{re.escape(module)}\b|from {re.escape(package)} import .*\b{stem}\b")
    importers = [path for path in files if names.search(path.read_text("utf-8"))]
    inside = [path for path in files if path.parent == folder]
    return tuple(dict.fromkeys(str(path) for path in (*sorted(mirrors), *area.whole, *importers, *inside)))


def near_tests(area: Area, modules: Collection[str]) -> list[str]:
    """Return the test files near some modules of an area, in the order of their names."""
    return sorted({name for module in modules for name in tests_near(area, module)})
