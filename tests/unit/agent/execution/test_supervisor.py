from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.execution.dispatcher import Dispatch, Dispatcher, DispatchError
from aeros.agent.execution.supervisor import StepAssessment, assess_step, start_obstacle
from aeros.agent.identity import Identity
from aeros.agent.memory.store import open_memory
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading, StepResult, StepStatus
from aeros.spec.model.cause import Cause
from tests.unit.agent.dumplings import DUMPLING, PREDICATES, STATE, outcome, skill
from tests.unit.agent.fake_runtime import FakeRuntime

FINISHED = StepResult(StepStatus.FINISHED, "")
BOIL = DUMPLING.skills["boil"]
WRAP = DUMPLING.skills["wrap"]


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in values.items()}, 0.0)


def test_success_is_preferred_to_an_outcome_without_effects() -> None:
    assert assess_step("dumpling", BOIL, FINISHED, world(dumpling_cooked=True)) == StepAssessment(
        "cooked", False, False, ""
    )


@pytest.mark.parametrize("measured", [{"dumpling_cooked": False}, {}])
def test_nothing_changed_is_what_remains(measured: dict[str, bool]) -> None:
    judged = assess_step("dumpling", BOIL, FINISHED, world(**measured))
    assert (judged.outcome, judged.failed, judged.is_undeclared) == ("nothing_changed", True, False)


def test_the_outcome_that_says_most_is_preferred() -> None:
    both = skill(
        "both",
        outcome("some", {"wrapper_aligned": True}),
        outcome("more", {"wrapper_aligned": True, "dumpling_wrapped": False}, failure=True),
    )
    assert (
        assess_step("dumpling", both, FINISHED, world(wrapper_aligned=True, dumpling_wrapped=False)).outcome
        == "more"
    )
    assert (
        assess_step("dumpling", both, FINISHED, world(wrapper_aligned=True, dumpling_wrapped=True)).outcome
        == "some"
    )


DROP = skill(
    "carry",
    outcome("carried", {}),
    outcome("dropped", {"wrapper_aligned": False, "dumpling_wrapped": False}, failure=True),
    outcome("soaked", {"area": "pot"}),
)


def test_unknown_values_make_no_success_of_a_step_that_may_have_failed() -> None:
    judged = assess_step("dumpling", DROP, FINISHED, world(wrapper_aligned=False))
    assert (judged.outcome, judged.failed, judged.is_undeclared) == (None, True, False)
    assert judged.reason == "outcome `dropped` cannot be excluded: `dumpling_wrapped` is not measured"
    (cause,) = judged.causes
    assert (cause.kind, cause.rule) == ("unknown-outcome", "dumpling.carry")
    assert [str(one) for one in cause.shortfalls] == ["`dumpling_wrapped` is not measured"]
    assert assess_step("dumpling", DROP, FINISHED, world(dumpling_wrapped=False, area="pot")).failed


@pytest.mark.parametrize("measured", [{"wrapper_aligned": True}, {"dumpling_wrapped": True, "area": "pot"}])
def test_a_failure_that_one_measured_value_excludes_is_no_doubt(measured: dict[str, Any]) -> None:
    assert not assess_step("dumpling", DROP, FINISHED, world(**measured)).failed


def test_a_halted_step_gives_both_reasons() -> None:
    reason = assess_step("dumpling", DROP, StepResult(StepStatus.STOPPED, "as scripted"), world()).reason
    assert reason.startswith("stopped: as scripted; outcome `dropped` cannot be excluded")


def test_among_equals_success_is_preferred() -> None:
    tied = skill(
        "tied",
        outcome("bad", {"wrapper_aligned": True}, failure=True),
        outcome("good", {"dumpling_wrapped": True}),
    )
    assert (
        assess_step("dumpling", tied, FINISHED, world(wrapper_aligned=True, dumpling_wrapped=True)).outcome
        == "good"
    )


def test_a_state_that_excludes_every_declared_outcome_is_undeclared_and_failed() -> None:
    judged = assess_step("dumpling", WRAP, FINISHED, world(wrapper_aligned=True, dumpling_wrapped=False))
    assert (judged.outcome, judged.failed, judged.is_undeclared) == (None, True, True)
    (cause,) = judged.causes
    assert cause.kind == "undeclared-outcome"
    assert [(one.quantity, one.value, one.required_op, one.bound) for one in cause.shortfalls] == [
        ("dumpling_wrapped", False, "`wrapped` declares", True),
        ("wrapper_aligned", True, "`misaligned` declares", False),
    ]


@pytest.mark.parametrize("measured", [{}, {"dumpling_wrapped": False}])
def test_an_outcome_that_is_not_known_is_a_failure_and_breaks_no_assumption(
    measured: dict[str, bool],
) -> None:
    judged = assess_step("dumpling", WRAP, FINISHED, world(**measured))
    assert (judged.outcome, judged.failed, judged.is_undeclared) == (None, True, False)
    assert judged.is_unknown
    assert [one.kind for one in judged.causes] == ["unknown-outcome"]


