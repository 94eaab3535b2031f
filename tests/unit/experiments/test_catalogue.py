"""The data says what there is, and every value of the paper has its place in it."""

from __future__ import annotations

from fnmatch import fnmatchcase
from math import comb, sqrt

import pytest

from aeros.agent.execution.repeats import MOST_OF_A_KIND
from aeros.experiments.architecture import build_architecture
from aeros.experiments.catalogue import EnteredArchitecture, catalogue, read_data, select_rows
from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import KINDS, kind_of
from aeros.sim.randomness import RandomSource
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.experiments.support.common import premises

EXPERIMENTS = catalogue("symbolic")
ROWS = {row.id: (one, row) for one in EXPERIMENTS.values() for row in one.rows}


def test_every_row_has_a_name_of_its_own() -> None:
    assert len(ROWS) == sum(len(one.rows) for one in EXPERIMENTS.values())


def test_every_condition_is_one_that_can_be_tried() -> None:
    tasks = {one.id for ecm in premises().configuration.modules.values() for one in ecm.tasks.values()}
    for _, row in ROWS.values():
        if row.condition.kind == "task":
            settings = row.condition.settings
            assert settings["task"] in tasks
            build_architecture(settings["architecture"], settings["options"])
        assert row.condition.kind in KINDS


def test_every_value_of_the_paper_has_its_row_and_metric() -> None:
    for id_, values in read_data("paper.toml")["value"].items():
        if "*" in id_:
            number, variant, _, *rate = id_.split("/")
            assert values.keys() == {"success"}
            of = [row for row in EXPERIMENTS[int(number)].rows if row.variant == variant]
            assert of
            assert not rate or rate[0] in {row.rate for row in of}
            continue
        one, _ = ROWS[id_]
        assert values.keys() <= {metric.name for metric in one.metrics}, id_


def test_every_explanation_is_of_rows_that_there_are() -> None:
    means = {
        "/".join([str(number), row.variant, "*", *([row.sweep_value] if row.sweep_value else [])]): one
        for number, one in EXPERIMENTS.items()
        for row in one.rows
    }
    named = {**means, **{id_: one for id_, (one, _) in ROWS.items()}}
    for one in read_data("paper.toml")["explanation"]:
        for rows in one["rows"]:
            found = [experiment for id_, experiment in named.items() if fnmatchcase(id_, rows)]
            assert found, rows
            metrics = {metric.name for experiment in found for metric in experiment.metrics}
            for mark in one["of"]:
                metric, which = mark.split(": ")
                assert which in {"paper", "exact", "independent"}
                assert metric in metrics or len(one["of"]) > 1, (rows, mark)


def test_numbers_in_explanations_are_those_that_can_be_computed() -> None:
    data = read_data("experiments.toml")
    rates = {name: float(one["rate"]) for name, one in data["task"].items()}
    assert list(rates.values()) == [0.30, 0.40, 0.35]
    texts = [one["text"] for one in read_data("paper.toml")["explanation"]]

    def succeed(rate: float, tries: int) -> str:
        return f"{100 * (1 - rate**tries):.1f}".removesuffix(".0")

    for start, numbers in {
        "Three independent attempts at failure": [succeed(rate, 3) for rate in rates.values()],
        "One attempt succeeds": [succeed(rate, 1) for rate in rates.values()],
        "Two attempts at 50 %": [succeed(0.5, 2)],
        "The paper says that re-planning": [succeed(0.3, 3), succeed(0.4, 2)],
        "On fetching": [succeed(0.35, 2), succeed(0.35, 3)],
        "Three independent attempts at 90 %": [succeed(0.9, 3)],
    }.items():
        (text,) = (one for one in texts if one.startswith(start))
        assert all(number in text for number in numbers), (text, numbers)
    (stopped,) = (one for one in texts if one.startswith("What is exact takes each failure"))
    assert MOST_OF_A_KIND == 3
    assert f"fails with 0.9^3 = {100 * 0.9**MOST_OF_A_KIND:.1f} %" in stopped
    (by_chance,) = (one for one in texts if one.startswith("It is chance"))
    few = sum(comb(100, good) * 0.4**good * 0.6 ** (100 - good) for good in range(33))
    assert f"32 of them or fewer do with {100 * few:.0f} %" in by_chance


