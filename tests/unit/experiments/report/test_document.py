"""Results as a document: every block, its tables and its marks."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.experiments.report.document import document, title_of
from aeros.experiments.report.results import corrected_tests
from tests.unit.experiments.report.made_up import cell, experiment, results, row, share


@pytest.mark.parametrize(
    ("numbers", "title"),
    [
        ([3], "Experiment 3 on the physics plant"),
        ([8, 1, 2, 3], "Experiments 1 to 3, 8 on the physics plant"),
    ],
)
def test_a_report_is_called_by_what_is_in_it(numbers: list[int], title: str) -> None:
    found = {"plant": "physics", "experiments": [{"number": number} for number in numbers]}
    assert title_of(found) == title


def text_of(*experiments: dict[str, Any], **more: Any) -> list[str]:
    """The document's blocks as text."""
    return [block.markdown for block in document(results(*experiments, **more), "figures")]


def rows_of(table: str) -> list[list[str]]:
    """The cells of a table, without the line below its head."""
    lines = [line for line in table.splitlines() if not line.startswith("|---")]
    return [[text.strip() for text in line.strip("|").split(" | ")] for line in lines]


ONE = row("4/flat/clean_table", {"success": share(60.0, 70.0), "steps": cell(3.5)})
SUCCESS_ONLY = row("4/other/clean_table", {"success": share(99.97, 100.0)})


def table_with(blocks: list[str], first: str) -> list[list[str]]:
    (found,) = [block for block in blocks if block.startswith(f"| {first} |")]
    return rows_of(found)


def test_the_document_begins_with_title_seeds_and_work() -> None:
    title, intro, work, *_ = text_of(experiment(ONE))
    assert title == "# Experiment 4 on the symbolic plant"
    assert intro.startswith("100 trials of each condition, seeds 0 to 99, the same for all")
    assert work == "100 trials took 0.50 hours of processor."


def test_headings_are_as_deep_as_requested() -> None:
    blocks = [block.markdown for block in document(results(experiment(ONE)), "figures", top_level=2)]
    assert blocks[0].startswith("## Experiment 4")
    assert "### 4 made up" in blocks


def test_shared_trials_are_reported_with_the_plants_that_they_needed() -> None:
    work = {"trials": 2000, "sharing": 1500, "plants": 12, "processor_s": 3600.0}
    assert text_of(experiment(ONE), work=work)[2].startswith(
        "2,000 trials took 1.00 hours of processor; of the 1,500 of one task, 12 needed a plant of their own"
    )


def test_agreement_counts_shares_and_means_once_for_each_condition() -> None:
    missing = row("5/x", {"success": share(60.0, 90.0, misses=["exact"]), "steps": cell(3.0, 3.1)})
    nothing = row("5/y", {"success": share(60.0), "steps": cell(3.0, 3.0, low=None, high=None)})
    again = {**missing, "id": "6/x"}
    blocks = text_of(experiment(missing, nothing), experiment(again, number=6))
    assert "The exact value is outside the interval of 1 of 1 shares and 0 of 1 means." in blocks


def test_the_environment_is_a_table() -> None:
    found = table_with(text_of(experiment(ONE)), "made with")
    assert found[1:] == [
        ["commit", "abc"],
        ["premises", "pppppppp"],
        ["Python", "3.11.7"],
        ["platform", "Linux, 2 processors"],
        ["packages", "numpy 2.0, scipy 1.1"],
    ]
    environment = {**results()["environment"], "commit": None}
    assert ["commit", "not known"] in table_with(
        text_of(experiment(ONE), environment=environment), "made with"
    )


def test_each_condition_has_its_values_and_intervals() -> None:
    head, first, second = table_with(text_of(experiment(ONE, SUCCESS_ONLY)), "condition |  | ")
    assert head == ["condition", "", "", "success, %: exact", "success, %: measured", "steps: measured"]
    assert first == [
        "4/flat/clean_table",
        "flat pipeline",
        "table",
        "70.0",
        "60.0 [50.0, 70.0]",
        "3.50 [-6.50, 13.50]",
    ]
    assert second == ["4/other/clean_table", "flat pipeline", "table", "100", "> 99.9 [90.0, 110.0]", ""]


def test_a_value_outside_its_interval_is_marked_and_one_without_interval_stands_alone() -> None:
    of_paper = share(60.0, 90.0, paper=65.0, misses=["exact"])
    single = cell(2.0, low=None, high=None)
    _, found = table_with(
        text_of(experiment(row("4/a", {"success": of_paper, "steps": single}))), "condition |  | "
    )
    assert found[3:] == ["65.0", "90.0 ▲", "60.0 [50.0, 70.0]", "2.00"]


def test_messages_have_a_column_if_there_are_any() -> None:
    marked = row("4/a", {"success": share(60.0)}, told=["AE750 x", "AE1 y"])
    head, first, second = table_with(text_of(experiment(marked, SUCCESS_ONLY)), "condition |  | ")
    assert (head[-1], first[-1], second[-1]) == ("what was said", "AE750 x, AE1 y", "")


def test_a_long_table_is_collapsed() -> None:
    for count, title in ((20, ""), (21, "all 21 conditions")):
        rows = [row(f"4/{number}", {"success": share(50.0)}) for number in range(count)]
        blocks = list(document(results(experiment(*rows)), "figures"))
        (found,) = [block for block in blocks if "| 4/0 |" in block.markdown]
        assert found.collapsed_title == title


