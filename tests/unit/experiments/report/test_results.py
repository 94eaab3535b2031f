"""Results: the same for the same seeds, marked where they do not agree, and whole in every form."""

from __future__ import annotations

import copy
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.catalogue import EnteredArchitecture, catalogue, select_rows
from aeros.experiments.report.results import compute_results
from aeros.experiments.report.sampled_rate import exact_at_sampled_rate
from aeros.experiments.report.write import index_page, write_report
from aeros.experiments.trial_kinds import EQUIVALENT_INTERVAL, comparison_group_of, condition_digest
from aeros.experiments.trial_runner import run_trials
from aeros.experiments.trial_store import TrialStore
from tests.unit.experiments.support.common import WHERE, Here, groups, marks, premises

ENTRY = EnteredArchitecture("tests.unit.experiments.support.entered:Stubborn")
TRIALS = 6
TRIED = {"reached": True, "tries": 1, "failed_tries": 0, "processor_s": 1.0}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return made(tmp_path_factory.mktemp("out"), ["1", "4"])


def made(folder: Path, names: list[str]) -> dict[str, Any]:
    experiments = select_rows(catalogue("symbolic", [ENTRY]), names)
    conditions = [row.condition for one in experiments for row in one.rows]
    with TrialStore(folder) as store:
        run_trials(conditions, range(TRIALS), WHERE, Here(), 1, store, lambda _: None)
        trials = store.trials
    return compute_results(experiments, trials, premises(), range(TRIALS), "symbolic", "--plant symbolic")


def test_a_third_partys_class_runs_through_all_conditions_unchanged(results: dict[str, Any]) -> None:
    (four,) = (one for one in results["experiments"] if one["number"] == 4)
    entered = [row for row in four["rows"] if row["variant"] == "Stubborn"]
    assert [row["task"] for row in entered] == ["make_dumplings", "clean_table", "fetch_object"]
    for row in entered:
        cell = row["cells"]["success"]
        assert cell["of"] == TRIALS
        assert cell["hits"] > 0
        assert cell["exact"] > 99


def test_the_same_seeds_give_the_same_tables(results: dict[str, Any], tmp_path: Path) -> None:
    again = made(tmp_path, ["1"])
    before = copy.deepcopy(results)
    before["experiments"] = [one for one in before["experiments"] if one["number"] == 1]
    for one in (*again["experiments"], *before["experiments"]):
        one.pop("timings")
        one.pop("overhead")
    conditions = {row["digest"] for one in again["experiments"] for row in one["rows"]}
    assert again.pop("work")["trials"] == len(conditions) * TRIALS < before.pop("work")["trials"]
    assert again == before


def test_rows_have_the_papers_value_the_exact_one_and_the_measured(results: dict[str, Any]) -> None:
    rows = {row["id"]: row for one in results["experiments"] for row in one["rows"]}
    cell = rows["1/static/make_dumplings"]["cells"]["success"]
    assert (cell["paper"], cell["exact"]) == (70.0, pytest.approx(70.0))
    assert cell["low"] < cell["measured"] <= cell["high"]
    # prepare, wrap, in 7 of 10 boil, and in 5 of 95 the wrapper has to be aligned before
    assert rows["1/static/make_dumplings"]["cells"]["steps"]["exact"] == pytest.approx(2.7 + 5 / 95)
    assert rows["1/dynamic/make_dumplings"]["rerun"] == (
        "aeros experiment 1/dynamic/make_dumplings --plant symbolic"
    )


def test_a_value_outside_the_interval_is_marked_and_explained(results: dict[str, Any]) -> None:
    row = next(
        row
        for one in results["experiments"]
        for row in one["rows"]
        if row["id"] == "1/dynamic/make_dumplings"
    )
    # five plans a trial, as the paper counts them
    assert "paper" in row["cells"]["replans"]["misses"]
    assert any("counts a plan for each step" in why for why in row["why"])


