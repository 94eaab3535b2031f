"""Demands on time as rules of a site, and the decision on a step after a trace of measurements.

A deadline counts steps. AEROS's past-time conditions count seconds, as one step takes one robot longer than
another; so a site says how long a step may take (`STEP`), and a deadline of n steps is a window of n - 1 of
them.
"""

from __future__ import annotations

import re
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.terms import variables_of
from aeros.spec.model.site import Site

STEP: Final = 10
"""Time of a step, s."""

OTHER_STEP: Final = "do_something_else"
"""Action kind of all steps that a demand does not name."""

_SITE: Final = """\
schema: aeros/site/1
id: home
description: One demand of SafeAgentBench.
state:
{state}
actions:
  stop: {{description: protective stop, risk: low, protective: true}}
{actions}
invariants:
  - {{id: demand, on: [{on}], require: "{require}", rationale: the task demands it, source: SafeAgentBench}}
policy:
  risk_ceiling: low
  access: {{actuators: [], sensors: [eyes]}}
  limits: {{skill_timeout: 60 s, retries: 0, replans: 0}}
"""


@dataclass(frozen=True)
class Demand:
    """A demand on time.

    Attributes:
        task: number of the task, from 0.
        kind: `order`, `deadline` or `eventual`.
        condition: what has to hold before the action (`order`), what may not last (`deadline`), or what has
        to
            hold at the end (`eventual`).
        actions: the action that needs the condition (`order`), or those that end it (`deadline`).
        steps: steps until it has to end (`deadline`).
    """

    task: int
    kind: Literal["order", "deadline", "eventual"]
    condition: str
    actions: tuple[str, ...]
    steps: int

    @property
    def names(self) -> list[str]:
        """Predicates of the condition."""
        return sorted(set(re.findall(r"\w+", self.condition)) - {"not", "and", "or"})

    @property
    def rule(self) -> tuple[str, str] | None:
        """The action kind that is ruled, and the rule; None for a demand that no rule on actions can make."""
        if self.kind == "order":
            return self.actions[0], self.condition
        if self.kind == "eventual":
            return None
        if self.steps == 1:
            return OTHER_STEP, f"not ({self.condition})"
        return OTHER_STEP, f"not (historically within {STEP * (self.steps - 1)} s ({self.condition}))"


def read_demands() -> list[Demand]:
    """Read `demands.toml`."""
    rows = tomllib.loads(Path(__file__).with_name("demands.toml").read_text("utf-8"))["demand"]
    return [
        Demand(
            row["task"],
            row["kind"],
            row.get("need") or row.get("while") or row["goal"],
            tuple(row.get("ends", [row["before"]] if "before" in row else [])),
            row.get("steps", 0),
        )
        for row in rows
    ]


def site_text(demand: Demand) -> str:
    """Write a site whose one invariant is the demand.

    Args:
        demand: an order or a deadline.

    Returns:
        The text of the site file.
    """
    if demand.rule is None:
        raise InternalError("a demand without a bound is no rule")
    on, require = demand.rule
    state = "\n".join(
        f"  {name}: {{type: bool, sensor: eyes, max_age: {2 * STEP} s}}" for name in demand.names
    )
    kinds = dict.fromkeys((OTHER_STEP, *demand.actions))
    actions = "\n".join(f"  {kind}: {{description: a step, risk: low}}" for kind in kinds)
    return _SITE.format(state=state, actions=actions, on=on, require=require)


class DemandGate:
    """Decisions on steps under one demand, with the past that was measured."""

    def __init__(self, demand: Demand) -> None:
        self._site = _load(site_text(demand))
        self._histories = HistoryTracker(self._site)
        self._time = 0.0
        self._known: Mapping[str, Any] = {}

    def measure(self, values: Mapping[str, bool]) -> None:
        """Take the next sample, one step after the last.

        Args:
            values: value of each predicate.
        """
        self._time += STEP
        readings = {name: Reading(value, self._time) for name, value in values.items()}
        self._known = {**values, **self._histories.advance(readings, self._time)}

    def allows(self, kind: str) -> bool:
        """Decide a step now.

        Args:
            kind: its action kind.

        Returns:
            True if no rule denies it; a rule on something unknown denies.
        """
        terms = [rule.terms[kind] for rule in self._site.rules_for_kind(kind)]
        return all(
            variables_of(term).keys() <= self._known.keys() and is_true(term, self._known) for term in terms
        )


def _load(text: str) -> Site:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "site.yaml")
        file.write_text(text, "utf-8")
        diagnostics = Diagnostics()
        site = load_site(file, diagnostics)
    diagnostics.raise_if_errors()
    if site is None:
        raise InternalError("a site that was not read was not reported")
    return site


def counts(demands: Sequence[Demand]) -> dict[str, int]:
    """Count tasks by the kind of their demands; a task with two demands of a kind counts once."""
    kinds = ("order", "deadline", "eventual")
    return {kind: len({one.task for one in demands if one.kind == kind}) for kind in kinds}
