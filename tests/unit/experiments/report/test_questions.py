"""Questions are answered by what is kept, and one that names what is not there is an error."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.report import questions
from aeros.experiments.report.questions import entries_table, question_blocks
from aeros.spec.diagnostics.errors import InternalError
from tests.unit.experiments.report.made_up import cell, experiment, results, row, share

ROWS = (
    row("4/a", {"success": share(60.0, 65.0, paper=70.0), "steps": cell(3.25)}),
    row("4/b", {"success": share(100.0)}),
)
MEAN = {"id": "4/a/*", "cell": share(99.97, 50.0)}
KEPT = {"one": results(experiment(*ROWS, means=[MEAN]))}


def asked(monkeypatch: pytest.MonkeyPatch, **changed: Any) -> list[str]:
    question = {
        "title": "Is it so?",
        "results": "one",
        "metrics": ["success", "steps"],
        "text": "Yes: {4/a:success} %, as {4/a:success:paper} and {4/a/*:success}, in {4/a:steps} steps.",
        "rows": {"first": "4/a", "second": "4/b", "mean": "4/a/*"},
        **changed,
    }
    monkeypatch.setattr(questions, "read_data", lambda name: {"question": [question]})
    return [block.markdown for block in question_blocks(KEPT)]


def test_a_text_has_the_values_of_its_rows_and_a_table_what_was_measured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert asked(monkeypatch) == [
        "## Is it so?",
        "Yes: 60.0 %, as 70.0 and > 99.9, in 3.2 steps.",
        "| symbolic, 100 trials each | success, %: paper | success, %: exact | success, %: measured "
        "| steps: measured |\n|---|---|---|---|---|\n"
        "| first | 70.0 | 65.0 | 60.0 [50.0, 70.0] | 3.2 [-6.8, 13.2] |\n"
        "| second |  |  | 100 [90.0, 110.0] |  |\n"
        "| mean |  | 50.0 | > 99.9 [90.0, 110.0] |  |",
    ]


def test_a_question_may_show_some_values_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    (_, _, shown) = asked(monkeypatch, metrics=["success"], shown=["measured"])
    assert shown.splitlines()[0] == "| symbolic, 100 trials each | success, %: measured |"


def test_a_question_about_results_that_are_not_kept_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    assert asked(monkeypatch, results="other") == []


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rows": {"first": "4/z"}}, "the kept results have no row `4/z`"),
        ({"text": "{4/b:steps}"}, "`{4/b:steps}`: there is no such value"),
        ({"text": "{4/b:success:exact}"}, "`{4/b:success:exact}`: there is no such value"),
    ],
)
def test_a_value_that_is_not_there_is_an_error(
    changed: dict[str, Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InternalError, match=message):
        asked(monkeypatch, **changed)


def test_entries_of_all_reports_are_ranked_by_success_at_equal_budgets() -> None:
    def mean(title: str, at: str, measured: float) -> dict[str, Any]:
        return {"id": f"16/{title}/*/{at}", "title": title, "at": at, "cell": share(measured)}

    ours = [mean("AEROS", "3-tries", 95.0), mean("AEROS", "120-s", 80.0), mean("tree", "3-tries", 90.0)]
    kept = {
        "ours": results(experiment(ROWS[0], number=16, means=ours)),
        "theirs": results(experiment(ROWS[0], number=16, means=[mean("Mine", "120-s", 99.0)])),
        "other": results(experiment(ROWS[0], number=4, means=[mean("flat", "", 100.0)])),
    }
    assert entries_table(kept).markdown.splitlines() == [
        "| entry | results | plant | success, %: 3-tries | success, %: 120-s |",
        "|---|---|---|---|---|",
        "| Mine | theirs | symbolic |  | 99.0 [89.0, 109.0] |",
        "| tree | ours | symbolic | 90.0 [80.0, 100] |  |",
        "| AEROS | ours | symbolic | 95.0 [85.0, 105.0] | 80.0 [70.0, 90.0] |",
    ]