def test_means_over_tasks_are_pooled(results: dict[str, Any]) -> None:
    (four,) = (one for one in results["experiments"] if one["number"] == 4)
    flat = next(mean for mean in four["means"] if mean["variant"] == "flat")
    rows = [row["cells"]["success"] for row in four["rows"] if row["variant"] == "flat"]
    assert flat["cell"]["hits"] == sum(cell["hits"] for cell in rows)
    assert flat["cell"]["exact"] == pytest.approx(65.0)
    assert flat["cell"]["paper"] == 67.7


def test_pairs_are_tested_task_by_task(results: dict[str, Any]) -> None:
    (four,) = (one for one in results["experiments"] if one["number"] == 4)
    first = four["tests"][0]
    assert [one["paper"] for one in first["by_task"]] == ["0.030", "< 0.001", "0.007"]
    for one in (one for test in four["tests"] for one in test["by_task"]):
        for name in ("fisher", "mcnemar"):
            assert 0 < one[name] <= one[f"{name}_holm"] <= min(1.0, 6 * one[name])
        low, high = one["difference"]
        (hits, of), (others, _) = one["counts"]
        assert low <= 100 * (hits - others) / of <= high


def test_times_of_trials_are_compared_with_the_paper(results: dict[str, Any]) -> None:
    one, four = results["experiments"]
    assert one["overhead"] == []
    assert [(row["title"], row["paper"]) for row in four["overhead"][:2]] == [
        ("flat pipeline", 24),
        ("behaviour tree (retry = 3)", 19),
    ]
    assert all(row["measured"] > 0 for row in four["overhead"])


def test_the_report_is_whole_and_needs_no_network(results: dict[str, Any], tmp_path: Path) -> None:
    write_report(results, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"(?:src|href)\s*=(?!\"#)|url\((?!#)|<script|<link|@import", page)
    names = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert set(re.findall(r"https?://[^\"' <]+", page)) == names
    assert page.count("<svg") == 2
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    for one in results["experiments"]:
        for row in one["rows"]:
            assert row["id"] in page
            assert f"| {row['id']} |" in text
    assert all((tmp_path / name).is_file() for name in re.findall(r"\]\((figures/[^)]+)\)", text))
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8")) == json.loads(
        json.dumps(results)
    )


