"""Results of mutation: what became of each mutant, as text in `results/`, and their sums.

A row is one or more mutants of a unit that the same test killed, or that met the same other end.  Rows of a
unit whose digest is no longer that of its code are dropped with the next run.
"""

from __future__ import annotations

import csv
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.mutation.areas import Area

HERE: Final = Path(__file__).parent
MOST_EQUIVALENT: Final = 2.0
"""Percent of the tried mutants that may be called equivalent."""

KILLED: Final = "killed"
SURVIVED: Final = "survived"
LATE: Final = "timed out"
SAME: Final = "same code"
"""The compiled code is that of the original, so no test can differ."""

_FIELDS = ("unit", "digest", "mutants", "verdict", "killer", "numbers", "seconds")

Key = tuple[str, str]
"""Name and digest of a unit."""


@dataclass
class Outcome:
    """End of one mutant: verdict, test or theorem that killed it, seconds of the processor."""

    verdict: str
    killer: str
    seconds: float


class AreaResults:
    """Results of one area, by unit and number of the mutant."""

    def __init__(self, area: str) -> None:
        self.path = HERE / "results" / f"{area}.csv"
        self.of: dict[Key, dict[int, Outcome]] = defaultdict(dict)
        self.totals: dict[Key, int] = {}
        if self.path.exists():
            with self.path.open(encoding="utf-8", newline="") as file:
                for row in csv.DictReader(file):
                    self._read(row)

    def _read(self, row: Mapping[str, str]) -> None:
        key = row["unit"], row["digest"]
        numbers = _expanded(row["numbers"])
        self.totals[key] = int(row["mutants"])
        for number in numbers:
            self.of[key][number] = Outcome(
                row["verdict"], row["killer"], float(row["seconds"]) / len(numbers)
            )

    def keep(self, totals: Mapping[Key, int]) -> None:
        """Drop units that are no more, and set how many mutants each has."""
        self.totals = dict(totals)
        for key in self.of.keys() - totals.keys():
            del self.of[key]

    def write(self) -> None:
        """Write the file again; equal results give equal text."""
        self.path.parent.mkdir(exist_ok=True)
        with self.path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(_FIELDS)
            for key in sorted(self.totals):
                rows: dict[tuple[str, str], list[int]] = defaultdict(list)
                for number, outcome in sorted(self.of.get(key, {}).items()):
                    rows[outcome.verdict, outcome.killer].append(number)
                for (verdict, killer), numbers in sorted(rows.items()):
                    seconds = sum(self.of[key][number].seconds for number in numbers)
                    writer.writerow(
                        (*key, self.totals[key], verdict, killer, _ranges(numbers), f"{seconds:.1f}")
                    )
                if not rows:
                    writer.writerow((*key, self.totals[key], "untried", "", "", "0.0"))


def _ranges(numbers: Iterable[int]) -> str:
    """Write ascending numbers as `1-3 7`."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and parts[-1][-1] == number - 1:
            parts[-1][1:] = [number]
        else:
            parts.append([number])
    return " ".join("-".join(map(str, part)) for part in parts)


def _expanded(text: str) -> list[int]:
    found: list[int] = []
    for part in text.split():
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def argued() -> dict[tuple[Key, int], tuple[str, str]]:
    """Read which mutants are equivalent, or never end, and why: kind and argument by unit and number."""
    found = {}
    with (HERE / "arguments.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            for number in _expanded(row["numbers"]):
                found[(row["unit"], row["digest"]), number] = row["kind"], row["argument"]
    return found


@dataclass(frozen=True)
class Summary:
    """Sums of one area or of all; `equivalent` ones are no survivors, and `endless` ones are killed."""

    mutants: int = 0
    tried: int = 0
    killed: int = 0
    equivalent: int = 0
    seconds: float = 0.0

    @property
    def survived(self) -> int:
        """Tried mutants that no test notices, those that ran out of time included."""
        return self.tried - self.killed - self.equivalent

    def percent(self, count: int) -> float:
        """Share of the tried mutants."""
        return 100 * count / self.tried if self.tried else 100.0

    def holds(self, floor: float) -> bool:
        """Compare with a floor, in percent, and with the most equivalent mutants."""
        return self.percent(self.killed) >= floor and self.percent(self.equivalent) <= MOST_EQUIVALENT


def summarise(results: AreaResults) -> Summary:
    """Sum up an area."""
    known = argued()
    ends: Counter[str] = Counter()
    for key, outcomes in results.of.items():
        for number, outcome in outcomes.items():
            kind, _ = known.get((key, number), ("", ""))
            if outcome.verdict == SAME or (kind == "equivalent" and outcome.verdict == SURVIVED):
                ends["equivalent"] += 1
            elif outcome.verdict == KILLED or (kind == "endless" and outcome.verdict == LATE):
                ends[KILLED] += 1
            else:
                ends[SURVIVED] += 1
    seconds = sum(outcome.seconds for one in results.of.values() for outcome in one.values())
    return Summary(sum(results.totals.values()), ends.total(), ends[KILLED], ends["equivalent"], seconds)


def summary_table(areas: Sequence[Area]) -> tuple[str, bool]:
    """Sum up areas in a table of Markdown, and say if each holds its floor."""
    rows = {area.name: summarise(AreaResults(area.name)) for area in areas}
    holds = all(rows[area.name].holds(area.floor) for area in areas)
    if len(rows) > 1:
        fields = ("mutants", "tried", "killed", "equivalent", "seconds")
        rows["all"] = Summary(*(sum(getattr(one, name) for one in rows.values()) for name in fields))
    titles = ("area", "mutants", "untried", "tried", "killed", "equivalent", "survived", "processor time")
    lines = [f"| {' | '.join(titles)} |", "|---" * len(titles) + "|"]
    for name, one in rows.items():
        numbers = map(str, (one.mutants, one.mutants - one.tried, one.tried))
        counts = one.killed, one.equivalent, one.survived
        shares = [f"{part} = {one.percent(part):.1f} %" if one.tried else "-" for part in counts]
        lines.append(f"| {' | '.join((name, *numbers, *shares, f'{one.seconds:.0f} s'))} |")
    return "\n".join(lines) + "\n", holds
