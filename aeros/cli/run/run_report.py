"""The summary of a run, printed at its end."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import isfinite
from types import MappingProxyType
from typing import Any

from aeros.agent.execution.report import RunReport
from aeros.cli.terminal.rendering import LABEL_COLUMNS, table_lines
from aeros.sim.referee import GoalJudgement
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.expr.units import to_unit
from aeros.spec.model.variables import Declared
from aeros.spec.verification.reports import Report


def summary(
    proof_report: Report,
    report: RunReport,
    plant: str,
    simulated: float,
    real: float,
    judgement: GoalJudgement | None = None,
    failures: Sequence[str] = (),
    declared: Mapping[str, Declared] = MappingProxyType({}),
) -> str:
    """Summarize a run in a few lines.

    Args:
        proof_report: Verification report of the modules.
        report: The agent's report.
        plant: Name of the plant.
        simulated: Duration on the plant's clock, in seconds.
        real: Duration on the wall clock, in seconds.
        judgement: The referee's judgement of the goal; None if there is no referee.
        failures: Measurements that had failed at the end, one line each; they come before the reason.
        declared: State variables by name; the values of these are shown in their units.

    Returns:
        Lines of text.
    """
    measured = _measured(report.measured, declared)
    obligations = sum(module.claim_count for module in proof_report.modules)
    guarded = sum(module.runtime_checked_count for module in proof_report.modules)
    reasons = [escape_invisible(one) for one in (*failures, str(report.reason))]
    outcome = f"goal not reached: {'; then: '.join(reasons)}" if report.has_failed else report.outcome
    proved = f"{len(proof_report.modules)} proved, {obligations} obligations, {guarded} runtime-checked"
    counts = (
        f"{len(report.steps)} run",
        counted(report.retries, "retry"),
        counted(report.recoveries, "recovery"),
        counted(report.replans, "re-plan"),
    )
    rows = [
        ("goal", report.goal),
        ("measured", f"{measured} ({plant} plant)"),
        *(() if judgement is None else (("truth", str(judgement)),)),
        ("modules", proved),
        ("steps", ", ".join(counts)),
        ("decisions", f"{report.allowed} allowed, {report.attenuated} attenuated, {report.denied} denied"),
        ("time", f"{simulated:.1f} s simulated, {real:.1f} s real"),
    ]
    lines = table_lines(rows, width=None, least=(LABEL_COLUMNS,))
    return "\n".join(["", f"{report.module}.{report.task}: {outcome}", *lines])


def _measured(values: Mapping[str, Any], declared: Mapping[str, Declared]) -> str:
    return ", ".join(f"{name} = {_value(value, declared.get(name))}" for name, value in values.items())


def _value(value: Any, declared: Declared | None) -> str:
    if value is None:
        return "unknown"
    is_list = isinstance(value, list | tuple)
    numbers = value if is_list else [value]
    if declared is None or not all(type(one) in (int, float) and isfinite(one) for one in numbers):
        return json.dumps(value)
    shown = [f"{float(to_unit(Fraction(one), declared.unit)):.4g}" for one in numbers]
    unit = "" if declared.unit.text == "1" else f" {declared.unit.text}"
    return (f"[{', '.join(shown)}]" if is_list else shown[0]) + unit