def test_a_report_is_made_from_the_results_alone(results: dict[str, Any], tmp_path: Path) -> None:
    kept = json.loads(json.dumps(results))
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    write_report(results, tmp_path / "one")
    write_report(kept, tmp_path / "other")
    for name in ("report.html", "report.md"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_names_chosen_by_others_stay_text(results: dict[str, Any], tmp_path: Path) -> None:
    hostile = copy.deepcopy(results)
    labels = ["<script>alert(1)</script>", "a|b", "[c](https://example.org) ![d](e.png) <https://f.org>"]
    hostile["experiments"][0]["rows"][0]["labels"] = labels
    write_report(hostile, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<td>&lt;script&gt;alert(1)&lt;/script&gt;</td>\n<td>a|b</td>" in page
    assert not re.search(r"<script|<a |<img|<image", page)
    assert "a\\|b" in (tmp_path / "report.md").read_text(encoding="utf-8")


def text_of(results: dict[str, Any], folder: Path) -> str:
    write_report(results, folder)
    return (folder / "report.md").read_text(encoding="utf-8")


def test_marked_values_without_a_reason_are_listed(results: dict[str, Any], tmp_path: Path) -> None:
    changed = copy.deepcopy(results)
    row = changed["experiments"][1]["rows"][0]
    row["cells"]["success"]["misses"], row["unexplained"] = ["exact"], ["success: exact"]
    text = text_of(changed, tmp_path)
    (line,) = (line for line in text.splitlines() if line.startswith("Marked, and not explained"))
    assert f"{row['id']} (success: exact)" in line
    assert f"{row['cells']['success']['exact']:.1f} ▲" in text


def test_agreement_is_counted_once_for_each_condition(results: dict[str, Any], tmp_path: Path) -> None:
    changed = copy.deepcopy(results)
    row = changed["experiments"][0]["rows"][0]
    for cell in (
        cell for one in changed["experiments"] for row_ in one["rows"] for cell in row_["cells"].values()
    ):
        cell["misses"] = []
    row["cells"]["success"]["misses"] = ["exact"]
    rows = {row["digest"] for one in changed["experiments"] for row in one["rows"]}
    text = text_of(changed, tmp_path)
    assert f"outside the interval of 1 of {len(rows)} shares and 0 of " in text


def test_where_nothing_is_predicted_the_report_says_why(results: dict[str, Any], tmp_path: Path) -> None:
    changed = copy.deepcopy(results)
    row = changed["experiments"][1]["rows"][0]
    row["not_predicted"] = "it raises KeyError: 'x'"
    assert f"Nothing is predicted of {row['id']}: it raises KeyError" in text_of(changed, tmp_path)


def test_an_exception_of_an_architecture_is_reported(tmp_path: Path) -> None:
    entry = EnteredArchitecture("tests.unit.experiments.support.entered:Raising")
    (experiment,) = select_rows(catalogue("symbolic", [entry]), ["4/Raising/clean_table"])
    conditions = [row.condition for row in experiment.rows]
    with TrialStore(tmp_path / "trials") as store:
        run_trials(conditions, range(2), WHERE, Here(), 1, store, lambda _: None)
        trials = store.trials
    found = compute_results([experiment], trials, premises(), range(2), "symbolic", "")
    (tmp_path / "report").mkdir()
    text = text_of(found, tmp_path / "report")
    assert "In 4/Raising/clean_table an architecture raised: ZeroDivisionError: mine." in text


def test_the_report_counts_trials_with_a_plant_of_their_own(results: dict[str, Any], tmp_path: Path) -> None:
    shared = copy.deepcopy(results)
    shared["work"] = {"trials": 600, "sharing": 0, "plants": 0, "processor_s": 5400.0}
    assert "a plant of their own" not in text_of(shared, tmp_path)
    shared["work"] = {"trials": 13_600, "sharing": 13_300, "plants": 1_031, "processor_s": 5400.0}
    text = text_of(shared, tmp_path)
    assert (
        "13,600 trials took 1.50 hours of processor; of the 13,300 of one task, 1,031 needed a plant" in text
    )


def test_a_trial_that_stands_for_others_counts_once() -> None:
    (experiment,) = select_rows(catalogue("physics"), ["8/flat/make_dumplings"])
    seeds = range(2)
    trials = {
        (condition_digest(row.condition, premises().digest), seed): {
            "reached": True,
            "live": seed == 0,
            "processor_s": 3.0,
            EQUIVALENT_INTERVAL: [0.0, 0.45] if comparison_group_of(row.condition)[1] < 0.45 else [0.45, 1.0],
        }
        for row in experiment.rows
        for seed in seeds
    }
    metrics = tuple(one for one in experiment.metrics if one.name == "success")
    few = compute_results([replace(experiment, metrics=metrics)], trials, premises(), seeds, "physics", "")
    assert few["work"] == {"trials": 18, "sharing": 18, "plants": 2, "processor_s": 12.0}


def test_chance_in_the_draws_is_separated_from_other_causes(results: dict[str, Any], tmp_path: Path) -> None:
    (experiment,) = select_rows(catalogue("physics"), ["8/behaviour_tree/make_dumplings/0.70"])
    (row,) = experiment.rows
    drawn = exact_at_sampled_rate(row.condition, [{"tries": 3, "failed_tries": 2}, TRIED], premises())
    assert drawn is not None
    assert drawn["share"] == 0.5
    assert drawn["exact"]["success"] == pytest.approx(1 - 0.5**3)
    assert exact_at_sampled_rate(row.condition, [], premises()) is None
    trials = {
        (condition_digest(row.condition, premises().digest), seed): {
            **TRIED,
            "steps": 4 + seed % 2,
            "replans": 0,
        }
        for seed in range(20)
    }
    found = compute_results([experiment], trials, premises(), range(20), "physics", "")
    (shown,) = found["experiments"][0]["rows"]
    assert shown["cells"]["attempts"]["misses"] == ["exact"]
    # None of them failed, so all are to succeed, as they did, and in the least steps, which they did not.
    assert shown["drawn"]["share"] == 0.0
    assert shown["drawn"]["exact"]["success"] == 100.0
    assert shown["drawn"]["misses"] == ["steps"]
    text = text_of(found, tmp_path)
    assert "2 exact values of other things than failed attempts are marked." in text
    assert "is inside the interval of 1 of them" in text
    assert "| 8/behaviour_tree/make_dumplings/0.70 | 0.0 | success | 65.7 ▲ | 100 | 100 [83.9, 100] |" in text
    (line,) = (line for line in text.splitlines() if line.startswith("Marked, and not explained"))
    row_id = "8/behaviour_tree/make_dumplings/0.70"
    assert line.endswith(f": {row_id} (failed attempts: exact), {row_id} (steps: exact).")


def test_one_value_has_no_interval(tmp_path: Path) -> None:
    experiments = select_rows(catalogue("symbolic"), ["1/static"])
    with TrialStore(tmp_path / "trials") as store:
        run_trials([experiments[0].rows[0].condition], range(1), WHERE, Here(), 1, store, lambda _: None)
        trials = store.trials
    one = compute_results(experiments, trials, premises(), range(1), "symbolic", "")
    steps = one["experiments"][0]["rows"][0]["cells"]["steps"]
    assert (steps["low"], steps["high"], steps["misses"]) == (None, None, [])
    (tmp_path / "report").mkdir()
    assert f"| {steps['measured']:.2f} |" in text_of(one, tmp_path / "report")


def test_the_boundary_is_drawn_of_what_was_measured(tmp_path: Path) -> None:
    experiments = select_rows(
        catalogue("symbolic"), [f"8/flat/{task}/0.90" for task in ("fetch_object", "clean_table")]
    )
    with TrialStore(tmp_path / "trials") as store:
        conditions = [row.condition for row in experiments[0].rows]
        run_trials(conditions, range(2), WHERE, Here(), 1, store, lambda _: None)
        trials = store.trials
    found = compute_results(experiments, trials, premises(), range(2), "symbolic", "")
    (mean,) = found["experiments"][0]["means"]
    assert (mean["id"], mean["cell"]["of"]) == ("8/flat/*/0.90", 4)
    assert mean["cell"]["exact"] == pytest.approx(10.0)
    (tmp_path / "report").mkdir()
    text_of(found, tmp_path / "report")
    drawn = (tmp_path / "report" / "figures" / "experiment-8.svg").read_text(encoding="utf-8")
    assert len(marks(drawn, "measured")) == 1
    assert "flat pipeline" in drawn


def test_a_page_of_saved_results_leads_to_their_report_and_data(
    results: dict[str, Any], tmp_path: Path
) -> None:
    kept = tmp_path / "results" / "kept"
    kept.mkdir(parents=True)
    write_report(results, kept)
    page = index_page([kept], results["sources"])
    row = "| [Experiments 1, 4 on the symbolic plant](results/kept/report.md) | 6 | "
    (line,) = (line for line in page.splitlines() if line.startswith(row))
    assert line.endswith("| of this code | [results](results/kept/results.json) |")
    report = (kept / "report.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\((figures/[^)]+\.svg)\)", report)
    assert len(named) == 2
    assert all((kept / name).is_file() for name in named)


def test_results_of_layers_are_tabulated_and_drawn(tmp_path: Path) -> None:
    experiments = select_rows(catalogue("physics"), ["9/wide_envelope"])
    counts = {"actions": 3, "attenuated": 0, "denied": 0, "stopped": 0, "processor_s": 0.1}
    found: dict[str, dict[str, Any]] = {
        "open": {**counts, "reached": False, "violated": True, "worst": 0.7, "told": []},
        "gate": {**counts, "reached": True, "violated": False, "worst": 0.2, "told": ["AE750 cell-speed"]},
        "both": {**counts, "reached": True, "violated": False, "worst": 0.0, "told": ["AE501"]},
    }
    found["both"]["installed"] = False
    trials = {
        (condition_digest(row.condition, premises().digest), seed): {**found[row.id.rpartition("/")[2]]}
        for row in experiments[0].rows
        for seed in range(2)
    }
    trials[condition_digest(experiments[0].rows[0].condition, premises().digest), 1]["worst"] = 0.9
    results = compute_results(experiments, trials, premises(), range(2), "physics", "")
    open_, gate, both = results["experiments"][0]["rows"]
    assert open_["cells"]["worst"] == {
        "measured": 0.9,
        "low": None,
        "high": None,
        "exact": None,
        "independent": None,
        "paper": None,
        "misses": [],
    }
    assert "installed" not in open_["cells"]
    assert (both["cells"]["installed"]["measured"], both["cells"]["installed"]["exact"]) == (0.0, 0.0)
    assert gate["told"] == ["AE750 cell-speed"]
    text = text_of(results, tmp_path)
    assert "| what was said |" in text
    assert "| AE750 cell-speed |" in text
    drawn = (tmp_path / "figures" / "experiment-9.svg").read_text(encoding="utf-8")
    assert all(result in drawn for result in ("100 % violated, 0.9", "0 % violated, 0.2", "not installed"))


def test_sessions_are_drawn_one_by_one(tmp_path: Path) -> None:
    experiments = select_rows(catalogue("symbolic"), ["11/once"])
    success = [1.0] * 25 + [0.0] * 25
    found = {
        "reached": False,
        "successes": 30,
        "late": 5,
        "tries": 1.0,
        "regret": 8.0,
        "series": {"success": success, "tries": [1] * 50},
        "processor_s": 0.1,
    }
    trials = {
        (condition_digest(row.condition, premises().digest), seed): found
        for row in experiments[0].rows
        for seed in range(2)
    }
    results = compute_results(experiments, trials, premises(), range(2), "symbolic", "")
    series = results["experiments"][0]["rows"][0]["series"]
    assert series["success"]["measured"] == success
    assert len(series["success"]["exact"]) == len(series["best"]["exact"]) == 50
    assert (series["best"]["measured"], series["tries"]["exact"]) == (None, None)
    text_of(results, tmp_path)
    drawn = (tmp_path / "figures" / "experiment-11.svg").read_text(encoding="utf-8")
    # two conditions of fifty sessions, and two quantities of each
    assert len(marks(drawn, "mean")) == 200
    assert len(groups(drawn, "exact")) == 2
    assert len(groups(drawn, "best")) == 1
    assert "knows the chances" in drawn


def test_times_are_drawn_on_logarithmic_axes(tmp_path: Path) -> None:
    experiments = select_rows(catalogue("symbolic"), ["10/1", "10/10", "10/1000"])
    names = [metric.median or metric.maximum for metric in experiments[0].metrics if not metric.is_share]
    trials = {
        (condition_digest(row.condition, premises().digest), seed): {
            "reached": True,
            "processor_s": 0.1,
            **{name: float(row.variant) + seed for name in names},
        }
        for row in experiments[0].rows
        for seed in range(7)
    }
    results = compute_results(experiments, trials, premises(), range(7), "symbolic", "")
    cell = results["experiments"][0]["rows"][1]["cells"]["decide_us"]
    assert (cell["measured"], cell["low"], cell["high"]) == (13.0, 10.0, 16.0)
    text_of(results, tmp_path)
    drawn = (tmp_path / "figures" / "experiment-10.svg").read_text(encoding="utf-8")
    assert len(marks(drawn, "measured")) == 3 * len(names)
    assert all(f">{tick}<" in drawn for tick in ("1", "10", "100", "1000"))
    assert "lookup of a task" in drawn
    assert all(0 <= float(one.get(axis, "")) <= 1000 for one in marks(drawn, "measured") for axis in "xy")


def test_scale_is_the_same_on_each_plant() -> None:
    of = [[row.condition for row in catalogue(plant)[10].rows] for plant in ("physics", "symbolic")]
    assert of[0] == of[1]
    assert [condition.settings["modules"] for condition in of[0]] == [1, 3, 10, 30, 100, 300, 1000]
