"""Failures of perceivers and tools that left values of a step unknown."""

from __future__ import annotations

from typing import Any

from aeros.apps.why.causal_chain import RunLog
from aeros.apps.why.failed_measurements import failures_before


def record(event: str, /, **details: Any) -> dict[str, Any]:
    return {"event": event, "details": details}


def failed(perceiver: str, reason: str, module: str = "tidy") -> dict[str, Any]:
    return record(
        "perceiver-failed", module=module, perceiver=perceiver, reason=reason, unknown=[f"{module}.x"]
    )


LOG = [
    failed("top", "too dark"),
    failed("side", "too dark"),
    record("perceiver-recovered", module="tidy", perceiver="side"),
    record("tool-failed", tool="ask", reason="before the step", unknown=[]),
    record("note", event="step-started", details={"skill": "tidy.look"}),
    failed("top", "too small"),
    failed("top", "of another module", "wipe"),
    record("tool-failed", tool="ask", reason="no answer", unknown=["time"]),
    record("tool-failed", tool="tell", reason="no answer", unknown=["time"]),
    record("tool-answered", tool="tell", answer={}),
    record("step-ended", module="tidy", skill="look", status="finished"),
    record("note", event="step-ended", details={"skill": "tidy.look", "failed": True, "outcome": "hidden"}),
    failed("top", "after the step"),
]


def test_a_value_that_is_uncertain_at_the_end_counts_beside_failures() -> None:
    def unsure(**uncertainties: str) -> dict[str, Any]:
        return record("perceiver-unsure", module="tidy", perceiver="top", uncertainties=uncertainties)

    log = [failed("top", "too dark"), unsure(x="9 mm, declared at most 8 mm")]
    dark = "perceiver `tidy.top` failed: too dark; unknown: tidy.x"
    vague = "perceiver `tidy.top` is less certain than declared, so unknown: x to 9 mm, declared at most 8 mm"
    assert list(failures_before(log, 0, 2, "tidy")) == [(0, dark), (1, vague)]
    assert list(failures_before([*log, unsure()], 0, 3, "tidy")) == [(0, dark)]


def test_the_last_failure_of_each_that_has_not_recovered_counts() -> None:
    assert list(failures_before(LOG, 4, 11, "tidy")) == [
        (5, "perceiver `tidy.top` failed: too small; unknown: tidy.x"),
        (7, "tool `ask` failed: no answer; unknown: time"),
    ]


def test_they_come_before_the_end_of_a_step_that_failed() -> None:
    log = RunLog(LOG)
    chain = log.explain_step(log.steps[0]).chain
    assert [link.text for link in chain[:2]] == [text for _, text in failures_before(LOG, 4, 11, "tidy")]
    assert [link.is_failed_measurement for link in chain] == [True, True, False, False]


def test_they_come_before_the_end_of_a_run_each_once() -> None:
    ended = record(
        "note",
        event="run-ended",
        details={"task": "tidy.clean", "reached": False, "reason": "the gate denied"},
    )
    chain = RunLog([*LOG[:12], ended]).explain_end().chain
    assert [link.record for link in chain] == [5, 7, 12, 11, 10]
    assert [link.is_failed_measurement for link in chain] == [True, True, False, False, False]


def test_a_run_without_a_step_names_the_perceivers_of_its_task() -> None:
    ended = record("note", event="run-ended", details={"task": "tidy.clean", "reached": False, "reason": "x"})
    chain = RunLog([failed("top", "too dark"), failed("top", "not asked", "wipe"), ended]).explain_end().chain
    assert [(link.record, link.is_failed_measurement) for link in chain] == [(0, True), (2, False)]
