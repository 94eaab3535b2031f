"""Requests of steps and outputs of skills, checked against what is active and declared."""

from __future__ import annotations

from fractions import Fraction
from math import nan
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.one_step import MakeBench, twice
from tests.unit.runtime.together import MakeCart, asking, move


def test_certified_code_is_run_from_its_folder(make_bench: MakeBench) -> None:
    code = "from aeros.skill import act\ndef lift(_, inputs):\n    yield act('move', h=inputs['height'])\n"
    bench = make_bench(code=code)
    assert bench.submit(StepRequest("handling", "lift", {"height": 0.05})).status is StepStatus.FINISHED
    assert bench.plant.executed == [act("move", h=0.05)]


def test_a_run_is_opened_of_the_skill_under_the_site_with_its_inputs(make_bench: MakeBench) -> None:
    bench, opened = make_bench(twice), list[Any]()
    open_run = bench.executor._open_run

    def noting(*asked: Any) -> Any:
        opened.append(asked)
        return open_run(*asked)

    bench.executor._open_run = noting
    bench.submit(StepRequest("handling", "lift", {"height": 0.05}))
    ecm = bench.executor.active_modules()["handling"]
    inputs = {"height": 0.05, "careful": True, "side": "left"}
    assert opened == [(bench.executor.site, ecm, ecm.skills["lift"], inputs)]


def test_code_that_was_changed_is_refused(make_bench: MakeBench, tmp_path: Path) -> None:
    bench = make_bench(code="def lift(observed, inputs):\n    yield\n")
    (tmp_path / "handling" / "skills.py").write_text("def lift(observed, inputs):\n    yield 1\n")
    result = bench.submit()
    assert result.status is StepStatus.REFUSED
    assert "does not match its certificate" in result.reason


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (StepRequest("absent", "lift", {}), "no module `absent` is active"),
        (StepRequest("handling", "absent", {}), "module `handling` has no skill `absent`"),
        (StepRequest(cast("Any", []), "lift", {}), "module and skill are not both names"),
        (StepRequest("handling", "lift", cast("Any", 3)), "the inputs are not a mapping"),
        (StepRequest("handling", "lift", {"depth": 1.0}), "the skill has no input `depth`"),
        (StepRequest("handling", "lift", {"d" * 150: 1.0}), f"the skill has no input `{'d' * 100}`"),
        (
            StepRequest("handling", "lift", cast("Any", {1: 1})),
            "the skill has no input whose name is not a string",
        ),
        (StepRequest("handling", "lift", {"height": None}), "the input `height` is missing"),
        (StepRequest("handling", "lift", {"height": nan}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": True}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": "1"}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": 0.11}), " is outside its range [0, 0.1]"),
        (StepRequest("handling", "lift", {"height": -1}), " is outside its range [0, 0.1]"),
        (StepRequest("handling", "lift", {"careful": 1}), "the input `careful` is not a truth value"),
        (StepRequest("handling", "lift", {"side": "up"}), "the input `side` is not one of left, right"),
    ],
)
def test_a_bad_request_is_refused_and_recorded(
    make_bench: MakeBench, request_: StepRequest, reason: str
) -> None:
    bench = make_bench(twice)
    result = bench.submit(request_)
    assert result.status is StepStatus.REFUSED
    assert result.reason == reason or (" is outside" in reason and result.reason.endswith(reason))
    assert bench.plant.calls == []
    assert bench.records("step-refused")[0]["details"]["reason"] == result.reason


def test_defaults_are_filled_in_inside_their_range(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.submit(StepRequest("handling", "lift", {"side": "right"}))
    inputs = bench.gate.asked[0][0].inputs
    # The double nearest to 1/10 is above 1/10.
    assert inputs == {"height": 0.09999999999999999, "careful": True, "side": "right"}
    assert Fraction(inputs["height"]) <= Fraction(1, 10)


@pytest.mark.parametrize(
    ("returned", "status", "message"),
    [
        (None, StepStatus.FINISHED, {}),
        ({"amount": 0.5}, StepStatus.FINISHED, {"amount": 0.5}),
        ({"amount": 1}, StepStatus.FINISHED, {"amount": 1.0}),
        ({}, StepStatus.RAISED, "the output `amount` is missing"),
        ({"amount": 1.5}, StepStatus.RAISED, "the output `amount` = 1.5 is outside its range [0, 1]"),
        ({"amount": nan}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": True}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": 0.5, "more": 1}, StepStatus.RAISED, "the skill has no output `more`"),
        ([0.5], StepStatus.RAISED, "the skill returned a `list`"),
        ({1: 0.5}, StepStatus.RAISED, "the skill returned an output whose name is not a string"),
    ],
)
def test_a_skill_gives_the_outputs_that_it_declares(
    cart: MakeCart, returned: Any, status: StepStatus, message: Any
) -> None:
    def giving(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("wait", duration=1.0)
        return returned

    one = cart(look=giving)
    result = one.executor.run_step(StepRequest("cart", "look", {}))
    assert result.status is status
    if status is StepStatus.FINISHED:
        assert result.outputs == message
        assert [end.get("outputs", {}) for end in one.records("step-ended")] == [message]
    else:
        assert message in result.reason
        assert result.outputs == {}


def test_a_resource_that_the_site_does_not_have_is_refused(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.executor._resources.set_capacities({"arm": 1, "camera": 0, "actuator arm": 1})
    refused = one.executor.start(StepRequest("cart", "reach", {}))
    assert refused == StepResult(StepStatus.REFUSED, "this site has no `camera`")
