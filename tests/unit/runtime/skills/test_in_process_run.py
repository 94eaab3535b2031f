from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, SkillRefusedError
from aeros.runtime.skills.in_process_run import (
    CachedRunFactory,
    InProcessRun,
    SkillRunResult,
    finished_result,
    run_in_process,
)
from aeros.skill import ActionDenied, Inputs, Observation, SkillBody, act
from aeros.spec.model.site import Site

GOOD = """
from __future__ import annotations
from dataclasses import dataclass
from aeros.skill import Inputs, Observation, SkillBody, act

runs = []

@dataclass
class Note:
    text: str

def lift(observed, inputs):
    runs.append(Note("run"))
    yield act("move", count=len(runs))

def not_a_skill(observed, inputs):
    return None
"""


def test_kept_code_is_what_was_certified_and_no_two_runs_share_state(make_ecm: Any, tmp_path: Path) -> None:
    ecm, open_run, site = make_ecm(GOOD), CachedRunFactory(), cast("Site", None)
    lift, trace = ecm.skills["lift"], tmp_path / "executed"
    assert open_run(site, ecm, lift, {}).resume({}, 1.0) == act("move", count=1)
    (Path(ecm.folder) / "skills.py").write_text(f"open({str(trace)!r}, 'w')\n{GOOD}")
    assert open_run(site, ecm, lift, {}).resume({}, 1.0) == act("move", count=1)
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        open_run(site, replace(ecm, code_digest="0" * 64), lift, {})
    assert not trace.exists()


def test_a_run_is_of_the_code_on_the_disk_and_only_if_it_is_certified(make_ecm: Any) -> None:
    ecm, site = make_ecm(GOOD), cast("Site", None)
    assert run_in_process(site, ecm, ecm.skills["lift"], {}).resume({}, 1.0) == act("move", count=1)
    (Path(ecm.folder) / "skills.py").write_text("raise SystemExit")
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        run_in_process(site, ecm, ecm.skills["lift"], {})


# Runs of functions.


def echo(observed: Observation, inputs: Inputs) -> SkillBody:
    while True:
        observed = yield act("say", seen=observed["near"], given=inputs["height"])


def test_each_action_is_asked_for_with_what_is_observed_then() -> None:
    run = InProcessRun(echo, {"height": 0.5})
    assert [run.resume({"near": near}, 1.0) for near in (1, 2, 3)] == [
        act("say", seen=seen, given=0.5) for seen in (1, 2, 3)
    ]
    assert run.close() is None
    assert run.close() is None


def test_a_skill_gets_a_copy_of_its_inputs() -> None:
    def spoil(observed: Observation, inputs: Any) -> SkillBody:
        inputs["height"] = 9.0
        yield act("move")

    given = {"height": 0.5}
    assert InProcessRun(spoil, given).resume({}, 1.0) == act("move")
    assert given == {"height": 0.5}


def test_a_skill_that_ends_is_finished_with_its_outputs() -> None:
    def lift(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        return {"at": [1.0, 2.0]}

    run = InProcessRun(lift, {})
    assert run.resume({}, 1.0) == act("move")
    assert run.resume({}, 1.0) == SkillRunResult(StepStatus.FINISHED, "", {"at": (1.0, 2.0)})
    assert run.close() is None


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (None, SkillRunResult(StepStatus.FINISHED, "")),
        ({}, SkillRunResult(StepStatus.FINISHED, "", {})),
        (
            3,
            SkillRunResult(StepStatus.RAISED, "the skill returned a `int`, not a dict of at most 64 outputs"),
        ),
    ],
)
def test_the_value_that_a_skill_returns_decides_its_ending(value: object, expected: SkillRunResult) -> None:
    assert finished_result(value) == expected


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (ValueError("no"), r"test_in_process_run\.py:\d+: ValueError: no"),
        (SystemExit(3), r"test_in_process_run\.py:\d+: SystemExit: 3"),
        (GeneratorExit(), r"test_in_process_run\.py:\d+: GeneratorExit$"),
        (NoActionError("it is mine"), "it is mine"),
    ],
)
def test_code_that_raises_ends_in_words(failure: BaseException, reason: str) -> None:
    def fail(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        raise failure

    run = InProcessRun(fail, {})
    run.resume({}, 1.0)
    ending = run.resume({}, 1.0)
    assert isinstance(ending, SkillRunResult)
    assert (ending.status, ending.outputs) == (StepStatus.RAISED, None)
    assert re.fullmatch(reason, ending.reason)


def test_a_value_that_is_no_action_ends_the_run() -> None:
    def odd(observed: Observation, inputs: Inputs) -> Any:
        yield "move"

    assert InProcessRun(odd, {}).resume({}, 1.0) == SkillRunResult(
        StepStatus.RAISED, "the skill yielded a `str`, not an action"
    )


def test_the_skills_own_clean_up_runs_and_its_error_is_reported() -> None:
    done: list[str] = []

    def careful(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        finally:
            done.append("cleaned up")
            raise ValueError("stuck")

    run = InProcessRun(careful, {})
    assert run.close() is None
    assert done == []
    run.resume({}, 1.0)
    assert run.close() == "ValueError: stuck"
    assert done == ["cleaned up"]


def test_a_keyboard_interrupt_leaves_a_run() -> None:
    def interrupted(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
            raise KeyboardInterrupt
        except GeneratorExit:
            raise KeyboardInterrupt from None

    run = InProcessRun(interrupted, {})
    run.resume({}, 1.0)
    with pytest.raises(KeyboardInterrupt):
        run.resume({}, 1.0)
    other = InProcessRun(interrupted, {})
    other.resume({}, 1.0)
    with pytest.raises(KeyboardInterrupt):
        other.close()


# Denials.


def test_a_denial_is_raised_where_the_action_was_asked_for() -> None:
    def careful(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        except ActionDenied as denied:
            yield act("say", reason=str(denied), seen=denied.observed["near"])

    run = InProcessRun(careful, {})
    run.resume({"near": 1}, 1.0)
    assert run.resume({"near": 2}, 1.0, "too near") == act("say", reason="too near", seen=2)


def test_a_skill_that_does_not_catch_a_denial_ends_with_it() -> None:
    run = InProcessRun(echo, {"height": 0.5})
    run.resume({"near": 1}, 1.0)
    ending = run.resume({"near": 2}, 1.0, "too near")
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.DENIED
