"""Lines that each test executes, kept between runs in `mutants/`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

FOLDER: Final = Path("mutants")


class Reach:
    """The lines of an area's files that each test executes, and how long each test runs.

    Tests of a file that has changed are measured again, and so are those that execute a file of the area
    that has changed.
    """

    def __init__(self, area: str, files: Iterable[str]) -> None:
        FOLDER.mkdir(exist_ok=True)
        self._path = FOLDER / f"{area}.json"
        self._now = {name: _digest(name) for name in files}
        kept: dict[str, Any] = json.loads(self._path.read_text()) if self._path.exists() else {}
        before: dict[str, str] = kept.get("files", {})
        changed = {name for name in {*before, *self._now} if before.get(name) != self._now.get(name)}
        self._tests: dict[str, dict[str, Any]] = {
            test: {**one, "lines": {name: int(bits, 16) for name, bits in one["lines"].items()}}
            for test, one in kept.get("tests", {}).items()
            if one["digest"] == _digest(test.partition("::")[0]) and not changed & one["lines"].keys()
        }

    def unknown(self, tests: Iterable[str]) -> list[str]:
        """Return the tests that are to be measured."""
        return [test for test in tests if test not in self._tests]

    def add(self, test: str, lines: dict[str, list[int]], seconds: float) -> None:
        """Keep the result of a measurement."""
        packed = {name: sum(1 << line for line in set(found)) for name, found in lines.items() if found}
        digest = _digest(test.partition("::")[0])
        self._tests[test] = {"digest": digest, "lines": packed, "seconds": round(seconds, 3)}

    def write(self) -> None:
        """Write everything to its file."""
        tests = {
            test: {**one, "lines": {name: f"{bits:x}" for name, bits in one["lines"].items()}}
            for test, one in self._tests.items()
        }
        self._path.write_text(json.dumps({"files": self._now, "tests": tests}))

    def seconds(self, test: str) -> float:
        """Return the processor time of a test."""
        return float(self._tests[test]["seconds"])

    def tests(self, name: str, first: int, last: int) -> list[str]:
        """Return the tests that execute one of these lines of a file, fastest first."""
        wanted = ((1 << (last - first + 1)) - 1) << first
        found = [test for test, one in self._tests.items() if one["lines"].get(name, 0) & wanted]
        return sorted(found, key=self.seconds)


def _digest(name: str) -> str:
    path = Path(name)
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else ""