def test_the_first_hundred_seeds_draw_few_failures_of_the_press_and_others_as_many_as_they_should() -> None:
    """As the report says of experiment 8 on physics."""

    def failed(seeds: range) -> int:
        count = 0
        for seed in seeds:
            draws, chance = 0, RandomSource(seed)
            while chance.generator("fault/handle_dropped", draws).uniform(size=2)[1] < 0.7:
                draws += 1
            count += draws
        return count

    (text,) = (
        one["text"] for one in read_data("paper.toml")["explanation"] if "It is the seeds" in one["text"]
    )
    for seeds in (range(100), range(100, 1000)):
        share = failed(seeds) / (failed(seeds) + len(seeds))
        assert f"{100 * share:.0f} %" in text.replace("a rate of 70 %", "")
    # Failures before a success: of n seeds n·p/(1 − p), with a variance of n·p/(1 − p)².
    off = (failed(range(100)) - 100 * 0.7 / 0.3) / (sqrt(100 * 0.7) / 0.3)
    assert f"{-off:.1f} standard deviations" in text


def test_retry_and_recovery_without_another_plan_do_no_better_than_retries() -> None:
    """As the note of experiment 2 says."""
    settings = ROWS["2/retry/make_dumplings/0.50"][1].condition.settings
    exact = []
    for options in ({"retries": 1, "recovery": recovery, "replans": 0} for recovery in (False, True)):
        condition = TrialCondition.create("task", "symbolic", {**settings, "options": options})
        expected = kind_of("task").expected_values(condition, premises())
        assert not isinstance(expected, str)
        exact.append(expected["success"])
    assert exact == [0.75, 0.75]


def test_identical_conditions_are_one() -> None:
    assert ROWS["1/static/make_dumplings"][1].condition == ROWS["5/static/make_dumplings"][1].condition
    assert ROWS["4/aeros/clean_table"][1].condition == ROWS["8/aeros/clean_table/0.40"][1].condition


@pytest.mark.parametrize(
    ("names", "count"),
    [
        (["all"], len(ROWS)),
        (["1"], 2),
        (["4/flat"], 3),
        (["4/flat", "4"], 15),
        (["8/aeros/clean_table/0.90"], 1),
    ],
)
def test_a_name_given_twice_is_chosen_once(names: list[str], count: int) -> None:
    assert sum(len(one.rows) for one in select_rows(EXPERIMENTS, names)) == count


@pytest.mark.parametrize("name", ["", "0", "4/flaat", "4/fla", "list"])
def test_unknown_names_are_refused(name: str) -> None:
    with pytest.raises(MisuseError, match=f"there is no experiment `{name}`"):
        select_rows(EXPERIMENTS, [name])


def test_an_experiment_for_one_plant_alone_names_it() -> None:
    assert 9 in catalogue("physics")
    with pytest.raises(MisuseError, match="it is tried with `--plant physics`"):
        select_rows(EXPERIMENTS, ["9/knife"])


def test_crossed_conditions_make_a_row_each() -> None:
    rows = catalogue("physics")[9].rows
    layers = [row.id.rpartition("/")[2] for row in rows if row.variant == "knife"]
    assert layers == ["open", "gate", "both"]
    knife = next(row for row in rows if row.id == "9/knife/gate")
    assert knife.condition.settings["layer"] == "gate"
    assert "def cut(" in knife.condition.settings["module"]["skills.py"]


def test_an_entered_architecture_takes_part_where_architectures_are_compared() -> None:
    entry = EnteredArchitecture("tests.unit.experiments.support.entered:Stubborn")
    entered = catalogue("symbolic", [entry])
    more = {n: len(entered[n].rows) - len(one.rows) for n, one in EXPERIMENTS.items()}
    assert {n: count for n, count in more.items() if count} == {4: 3, 8: 27, 13: 9, 16: 12, 17: 9}
    row = next(row for row in entered[8].rows if row.variant == "Stubborn")
    assert row.condition.settings["source"]
    assert row.labels[0] == entry.architecture


def test_a_second_architecture_of_one_name_is_refused() -> None:
    for entries in (
        [EnteredArchitecture("here:Mine"), EnteredArchitecture("there:Mine")],
        [EnteredArchitecture("here:flat")],
    ):
        with pytest.raises(MisuseError, match=r"is called `(Mine|flat)`, too"):
            catalogue("symbolic", entries)
