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


def test_the_last_failure_of_each_that_has_not_recovered_counts() -> None:
    assert list(failures_before(LOG, 4, 11, "tidy")) == [
        (5, "perceiver `tidy.top` failed: too small; unknown: tidy.x"),
        (7, "tool `ask` failed: no answer; unknown: time"),
    ]


def test_they_are_links_of_the_chain_of_a_step_that_failed() -> None:
    log = RunLog(LOG)
    texts = [link.text for link in log.explain_step(log.steps[0]).chain]
    assert texts[-2:] == [text for _, text in failures_before(LOG, 4, 11, "tidy")]