def test_a_declared_failure_after_a_caught_denial_has_both_causes() -> None:
    rule = Cause("rule", "fence", "too near", code="AE750")
    ended = StepResult(StepStatus.FINISHED, "", denied=1, causes=(rule,))
    judged = assess_step("dumpling", WRAP, ended, world(wrapper_aligned=False, dumpling_wrapped=False))
    assert judged.outcome == "misaligned"
    assert [one.kind for one in judged.causes] == ["outcome", "rule"]
    assert assess_step("dumpling", WRAP, ended, world(dumpling_wrapped=True)).causes == ()


@pytest.mark.parametrize("status", [one for one in StepStatus if one is not StepStatus.FINISHED])
def test_a_step_that_did_not_finish_has_failed_for_every_measurement(status: StepStatus) -> None:
    judged = assess_step("dumpling", WRAP, StepResult(status, ""), world(dumpling_wrapped=True))
    assert judged.failed
    assert judged.reason
    assert judged.outcome == (None if status is StepStatus.REFUSED else "wrapped")
    assert not judged.is_undeclared


def test_a_precondition_must_be_measured_as_true() -> None:
    ready = dict.fromkeys(("dough_on_workspace", "filling_on_workspace", "wrapper_aligned"), True)
    assert start_obstacle("dumpling", WRAP, world(**ready), {}) is None
    false = start_obstacle("dumpling", WRAP, world(**ready | {"wrapper_aligned": False}), {})
    assert false is not None
    assert (false.kind, false.rule) == ("precondition", "dumpling.wrap")
    assert [(one.quantity, one.value, one.bound) for one in false.shortfalls] == [
        ("wrapper_aligned", False, True)
    ]
    unknown = start_obstacle("dumpling", WRAP, world(dough_on_workspace=False, wrapper_aligned=True), {})
    assert unknown is not None
    assert [str(one) for one in unknown.shortfalls] == [
        "dough_on_workspace is false",
        "`filling_on_workspace` is not measured",
    ]
    assert start_obstacle("dumpling", DUMPLING.skills["prepare"], world(), {}) is None


@pytest.mark.parametrize(
    ("module", "name", "inputs", "why"),
    [
        ("pizza", "bake", {}, "the module `pizza` is not active"),
        ("dumpling", "bake", {}, "has no skill `bake`"),
        ("dumpling", "boil", {"salt": 1.0}, "`salt` is not an input of it"),
        ("dumpling", "boil", {"force": 2.0}, "outside 0 … 1"),
    ],
)
def test_a_step_that_does_not_fit_now_is_not_dispatched(
    tmp_path: Path, module: str, name: str, inputs: dict[str, Any], why: str
) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        dispatcher = Dispatcher(FakeRuntime(), memory, "dumpling.make_dumplings")
        with pytest.raises(DispatchError, match=why):
            dispatcher.dispatch(module, name, inputs, world(dumpling_wrapped=True))
        fitting = dispatcher.dispatch("dumpling", "boil", {"force": 0.25}, world(dumpling_wrapped=True))
        assert isinstance(fitting, Dispatch)
        assert fitting.request.inputs == {"force": 0.25}


HOLDING = skill(
    "carry",
    outcome("carried", {"dumpling_wrapped": True, "dumpling_cooked": True}),
    hold="wrapper_aligned",
)
BEFORE = dict.fromkeys(PREDICATES, False) | {"wrapper_aligned": True}


@pytest.mark.parametrize(
    ("after", "undeclared"),
    [
        (BEFORE, False),
        (BEFORE | {"wrapper_aligned": False}, False),
        # Half of what the outcome declares: nothing is proved of that.
        (BEFORE | {"dumpling_wrapped": True}, True),
    ],
)
def test_a_broken_hold_condition_is_provided_for_as_it_began_and_half_way_breaks_an_assumption(
    after: dict[str, bool], *, undeclared: bool
) -> None:
    result = StepResult(StepStatus.HOLD_LOST, "it slipped")
    judged = assess_step("dumpling", HOLDING, result, world(**after), BEFORE)
    assert (judged.outcome, judged.failed, judged.is_undeclared) == (None, True, undeclared)


def test_a_success_that_is_measured_when_the_hold_condition_broke_has_failed_all_the_same() -> None:
    after = BEFORE | {"dumpling_wrapped": True, "dumpling_cooked": True}
    judged = assess_step(
        "dumpling", HOLDING, StepResult(StepStatus.HOLD_LOST, "it slipped"), world(**after), BEFORE
    )
    assert (judged.outcome, judged.failed, judged.is_undeclared) == ("carried", True, False)


def test_a_verdict_has_measured_values_and_only_a_skill_that_ended_by_itself_has_one() -> None:
    lost = outcome("lost", {"dumpling_wrapped": False}, failure=True)
    lost = replace(lost, verdict="not here: wrapped is {dumpling_wrapped}, cooked is {dumpling_cooked}")
    boil = skill("boil", outcome("cooked", {"dumpling_cooked": True}), lost)
    found = assess_step("dumpling", boil, FINISHED, world(dumpling_wrapped=False))
    assert (found.is_verdict, found.reason) == (True, "not here: wrapped is false, cooked is unknown")
    stopped = StepResult(StepStatus.STOPPED, "contact")
    found = assess_step("dumpling", boil, stopped, world(dumpling_wrapped=False))
    assert (found.is_verdict, found.reason) == (False, "stopped: contact")
