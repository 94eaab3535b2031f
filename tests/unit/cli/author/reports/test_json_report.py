from __future__ import annotations

import copy
import json
from dataclasses import replace
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from aeros.cli.author.reports.json_report import as_json
from aeros.cli.author.schema import report_schema
from tests.unit.cli.author.reports.results import RUNS, result_of

VALIDATOR = Draft202012Validator(report_schema())


def test_the_published_schema_is_a_schema() -> None:
    Draft202012Validator.check_schema(report_schema())


@pytest.mark.parametrize("run", RUNS)
def test_the_report_is_as_published(run: str) -> None:
    report = json.loads(as_json(result_of(run)))
    assert [error.message for error in VALIDATOR.iter_errors(report)] == []


def test_outcomes_without_which_tasks_are_proved_are_named() -> None:
    result = result_of("accepted")
    modules = tuple(replace(one, left_out=("look.gone",)) for one in result.report.modules)
    report = json.loads(as_json(replace(result, report=replace(result.report, modules=modules))))
    assert {tuple(one["left_out"]) for one in report["modules"]} == {("look.gone",)}
    assert VALIDATOR.is_valid(report)


def test_the_runs_show_every_conclusion_and_verdict() -> None:
    reports = [json.loads(as_json(result_of(run))) for run in RUNS]
    subjects = [one for report in reports for one in (report["site"], *report["modules"])]
    assert {one["conclusion"] for one in subjects} == {"proved", "rejected", "undecided"}
    verdicts = [one for subject in subjects for one in subject["obligations"]]
    assert {one["verdict"] for one in verdicts} == {"PROVED", "REFUTED", "VACUOUS", "UNKNOWN"}
    assert {one["guarded"] for one in verdicts} == {True, False}
    assert any(report["certificates"] for report in reports)


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of every mapping in `value`."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    here = [path] if isinstance(value, dict) else []
    return here + [place for key, item in items for place in _places(item, (*path, key))]


def _at(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


def test_a_field_too_many_or_too_few_is_not_as_published() -> None:
    report = json.loads(as_json(result_of("rejected")))
    report["site"]["obligations"] = report["site"]["obligations"][:2]
    places = _places(report)
    assert len(places) > 20
    for place in places:
        more = copy.deepcopy(report)
        _at(more, place)["unheard_of"] = 1
        assert not VALIDATOR.is_valid(more), place
        for name in _at(report, place).keys() - {"witness", "boundary", "configuration"}:
            less = copy.deepcopy(report)
            del _at(less, place)[name]
            assert not VALIDATOR.is_valid(less), (place, name)


@pytest.mark.parametrize("run", RUNS)
def test_every_subject_and_every_diagnostic_is_in_the_report(run: str) -> None:
    result = result_of(run)
    report = json.loads(as_json(result))
    subjects = [
        report["site"],
        *report["modules"],
        *([report["configuration"]] if "configuration" in report else []),
    ]
    assert [one["name"] for one in subjects] == [subject.name for subject in result.subjects]
    codes = [found["code"] for one in subjects for found in one["diagnostics"]]
    codes += [found["code"] for found in report["certificates"]]
    assert codes == [problem.diagnostic.code for problem in result.problems]


def test_a_guarded_claim_that_is_not_refuted_is_not_as_published() -> None:
    report = json.loads(as_json(result_of("accepted")))
    guarded = next(one for one in report["modules"][-1]["obligations"] if one["guarded"])
    guarded["verdict"] = "PROVED"
    assert not VALIDATOR.is_valid(report)
