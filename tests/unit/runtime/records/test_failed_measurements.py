"""Lines about failed measurements, of records of any form."""

from __future__ import annotations

import pytest

from aeros.runtime.records.failed_measurements import failure_text


@pytest.mark.parametrize(
    ("event", "details", "text"),
    [
        (
            "perceiver-failed",
            {"module": "tidy", "perceiver": "top", "reason": "dark", "unknown": ["tidy.x", "tidy.y"]},
            "perceiver `tidy.top` failed: dark; unknown: tidy.x, tidy.y",
        ),
        (
            "tool-failed",
            {"tool": "ask", "reason": "no answer", "unknown": []},
            "tool `ask` failed: no answer",
        ),
        ("tool-failed", {}, "tool `None` failed: None"),
        ("tool-answered", {"tool": "ask"}, ""),
        ("perceiver-recovered", {}, ""),
        (
            "perceiver-unsure",
            {
                "module": "tidy",
                "perceiver": "top",
                "uncertainties": {"tidy.x": "9 mm, declared at most 8 mm"},
            },
            "perceiver `tidy.top` is less certain than declared, so unknown: "
            "tidy.x to 9 mm, declared at most 8 mm",
        ),
        ("perceiver-unsure", {"module": "tidy", "perceiver": "top", "uncertainties": {}}, ""),
        ("perceiver-unsure", {}, ""),
    ],
)
def test_a_failure_is_one_line(event: str, details: dict[str, object], text: str) -> None:
    assert failure_text(event, details) == text
