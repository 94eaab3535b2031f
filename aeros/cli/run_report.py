"""What a run says: progress while it goes on, its trace, and the summary at its end."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

from aeros.agent.journal import Event
from aeros.agent.report import RunReport
from aeros.spec.render import safe
from aeros.spec.reports import Report


class TraceWriter:
    """Writes each event of the agent as a line of JSON, and prints it as a line for people.

    shown_on: where it is printed; standard output if nothing is given.
    """

    def __init__(self, path: Path, shown_on: TextIO | None = None) -> None:
        self._file = path.open("a", encoding="utf-8")
        self._shown_on = shown_on
        self._is_shown = True

    def tell(self, event: Event) -> None:
        """Write and print one event."""
        line = {"time": event.time, "kind": event.kind, "text": event.text, "details": event.details}
        self._file.write(json.dumps(line, default=str) + "\n")
        self._file.flush()
        if self._is_shown and event.text:
            try:
                print(f"{event.time:7.2f} s  {safe(event.text)}", file=self._shown_on, flush=True)
            except OSError:
                self._is_shown = False  # whoever read along went away; that is no reason to stop a robot

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()


def summary(proof: Report, report: RunReport, plant: str, simulated: float, real: float) -> str:
    """The end of a run in a few lines."""
    measured = _measured(report.measured)
    obligations = sum(module.obligation_count for module in proof.modules)
    guarded = sum(module.guarded_count for module in proof.modules)
    outcome = "goal reached" if report.reached else f"goal not reached: {report.reason}"
    return "\n".join(
        (
            "",
            f"{report.module}.{report.task}: {outcome}",
            f"goal       {report.goal}; measured on the {plant} plant: {measured}",
            f"modules    {len(proof.modules)} proved, {obligations} obligations, {guarded} left to the gate",
            f"steps      {len(report.steps)} run, {report.retries} retries, {report.recoveries} recoveries, "
            f"{report.replans} re-plans",
            f"decisions  {report.allowed} allowed, {report.attenuated} attenuated, {report.denied} denied",
            f"time       {simulated:.1f} s simulated, {real:.1f} s real",
        )
    )


def _measured(values: Mapping[str, Any]) -> str:
    return ", ".join(
        f"{name} = {'unknown' if value is None else json.dumps(value)}" for name, value in values.items()
    )
