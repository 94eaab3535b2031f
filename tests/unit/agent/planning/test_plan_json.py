"""Plans as JSON: what is written is read as it was, and what has another form is refused with its place."""

from __future__ import annotations

import json
from typing import Any

import pytest

from aeros.agent.planning.plan_json import MalformedPlanError, parse_strict_json, plan_from_json, plan_to_json
from aeros.agent.planning.task_graph import PLAN_SPAN, PlanStep, TaskGraph
from aeros.spec.model.step_graph import MAX_DEPTH, MAX_STEPS, If, Seq
from tests.unit.agent.dumplings import site, term

WHERE = "wrapper_aligned and area == pot"
GRAPH = TaskGraph(
    (
        PlanStep("dumpling", "prepare"),
        PlanStep("dumpling", "wrap", unless=term(f"{WHERE} or not wrapper_aligned")),
        Seq(
            (
                PlanStep(
                    "dumpling",
                    "boil",
                    {"force": 0.1},
                    retry=2,
                    between_tries=PlanStep("dumpling", "recover"),
                    on_failure=PlanStep("other", "call"),
                ),
            )
        ),
        If(term(WHERE), WHERE, Seq((PlanStep("dumpling", "wrap"),)), Seq(()), PLAN_SPAN),
        If(term(WHERE), WHERE, Seq(()), None, PLAN_SPAN),
    )
)


def test_written_values_are_read_unchanged() -> None:
    assert plan_from_json(parse_strict_json(json.dumps(plan_to_json(GRAPH))), site()) == GRAPH


def nested(levels: int) -> list[Any]:
    return [{"seq": nested(levels - 1)}] if levels else []


STEP = {"skill": "dumpling.prepare"}


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ({}, "`plan` is not a list of steps"),
        (["prepare"], "`plan[0]` is not an object"),
        ([STEP, {"skill": "prepare"}], "`plan[1].skill` is not of the form MODULE.SKILL"),
        ([{"skill": 7}], "`plan[0].skill` is not a text of at most"),
        ([{"skill": "x." * 2000}], "`plan[0].skill` is not a text of at most"),
        ([STEP | {"run": "import os"}], '`plan[0]` has a key that no plan has: "run"'),
        ([STEP | {"inputs": []}], "`plan[0].inputs` is not an object"),
        ([STEP | {"retry": True}], "`plan[0].retry` is not a whole number"),
        ([STEP | {"retry": 1.0}], "`plan[0].retry` is not a whole number"),
        ([STEP | {"on_failure": ["recover"]}], "`plan[0].on_failure` is not a text"),
        ([STEP | {"unless": True}], "`plan[0].unless` is not a text"),
        ([STEP | {"unless": "fill_level"}], "`plan[0].unless` is not a condition"),
        ([{"if": "wrapper_aligned", "then": [7]}], "`plan[0].then[0]` is not an object"),
        ([{"if": "wrapper_aligned"}], "`plan[0].then` is not a list of steps"),
        ([{"if": "fill_level", "then": []}], "`plan[0].if` is not a condition"),
        ([{"if": "previously wrapper_aligned", "then": []}], "`plan[0].if` is not a condition"),
        ([{"if": "__import__('os')", "then": []}], "`plan[0].if` is not a condition"),
        ([{"if": "(" * 1900, "then": []}], "`plan[0].if` is not a condition"),
        ([{"if": "wrapper_aligned", "then": [], "do": []}], "`plan[0]` has a key that no plan has"),
        (nested(MAX_DEPTH + 2), f"is nested more than {MAX_DEPTH} deep"),
        ([STEP] * (2 * MAX_STEPS + 1), f"it has more than {2 * MAX_STEPS} parts"),
    ],
)
def test_another_form_is_refused_with_its_place(form: Any, message: str) -> None:
    with pytest.raises(MalformedPlanError) as refusal:
        plan_from_json(form, site())
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it is not JSON"),
        ('{"plan": [', "it is not JSON"),
        ("[" * 100_000, "it is not JSON"),
        (b"\xff\xfe", "it is not JSON"),
        ('{"a": 1, "a": 2}', "an object has a key twice"),
        ('{"a": NaN}', "NaN is not a number"),
        ('{"a": -Infinity}', "-Infinity is not a number"),
    ],
)
def test_text_that_is_no_json_is_refused(text: str | bytes, message: str) -> None:
    with pytest.raises(MalformedPlanError, match=message):
        parse_strict_json(text)
