"""The causal chain of a run, from its end back to what was measured; of a log that holds anything."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.apps.why.causal_chain import CausalExplanation, CausalLink, RunLog, StepTrace
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, causes_to_json
from tests.hypothesis_profiles import examples
from tests.unit.apps.why.run_events import DENIED, FAILED, GRIP, NEAR, SKILL, STARTED, WHY, Events, note


def run_log(events: Events) -> RunLog:
    """The events as they are read from a log."""
    return RunLog([{"event": event, "details": json.loads(json.dumps(details))} for event, details in events])


def message(links: Iterable[CausalLink]) -> list[str]:
    return [link.text for link in links]


@pytest.mark.parametrize(
    ("events", "headline", "message", "changes"),
    [
        (
            [note("plan-rejected", planner="llm", problems=["`fly` is no skill"]), FAILED],
            "tidy.clean: the goal was not reached (`clean`; clean is unknown)",
            ["`wipe` was denied", "the plan of `llm` was rejected"],
            [],
        ),
        (
            [
                note("step-not-started", skill="tidy.wipe", reason="no", causes=causes_to_json([
                    Cause("precondition", "tidy.wipe", "cloth_held", "", "", (
                        UnmetBound("cloth_held", False, "exactly", True),
                        UnmetBound("dirt", None, "known", True, reason="is not measured"),
                    )),
                ])),
                FAILED,
            ],
            "tidy.clean: the goal was not reached (`clean`; clean is unknown)",
            ["`wipe` was denied", "tidy.wipe was not started: no"],
            [
                "cloth_held is false; true required by `tidy.wipe`",
                "`dirt` is not measured; `tidy.wipe` needs it measured",
            ],
        ),
        ([note("task-not-found", reason="no installed module provides “fly”")],
         "no installed module provides “fly”", ["no installed module provides “fly”"], []),
        ([note("not-routed", reason="no installed module provides “fly”")],  # its old name
         "no installed module provides “fly”", ["no installed module provides “fly”"], []),
        (DENIED[:3], "the record does not say how the run ended: it goes on, or was killed",
         ["tidy.wipe ended as denied: AE750", "the gate denied it"],
         ["human_distance is 0.41 m; at least 0.5 m required by `separation`"]),
        ([], "the record does not say how the run ended: it goes on, or was killed", [], []),
        ([("log-began", {}), ("checkpoint", {"closing": False})],
         "the record does not say how the run ended: it goes on, or was killed", [], []),
        ([("log-began", {}), ("checkpoint", {"closing": True})],
         "the record was closed before the run ended: no end of its task is in it", [], []),
        ([note("run-ended", task="tidy.clean", reached=True)], "tidy.clean: goal reached", [], []),
    ],
)  # fmt: skip
def test_each_way_to_end_is_explained(
    events: Events, headline: str, message: list[str], changes: list[str]
) -> None:
    found = run_log(events).explain_end()
    assert found.headline == headline
    assert [link.text for link in found.chain] == message
    assert list(found.changes) == changes


def test_a_disagreement_of_the_gates_is_what_halted_the_robot() -> None:
    outcomes = {
        "compiled": {"verdict": "ALLOW", "reasons": []},
        "z3": {"verdict": "DENY", "reasons": [["AE742", "rate", "too often"]]},
    }
    halt = ("gate-disagreement", {**SKILL, "asked": GRIP, **outcomes})
    interrupted = note("run-interrupted", reason="a fault of AEROS")
    for events in ([STARTED, halt], [STARTED, halt, interrupted]):
        found = run_log(events).explain_end()
        assert (
            found.headline == "the robot was halted: the compiled gate and Z3 decided an action differently"
        )
        (link,) = found.chain
        assert (link.record, link.text) == (1, "tidy.wipe asked for `grip`")
        assert list(map(str, link.causes)) == ["compiled: ALLOW", "z3: DENY", "rate: too often"]
    ended = run_log([STARTED, halt, FAILED]).explain_end()  # by a later run that went on with the log
    assert ended.headline.startswith("tidy.clean: the goal was not reached")


def test_a_step_cancelled_in_parallel_is_not_why_the_plan_failed() -> None:
    beside = note("step-ended", skill="tidy.rest", status="cancelled", failed=True, reason="beside it")
    found = run_log([note("step-started", skill="tidy.rest"), *DENIED, beside, FAILED]).explain_end()
    assert found.chain[1].text == "step 2, tidy.wipe: denied"
    assert [step.number for step in found.failed] == [1, 2]


def test_each_link_names_its_record_and_a_cause_stands_where_it_was_found() -> None:
    found = run_log([*DENIED, FAILED]).explain_end()
    assert [link.record for link in found.chain] == [4, 3, 2, 1]
    assert [link.causes for link in found.chain] == [(), (), (), (NEAR,)]
    assert found.changes == ("human_distance is 0.41 m; at least 0.5 m required by `separation`",)


def test_a_denial_without_causes_has_its_reasons() -> None:
    reasons = [["AE742", "rate", "too often"], ["AE1", "short"], "no list"]
    denial = ("decision", {**SKILL, "verdict": "DENY", "reasons": reasons})
    ended = ("step-ended", {**SKILL, "status": "denied", "reason": "AE742"})
    reported = note("step-ended", skill="tidy.wipe", status="denied", failed=True, reason="denied")
    found = run_log([STARTED, denial, ended, reported, FAILED]).explain_end()
    assert message(found.chain)[1:] == [
        "step 1, tidy.wipe: denied",
        "runtime status: ended as denied: AE742",
        "the gate denied `an action`",
    ]
    assert found.chain[-1].causes == (Cause("gate", "rate", "too often", code="AE742"),)


def test_a_denial_before_the_last_decision_did_not_end_the_step() -> None:
    allowed = ("decision", {**SKILL, "verdict": "ALLOW", "asked": GRIP})
    found = run_log([*DENIED[:2], allowed, *DENIED[2:], FAILED]).explain_end()
    assert [link.record for link in found.chain] == [5, 4, 3]
    assert found.chain[-1].causes == (NEAR,)


def test_a_denial_that_the_skill_caught_is_named_if_its_step_failed() -> None:
    denial = (
        "decision",
        {**SKILL, "verdict": "DENY", "asked": GRIP, "reasons": [["AE742", "rate", "often"]]},
    )
    allowed = ("decision", {**SKILL, "verdict": "ALLOW", "asked": GRIP})
    ended = ("step-ended", {**SKILL, "status": "finished", "reason": ""})
    reported = note("step-ended", skill="tidy.wipe", status="finished", outcome="missed", failed=True)
    began = ("step-began", SKILL)
    found = run_log([STARTED, began, denial, allowed, ended, reported, FAILED]).explain_end()
    assert message(found.chain)[-1] == "the gate denied `grip`, and the skill went on"
    assert found.chain[-1].causes == (Cause("gate", "rate", "often", code="AE742"),)
    once_more = run_log([STARTED, denial, began, allowed, ended, reported, FAILED]).explain_end()
    assert message(once_more.chain)[-1] == "runtime status: ended as finished", (
        "the denial was of an earlier step"
    )


def test_a_step_of_a_capability_says_why_its_skill_was_chosen() -> None:
    options = [
        {
            "skill": "wipe",
            "record": {"successes": 2, "failures": 5},
            "expected_seconds": 91.25,
            "why_not": "",
        },
        {"skill": "mops.sweep", "record": {"successes": 0, "failures": 0}, "why_not": "it was denied"},
        "no option",
    ]
    chosen = {"capability": "tidy.cleaning", "skill": "tidy.wipe", "reason": "explores", "options": options}
    log = run_log([note("provider-selected", **chosen), *DENIED])
    *_, choice = log.explain_step(log.steps[0]).chain
    assert (choice.record, choice.text) == (0, "tidy.wipe was chosen for `tidy.cleaning`: explores")
    assert [str(cause) for cause in choice.causes] == [
        "wipe: 2 successes and 5 failures in this context, 91.2 s expected until success",
        "mops.sweep: 0 successes and 0 failures in this context, not now: it was denied",
    ]
    other = run_log([note("provider-selected", **{**chosen, "skill": "tidy.dry"}), *DENIED])
    assert not any("chosen" in link.text for link in other.explain_step(other.steps[0]).chain)


def test_a_step_that_ended_otherwise_has_the_runtimes_word() -> None:
    stopped = ("step-ended", {**SKILL, "status": "timed_out", "reason": "60 s are over"})
    reported = note(
        "step-ended", skill="tidy.wipe", status="timed_out", failed=True, reason="too slow", **WHY
    )
    found = run_log([STARTED, stopped, reported, FAILED]).explain_end()
    assert message(found.chain)[1:] == [
        "step 1, tidy.wipe: too slow",
        "runtime status: ended as timed out: 60 s are over",
    ]
    assert found.chain[1].causes == (NEAR,)


def test_a_step_that_succeeded_is_explained_by_its_outcome_alone() -> None:
    ended = ("step-ended", {**SKILL, "status": "finished", "reason": ""})
    reported = note(
        "step-ended", skill="tidy.wipe", status="finished", outcome="wiped", failed=False, reason=""
    )
    run = run_log([STARTED, ended, reported])
    (step,) = run.steps
    assert step == StepTrace(1, "tidy.wipe", 0, 2, False, "")
    found = run.explain_step(step)
    assert found == CausalExplanation(
        "step 1, tidy.wipe, did not fail", (CausalLink(2, "step 1, tidy.wipe: outcome `wiped`"),)
    )


def test_steps_of_the_same_skill_end_in_order_and_one_may_not_end() -> None:
    wiped = note("step-ended", skill="tidy.wipe", failed=False)
    other = note("step-ended", skill="tidy.rest", failed=False)
    run = run_log([STARTED, wiped, STARTED, other])
    first, second = run.steps
    assert (first.end_index, first.failed) == (1, False)
    assert (second.end_index, second.failed) == (None, True)
    assert second.reason == "the log ends before the step ended"
    found = run.explain_step(second)
    assert found.headline == "step 2, tidy.wipe: the log ends before the step ended"
    assert (found.chain, found.failed) == ((), (second,))


def test_a_step_without_a_recorded_failure_counts_as_failed() -> None:
    (step,) = run_log([STARTED, note("step-ended", skill="tidy.wipe")]).steps
    assert step.failed


def test_a_broken_assumption_is_reported_however_the_run_ended() -> None:
    proofs = {"certificate": "ab" * 32, "obligations": ["one", "two"]}
    whole = note("broken-assumption", skill="tidy.wipe", **proofs, **WHY)
    bare = note("broken-assumption", skill="tidy.rest")
    found = run_log([whole, bare]).explain_end().broken_assumptions
    ended = "ended with an undeclared outcome"
    assert found == (
        CausalLink(
            0, f"tidy.wipe {ended}; 2 obligations of certificate abababababab rest on what it does", (NEAR,)
        ),
        CausalLink(1, f"tidy.rest {ended}; what of certificate none rest on what it does"),
    )


@pytest.mark.parametrize(
    ("measured", "shown"),
    [
        ({"clean": True, "at": "pot"}, " (`clean`; clean is true, at is pot)"),
        ({"clean": None, "far": 1.5}, " (`clean`; clean is unknown, far is 1.5)"),
        ({}, " (`clean`; )"),
        ("no object", ""),
    ],
)
def test_the_goal_is_shown_with_what_was_measured(measured: Any, shown: str) -> None:
    ended = note("run-ended", task="tidy.clean", reached=True, goal="clean", measured=measured)
    assert run_log([ended]).explain_end().headline == f"tidy.clean: goal reached{shown}"


def test_the_last_end_counts_and_an_interrupt_has_no_reason() -> None:
    ends = [note("run-ended", task="t", reached=True), note("run-interrupted", task="t")]
    found = run_log(ends).explain_end()
    assert (found.headline, found.chain) == ("run interrupted", (CausalLink(1, "run interrupted"),))
    assert run_log(ends[::-1]).explain_end().headline == "t: goal reached"


def test_an_unfinished_run_ends_with_the_last_step_that_did_not_finish() -> None:
    stopped = ("step-ended", {**SKILL, "status": "stopped", "reason": "a person", **WHY})
    finished = ("step-ended", {**SKILL, "status": "finished"})
    found = run_log([stopped, finished]).explain_end()
    assert found.chain == (CausalLink(0, "tidy.wipe ended as stopped: a person", (NEAR,)),)
    assert run_log([finished]).explain_end().chain == ()


def test_a_rule_that_denies_in_every_state_is_reported() -> None:
    never = Cause("rule", "no-grip", "false", shortfalls=(UnmetBound("", False, "exactly", True),))
    twice = CausalExplanation("end", (CausalLink(0, "a", (never,)), CausalLink(1, "b", (never,))))
    assert twice.changes == ("`no-grip` denies it in every state",)


anything = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
)


names = ("skill", "reason", "causes", "failed", "problems", "measured", "goal", "reached", "status", "asked")


events = st.sampled_from(
    [
        "step-started",
        "step-ended",
        "step-not-started",
        "plan-rejected",
        "broken-assumption",
        "run-ended",
        "task-not-found",
    ]
)


@examples(80)
@given(
    st.lists(
        st.tuples(events, st.booleans(), st.dictionaries(st.sampled_from(names), anything, max_size=6)),
        max_size=8,
    )
)
def test_every_log_is_explained_without_a_traceback(
    listed: list[tuple[str, bool, dict[str, Any]]],
) -> None:
    records = [
        {
            "event": "note" if noted else event,
            "details": {"event": event, "details": reported} if noted else reported,
        }
        for event, noted, reported in listed
    ]
    run = RunLog(records)
    assert run.explain_end().headline is not None
    for step in run.steps:
        assert run.explain_step(step).headline


def test_the_values_behind_a_goal_by_definition_stand_next_to_its_end() -> None:
    part = UnmetBound("tidy.bolts", 38.0, "exactly", 3.0)
    cause = Cause("definition", "tidy.sorted", "bolts == 3", shortfalls=(part,))
    other = note("goal-unmet", task="tidy.other", causes=causes_to_json([cause]))
    unmet = note("goal-unmet", task="tidy.clean", causes=causes_to_json([cause]))
    found = run_log([other, unmet, FAILED]).explain_end()
    assert [(link.record, link.causes) for link in found.chain[1:]] == [(1, (cause,))]
    assert found.changes == ("tidy.bolts is 38; exactly 3 required by `tidy.sorted`",)
    assert run_log([unmet, note("task-selected", task="tidy.clean"), FAILED]).explain_end().changes == ()


def test_a_plan_that_nothing_measured_could_continue_is_part_of_why() -> None:
    cause = Cause(
        "definition", "tidy.heavy", "load >= 2", shortfalls=(UnmetBound("tidy.load", None, "known", True),)
    )
    undecided = note("replan", number=1, reason="undecided", causes=causes_to_json([cause]))
    found = run_log([undecided, note("replan", number=2, reason="a step failed"), FAILED]).explain_end()
    assert [(link.record, link.text) for link in found.chain[1:]] == [(0, "re-plan 1: undecided")]
    assert found.chain[1].causes == (cause,)
    before = run_log([undecided, note("task-selected", task="tidy.clean"), FAILED]).explain_end()
    assert before.chain[1:] == ()


@pytest.mark.parametrize(
    ("true", "headline", "links"),
    [
        (
            False,
            "the robot measured that the goal was reached, and it was not",
            ["in the simulator a = false"],
        ),
        (True, "goal reached", []),
        (None, "goal reached", []),
    ],
)
def test_a_goal_that_was_reached_in_belief_alone_is_not_called_reached(
    true: bool | None, headline: str, links: list[str]
) -> None:
    judged = ("goal-judged", {"believed": True, "true": true, "values": {"a": true}})
    found = run_log([note("run-ended", task="tidy.clean", reached=True), judged]).explain_end()
    assert found.headline.startswith(f"tidy.clean: {headline}")
    assert [one.text for one in found.chain] == links