def test_label_note_reasons_and_exceptions_are_paragraphs() -> None:
    explained = row("4/a", {"success": share(1.0)}, why=["because", "also"], raised=["KeyError: 'x'"])
    other = row("4/b", {"success": share(1.0)}, why=["because"], not_predicted="it is endless")
    blocks = text_of(experiment(explained, other, label="Table 4", note="A note."))
    assert [block for block in blocks if block in ("because", "also")] == ["because", "also"]
    for text in (
        "In the paper: Table 4.",
        "A note.",
        "In 4/a an architecture raised: KeyError: 'x'.",
        "Nothing is predicted of 4/b: it is endless.",
        "Whether these reach their goal is not predicted: 4/a.",
        "Again: `aeros experiment 4/a --plant symbolic`, and so with any other condition's name.",
    ):
        assert text in blocks


def test_marks_without_explanation_are_listed() -> None:
    marked = row("4/*/a", {"success": share(1.0, 2.0)}, unexplained=["success: exact", "steps: paper"])
    assert "Marked, and not explained: 4/\\*/a (success: exact), 4/\\*/a (steps: paper)." in text_of(
        experiment(marked)
    )
    assert not any(text.startswith("Marked") for text in text_of(experiment(ONE)))


def test_differences_explained_by_chance_in_the_draws_are_a_table() -> None:
    drawn = {"share": 12.34, "exact": {"success": 61.0, "steps": 9.0}, "misses": ["steps"]}
    cells = {"success": share(60.0, 90.0, misses=["exact"]), "steps": cell(3.0, 20.0, misses=["exact"])}
    blocks = text_of(experiment(row("4/a", cells, drawn=drawn)))
    (note,) = [text for text in blocks if text.startswith("2 exact values of other things")]
    assert "is inside the interval of 1 of them" in note
    (found,) = [rows_of(text) for text in blocks if "attempts that failed, %" in text]
    assert found[1:] == [
        ["4/a", "12.3", "success", "90.0 ▲", "61.0", "60.0 [50.0, 70.0]"],
        ["4/a", "12.3", "steps", "20.00 ▲", "9.00 ▲", "3.00 [-7.00, 13.00]"],
    ]


def test_means_over_tasks_have_a_table_of_their_own() -> None:
    mean = {
        "id": "4/flat/*",
        "title": "flat",
        "variant": "flat",
        "at": "0.10",
        "along": "rate",
        "tasks": 3,
        "cell": share(60.0, 65.0),
        "drawn": None,
        "why": [],
        "unexplained": [],
    }
    blocks = text_of(experiment(ONE, means=[mean]))
    assert table_with(blocks, "mean over tasks") == [
        ["mean over tasks", "rate", "paper, %", "exact, %", "measured, %"],
        ["flat", "0.10", "", "65.0", "60.0 [50.0, 70.0]"],
    ]
    plain = {**mean, "at": "", "along": ""}
    assert table_with(text_of(experiment(ONE, means=[plain])), "mean over tasks")[1][:2] == ["flat", ""]


def test_tests_overhead_and_times_are_tables() -> None:
    tested = {"paper": None, "one_sided": 0.0312, "fisher": 0.0599, "mcnemar": 1.0}
    shares = {"counts": [[100, 100], [95, 100]], "difference": [0.53, 11.21], "detectable": 7.66}
    by_task = [{"task": "t", "at": "3-tries", **tested, **shares}]
    timings = {"4/a": {"alone_s": 0.0123, "reaction_s": 0.5}, "4/b": {"alone_s": 0.002}}
    blocks = text_of(
        experiment(
            ONE,
            tests=corrected_tests([{"first": "aeros", "second": "tree", "by_task": by_task * 2}]),
            overhead=[
                {"title": "flat", "paper": 24, "measured": 3.14159},
                {"title": "tree", "paper": None, "measured": 2.0},
            ],
            timings=timings,
        )
    )
    row = ["t 3-tries", "5.0 [0.5, 11.2]", "7.7", "", "0.031", "0.06", "0.12", "1", "1"]
    assert table_with(blocks, "aeros against tree")[1] == row
    assert any(text.startswith("The paper's values are of Fisher's exact test") for text in blocks)
    assert table_with(blocks, "a trial without physics")[1:] == [["flat", "24", "3.1"], ["tree", "", "2.0"]]
    head, first, second = next(rows_of(text) for text in blocks if "by itself, ms" in text)
    assert head[1:] == [
        "processor time by itself, ms a trial",
        "from hazard to stop, real time, ms a trial",
    ]
    assert (first, second) == (["4/a", "12.30", "500.00"], ["4/b", "2.00", ""])


def test_a_comparison_of_nothing_is_left_out() -> None:
    nothing = {"first": "aeros", "second": "tree", "by_task": []}
    assert not any("against" in text for text in text_of(experiment(ONE, tests=[nothing])))


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (100.0, 1, "100"),
        (100.0 - 1e-12, 2, "100"),
        (99.96, 1, "> 99.9"),
        (99.95, 1, "> 99.9"),
        (99.94, 1, "99.9"),
        (99.996, 2, "> 99.99"),
        (0.0, 1, "0.0"),
        (120.0, 1, "120.0"),
    ],
)
def test_only_a_hundred_is_shown_as_a_hundred(value: float, digits: int, text: str) -> None:
    # shares have one digit, other values two
    name, made = ("success", share(value)) if digits == 1 else ("steps", cell(value))
    cells = {name: {**made, "low": None, "high": None}}
    _, line = table_with(text_of(experiment(row("4/a", cells))), "condition |  | ")
    assert line[-1] == text
