"""Each step that was under way at a crash is accounted for by the record's ends and by measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import pytest

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.progress import PlanProgress, UnfinishedAttempt
from aeros.agent.execution.uncertain_steps import UncertainSteps
from aeros.agent.recovery.recover import ProgressRecovery, recorded_steps
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import AuditEvent, LogHead, Reading, StepStatus
from aeros.spec.model.ecm import Skill
from tests.unit.agent.dumplings import STATE, module, outcome, skill

AT = (0,)
LOOK = skill("look", outcome("seen", {}), outcome("not_seen", {}, failure=True))
"""A skill whose outcomes no measurement distinguishes: its end is in the record alone."""

WRAP = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}))


class Notes(Journal):
    """A journal that keeps what it is given, in place of records."""

    def __init__(self) -> None:
        self.accounted: list[str] = []

    def record(self, kind: str, text: str, **details: Any) -> None:
        assert kind == "interrupted-step-resolved"
        self.accounted.append(details["how"])


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in values.items()}, 0.0)


def began(sequence: int, name: str, **inputs: Any) -> AuditEvent:
    return AuditEvent(sequence, "step-began", {"module": "m", "skill": name, "inputs": inputs})


def ended(sequence: int, name: str, status: StepStatus, reason: str = "", **outputs: Any) -> AuditEvent:
    details = {"module": "m", "skill": name, "status": status.value, "reason": reason, "outputs": outputs}
    return AuditEvent(sequence, "step-ended", details)


class Case:
    """A plan of one step, `one`, that was under way when the agent ended after ten records."""

    def __init__(self, one: Skill, measured: WorldModel, before: Mapping[str, Any] | None = None) -> None:
        self.one, self.notes, self.bars = one, Notes(), UncertainSteps()
        self.progress = PlanProgress()
        self.progress.start_attempt(AT, UnfinishedAttempt("m", one.id, {}, before or {}, LogHead(5, "")))
        self.recovery = ProgressRecovery({"m": module("m", (one,))}, measured, self.bars, self.notes)

    def recover(self, *message: AuditEvent, known: int = 10) -> None:
        self.recovery.recover(self.progress, message, known)

    @property
    def accounted(self) -> list[str]:
        return self.notes.accounted


def test_a_step_that_the_record_does_not_know_never_began() -> None:
    case = Case(WRAP, world())
    case.recover()
    assert case.accounted == ["it never began"]
    assert case.progress.attempt_count(AT) == 0
    assert case.progress.unfinished_attempts() == []
    assert case.bars.to_checkpoint == ()


def test_a_begin_record_older_than_the_step_belongs_to_another_step() -> None:
    case = Case(WRAP, world())
    case.recover(began(4, "wrap"))
    assert case.accounted == ["it never began"]


@pytest.mark.parametrize("known", [6, 10])
def test_an_end_in_the_record_is_taken_with_its_outputs(known: int) -> None:
    case = Case(LOOK, world())
    case.recover(began(5, "look"), ended(6, "look", StepStatus.FINISHED, place="left"), known=known)
    last = case.progress.last_result(AT)
    assert last is not None
    assert (last.failed, last.outputs) == (False, {"place": "left"})
    assert case.accounted == ["it had ended: outcome `seen`"]
    assert case.recovery.is_position_known
    assert case.bars.to_checkpoint == ()


def test_a_failure_in_the_record_may_be_tried_again_although_nothing_measures_it() -> None:
    case = Case(LOOK, world())
    case.recover(began(5, "look"), ended(6, "look", StepStatus.RAISED, "the camera is dark"))
    last = case.progress.last_result(AT)
    assert last is not None
    assert last.failed
    assert "the camera is dark" in last.reason
    assert case.accounted[0].startswith("it had ended: ")


@pytest.mark.parametrize("status", [StepStatus.HALTED, StepStatus.CANCELLED])
def test_an_end_that_was_not_its_own_counts_as_an_interruption(status: StepStatus) -> None:
    case = Case(WRAP, world(dumpling_wrapped=True), {"dumpling_wrapped": False})
    case.recover(began(5, "wrap"), ended(6, "wrap", status))
    assert case.accounted == ["it was interrupted, and `wrapped` is measured"]


def test_an_interrupted_step_whose_effect_is_new_has_happened() -> None:
    case = Case(WRAP, world(dumpling_wrapped=True), {"dumpling_wrapped": False})
    case.recover(began(5, "wrap"))
    last = case.progress.last_result(AT)
    assert last is not None
    assert not last.failed
    assert case.accounted == ["it was interrupted, and `wrapped` is measured"]


def test_an_interrupted_step_that_measurably_did_not_succeed_is_tried_again() -> None:
    case = Case(WRAP, world(dumpling_wrapped=False), {"dumpling_wrapped": False})
    case.recover(began(5, "wrap"))
    assert case.progress.attempt_count(AT) == 0
    assert case.accounted == ["it was interrupted, and the measurements exclude its successes"]
    assert case.bars.to_checkpoint != ()


@pytest.mark.parametrize("before", [True, None])
def test_an_interrupted_step_with_an_unknown_outcome_is_barred(before: bool | None) -> None:
    case = Case(WRAP, world(dumpling_wrapped=True), {"dumpling_wrapped": before})
    case.recover(began(5, "wrap"))
    last = case.progress.last_result(AT)
    assert last is not None
    assert last.failed
    assert not last.is_retryable
    assert "do not show if `wrapped` happened" in case.accounted[0]
    assert len(case.bars.to_checkpoint) == 1


def test_an_interrupted_step_that_may_be_run_twice_is_not_barred() -> None:
    case = Case(replace(WRAP, idempotent=True), world(dumpling_wrapped=True), {"dumpling_wrapped": True})
    case.recover(began(5, "wrap"))
    assert case.progress.attempt_count(AT) == 0
    assert case.accounted == ["it was interrupted, and may be repeated"]
    assert case.bars.to_checkpoint == ()


def test_a_step_of_a_module_that_is_gone_has_failed() -> None:
    case = Case(WRAP, world())
    message = AuditEvent(5, "step-began", {"module": "gone", "skill": "wrap", "inputs": {}})
    case.recover(message, began(12, "wrap"))
    # The beginning of another, before the checkpoint, is not that of this step.
    (how,) = case.accounted
    assert how == "it was interrupted, and the measurements do not show if `wrapped` happened"
    later = Case(WRAP, world())
    later.recover(AuditEvent(10, "step-began", {"module": "gone", "skill": "wrap", "inputs": {}}))
    assert later.accounted == ["it never began", "it is no longer active"]


@pytest.mark.parametrize(("sequence", "is_known"), [(9, True), (10, False)])
def test_a_step_later_than_the_checkpoint_ends_the_plan(sequence: int, is_known: bool) -> None:
    case = Case(WRAP, world(dumpling_wrapped=False))
    case.recover(began(5, "wrap"), began(sequence, "wrap"))
    assert case.recovery.is_position_known is is_known


def test_ends_are_matched_with_beginnings_in_order() -> None:
    listed = recorded_steps(
        [
            began(1, "wrap", n=1),
            began(2, "look"),
            began(3, "wrap", n=2),
            AuditEvent(4, "decision", {}),
            ended(5, "wrap", StepStatus.DENIED, "no"),
            ended(6, "other", StepStatus.FINISHED),
            ended(7, "look", StepStatus.FINISHED, found=True),
        ]
    )
    results = [(one.sequence, one.skill, one.inputs, one.result and one.result.status) for one in listed]
    assert results == [
        (1, "wrap", {"n": 1}, StepStatus.DENIED),
        (2, "look", {}, StepStatus.FINISHED),
        (3, "wrap", {"n": 2}, None),
    ]
    assert cast("Any", listed[0].result).reason == "no"
    assert cast("Any", listed[1].result).outputs == {"found": True}
