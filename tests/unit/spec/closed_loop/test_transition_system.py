"""The agent's loop as a transition system: what follows each state."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, Literal

import pytest

from aeros.spec.closed_loop import invocation, transition_system
from aeros.spec.closed_loop.giving_up import FinishedStreak, RunHistory, declared_beliefs
from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.loop_variables import StateSpaceError, skills_of
from aeros.spec.closed_loop.transition_system import LoopState, Transition, TransitionSystem
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Ecm, PlanningRule, Skill, Task, TaskInvariant
from aeros.spec.model.perception import Definition
from aeros.spec.model.step_graph import If, Seq, TimedPart
from tests.unit.agent.dumplings import SPAN, given_input, module, outcome, rule, site, skill, task, term
from tests.unit.spec.consequences.places import DEFINITIONS, asking
from tests.unit.spec.consequences.places import site as places_site
from tests.unit.spec.consequences.places import term as place_term

WRAPPED, COOKED, ALIGNED = "dumpling_wrapped", "dumpling_cooked", "wrapper_aligned"
HALF, QUARTER = Fraction(1, 2), Fraction(1, 4)
WRAP = skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("torn", {}, failure=True))
BOIL = skill("boil", outcome("cooked", {COOKED: True}), precondition=WRAPPED)
STEAM = skill("steam", outcome("cooked", {COOKED: True}), outcome("cold", {ALIGNED: True}, failure=True))
ALIGN = skill("align", outcome("aligned", {ALIGNED: True}))
RULES = (rule(WRAPPED, "wrap", 1, "align"), rule(COOKED, "cooking"))


def kitchen(
    *rules: PlanningRule, skills: tuple[Skill, ...] = (WRAP, BOIL, STEAM, ALIGN), goal: str = COOKED
) -> Ecm:
    made = module("kitchen", skills, task("cook", ("cook",), goal, *rules))
    return replace(made, capabilities={"cooking": ("boil", "steam")})


def system_of(ecm: Ecm, retries: int = 3) -> TransitionSystem:
    return TransitionSystem(ecm, ecm.tasks["cook"], site(retries))


SYSTEM = system_of(kitchen(*RULES))
Phase = Literal["plan", "try", "recover", "reset", "reached", "rejected"]


def at(phase: Phase, true: str = "", rest: tuple[int, ...] = (), tries: int = 0) -> LoopState:
    """The state in which the predicates of these initials are true: cooked, wrapped, aligned."""
    return LoopState(phase, _state(true), rest, tries)


def _state(true: str) -> State:
    return tuple(letter in true for letter in "cwa")


def test_the_predicates_are_those_that_the_loop_depends_on_in_order() -> None:
    assert SYSTEM.names == (COOKED, WRAPPED, ALIGNED)
    assert list(SYSTEM.variables.values.values()) == [(False, True)] * 3
    ecm = kitchen(rule("area == table", "align"), goal="dough_on_workspace")
    system = system_of(ecm)
    assert system.names == ("area", "dough_on_workspace", ALIGNED)
    assert list(system.variables.values.values()) == [("table", "pot"), (False, True), (False, True)]


def test_a_quantity_has_a_value_for_each_cell_and_two_are_not_compared() -> None:
    system = system_of(kitchen(rule("fill_level > 0.5", "align")))
    assert system.variables.values["fill_level"] == (Fraction(1, 4), Fraction(1, 2), Fraction(3, 4))
    with pytest.raises(StateSpaceError, match="`fill_level` is compared with `joint"):
        system_of(kitchen(rule("fill_level > joint[j1]", "align")))


def test_the_loop_s_skills_are_providers_and_recoveries_sorted() -> None:
    ecm = kitchen(*RULES)
    assert [one.id for one in skills_of(ecm, ecm.tasks["cook"])] == ["align", "boil", "steam", "wrap"]
    assert skills_of(ecm, task("none", ("none",), COOKED)) == []


def test_a_condition_is_decided_for_states_of_the_system() -> None:
    condition = SYSTEM.condition(term(f"{WRAPPED} and not {ALIGNED}"))
    assert [condition(_state(true)) for true in ("w", "wa", "", "c")] == [True, False, False, False]


def test_the_plan_is_every_rule_whose_condition_does_not_hold_in_order() -> None:
    assert [SYSTEM.plan(_state(true)) for true in ("", "w", "c", "wc")] == [(0, 1), (1,), (0,), ()]
    mixed = system_of(kitchen(rule(f"{WRAPPED} or {ALIGNED}", "wrap"), rule(COOKED, "steam")))
    assert [mixed.plan(_state(true)) for true in ("", "a", "ac")] == [(0, 1), (1,), ()]


def test_planning_leads_to_the_first_step_to_the_goal_or_nowhere() -> None:
    assert SYSTEM.transitions(at("plan")) == [Transition(at("try", rest=(0, 1)))]
    assert SYSTEM.transitions(at("plan", "c")) == [Transition(at("reached", "c"))]
    strict = system_of(kitchen(*RULES), retries=0)
    assert strict.transitions(at("plan")) == [Transition(at("rejected"))]
    assert strict.transitions(at("plan", "w")) == [Transition(at("try", "w", (1,)))]


@pytest.mark.parametrize("phase", ["reached", "rejected"])
def test_a_loop_that_has_ended_goes_nowhere(phase: Phase) -> None:
    assert SYSTEM.transitions(at(phase)) == SYSTEM.transitions(at(phase, "c")) == []


def test_a_try_succeeds_or_fails_and_is_recovered_from() -> None:
    assert SYSTEM.transitions(at("try", rest=(0, 1))) == [
        Transition(at("try", "w", (1,)), HALF, "step", "wrap → wrapped", "wrap"),
        Transition(at("recover", "", (0, 1), 1), HALF, "step", "wrap → torn", "wrap"),
    ]


def test_the_last_try_that_fails_is_followed_by_a_new_plan() -> None:
    assert SYSTEM.transitions(at("try", rest=(0, 1), tries=1)) == [
        Transition(at("try", "w", (1,)), HALF, "retry", "wrap → wrapped", "wrap"),
        Transition(at("plan"), HALF, "retry", "wrap → torn", "wrap"),
    ]


def test_a_failure_that_makes_the_step_needless_is_followed_by_the_next() -> None:
    odd = skill("wrap", outcome("odd", {ALIGNED: True}, failure=True))
    rules = (rule(f"{WRAPPED} or {ALIGNED}", "wrap"), rule(COOKED, "steam"))
    (move,) = system_of(kitchen(*rules, skills=(odd, STEAM))).transitions(at("try", rest=(0, 1)))
    assert move.target == at("try", "a", (1,))


def test_of_several_providers_those_that_can_start_share_the_probability() -> None:
    both = SYSTEM.transitions(at("try", "w", (1,)))
    assert [(one.choice, one.probability) for one in both] == [
        ("boil", HALF),
        ("steam", QUARTER),
        ("steam", QUARTER),
    ]
    alone = SYSTEM.transitions(at("try", "", (1,)))
    assert [(one.choice, one.probability) for one in alone] == [("steam", HALF), ("steam", HALF)]


def test_a_step_that_no_skill_can_start_is_followed_by_a_new_plan() -> None:
    system = system_of(kitchen(rule(WRAPPED, "wrap"), rule(COOKED, "boil")))
    assert system.transitions(LoopState("try", (False, False), (1,))) == [
        Transition(LoopState("plan", (False, False)))
    ]


def test_a_needless_step_is_left_out_and_after_the_last_a_plan_is_made() -> None:
    assert SYSTEM.transitions(at("try", "w", (0, 1), 1)) == [Transition(at("try", "w", (1,)))]
    assert SYSTEM.transitions(at("recover", "w", (0, 1), 1)) == [Transition(at("try", "w", (1,)))]
    assert SYSTEM.transitions(at("try", "w")) == [Transition(at("plan", "w"))]
    assert SYSTEM.transitions(at("try", "c", (0,))) == [Transition(at("reached", "c"))]


def test_a_recovery_precedes_the_next_try() -> None:
    assert SYSTEM.transitions(at("recover", "", (0, 1), 1)) == [
        Transition(at("try", "a", (0, 1), 1), Fraction(1), "recovery", "align → aligned")
    ]


def test_a_recovery_that_cannot_start_or_is_not_declared_is_skipped() -> None:
    for first in (rule(WRAPPED, "wrap", 1, "boil"), rule(WRAPPED, "wrap", 1)):
        system = system_of(kitchen(first, rule(COOKED, "boil")))
        node = LoopState("recover", (False, False), (0, 1), 1)
        assert system.transitions(node) == [Transition(LoopState("try", (False, False), (0, 1), 1))]


def test_a_step_is_blocked_where_some_provider_cannot_start_at_its_first_try() -> None:
    blocked = SYSTEM.blocked_step(at("try", "", (1,)))
    assert blocked == (RULES[1], "boil")
    for free in (
        at("try", "w", (1,)),
        at("try", "c", (1,)),
        at("try", "", (1,), 1),
        at("try", "", (0, 1)),
        at("try"),
        at("recover", "", (1,)),
        at("plan"),
    ):
        assert SYSTEM.blocked_step(free) is None
    needless = system_of(kitchen(rule(ALIGNED, "boil"), rule(COOKED, "steam")))
    assert needless.blocked_step(at("try", "", (0, 1))) == (rule(ALIGNED, "boil"), "boil")
    assert needless.blocked_step(at("try", "a", (0, 1))) is None


def _rejected(*rules: PlanningRule) -> list[str | None]:
    needy = {"force": given_input("force", None, (Fraction(0), Fraction(1)))}
    press = skill("press", outcome("pressed", {}), inputs=needy)
    system = system_of(kitchen(*rules, skills=(WRAP, BOIL, STEAM, ALIGN, press)))
    return [system.rejection(tuple(range(len(rules)))) for _ in range(2)]


def test_a_plan_is_rejected_for_the_same_reason_each_time() -> None:
    assert _rejected() == ["no rule applies, so the plan is empty"] * 2
    assert _rejected(*[RULES[0]] * 100) == [None, None]
    assert _rejected(*[RULES[0]] * 101) == ["the plan has 101 steps; at most 100 are allowed"] * 2
    assert _rejected(rule(WRAPPED, "wrap", 3)) == [None, None]
    assert (
        _rejected(rule(WRAPPED, "wrap", 4))
        == ["a step has more than the 3 retries that this site allows"] * 2
    )
    assert (
        _rejected(rule(WRAPPED, "wrap", 1, "press"))
        == ["`press` runs with default inputs after a failure, but an input has no default"] * 2
    )


def test_recoveries_that_go_round_are_rejected() -> None:
    round_ = "a failure leads back to itself"
    assert _rejected(rule(COOKED, "cooking", 1, "steam"))[0] == round_
    assert _rejected(rule(COOKED, "boil", 1, "align"), rule(ALIGNED, "align", 1, "boil"))[0] == round_
    assert _rejected(rule(COOKED, "cooking", 1, "align"), rule(WRAPPED, "wrap", 1, "align"))[0] is None


def test_only_the_rules_of_a_plan_can_make_it_rejected() -> None:
    system = system_of(kitchen(rule(WRAPPED, "wrap", 4), rule(COOKED, "steam")))
    assert [system.rejection(plan) for plan in ((0, 1), (1,))] == [
        "a step has more than the 3 retries that this site allows",
        None,
    ]


def test_equal_states_are_equal_and_differ_in_each_part() -> None:
    one = LoopState("try", (True,), (0, 1), 1)
    assert one == LoopState("try", (True,), (0, 1), 1)
    assert hash(one) == hash(LoopState("try", (True,), (0, 1), 1))
    others = [replace(one, phase="recover"), replace(one, state=(False,)), replace(one, tries=0)]
    assert len({one, *others, replace(one, remaining_rules=())}) == 5


def test_the_task_s_predicates_include_those_of_its_invariants() -> None:
    kept = "filling_on_workspace"
    ecm = kitchen(*RULES)
    pursued: Task = replace(ecm.tasks["cook"], invariants=(TaskInvariant("k", term(kept), kept, ecm.span),))
    assert kept in TransitionSystem(ecm, pursued, site()).names


# Systems in which the run may be given up.

CLEAN: dict[str, Any] = {COOKED: False, WRAPPED: False, ALIGNED: False, "fill_level": HALF, "area": "pot"}
NONE = (False, False, False)
BOILING = kitchen(RULES[0], rule(COOKED, "boil"))


def believing(ecm: Ecm, **more: Any) -> TransitionSystem:
    beliefs = replace(declared_beliefs(ecm), **more)
    return TransitionSystem(ecm, ecm.tasks["cook"], site(), beliefs)


def planned(system: TransitionSystem) -> LoopState:
    """The state after the first plan."""
    (move,) = system.transitions(LoopState("plan", system.start(CLEAN)))
    return move.target


def history(node: LoopState) -> RunHistory:
    found = node.state[-1]
    assert isinstance(found, RunHistory)
    return found


def test_the_history_of_a_run_has_its_plan_and_its_failures() -> None:
    system = believing(BOILING)
    first = planned(system)
    assert first == LoopState("try", (*NONE, RunHistory(plan=(0, 1), planned_in=NONE)), (0, 1))
    done, failed = (move.target for move in system.transitions(first))
    assert history(done).failures == frozenset()
    assert failed.phase == "recover"
    assert history(failed).failures == frozenset({(NONE, "wrap", 1)})
    (after,) = system.transitions(failed)
    assert after.target.phase == "try"
    assert history(after.target).failures == history(failed).failures
    last = system.transitions(after.target)[1].target
    assert (last.phase, history(last).plan, history(last).planned_in) == ("plan", (), ())


def test_a_step_that_cannot_start_twice_ends_the_run() -> None:
    system = believing(BOILING)
    state = planned(system).state
    (move,) = system.transitions(LoopState("try", state, (1,)))
    noted = frozenset({(1, NONE)})
    assert move.target == LoopState("plan", (*NONE, RunHistory(not_started=noted)))
    (again,) = system.transitions(move.target)
    (move,) = system.transitions(LoopState("try", again.target.state, (1,)))
    assert history(move.target).gave_up
    (end,) = system.transitions(move.target)
    assert end == Transition(LoopState("given up", move.target.state))
    assert system.transitions(end.target) == []
    reached = LoopState("plan", (True, *move.target.state[1:]))
    assert system.transitions(reached)[0].target.phase == "reached"


def test_a_plan_that_is_carried_out_is_noted() -> None:
    system = believing(BOILING)
    (move,) = system.transitions(LoopState("try", planned(system).state))
    streak = FinishedStreak().with_finish(Fraction(1))
    assert move.target.phase == "plan"
    assert history(move.target) == RunHistory(finished=frozenset({((0, 1), NONE, streak)}))


@pytest.mark.parametrize(
    ("more", "seen"),
    [
        ({}, ("pot", *NONE)),
        ({"hidden": frozenset({WRAPPED})}, ("pot", False, False)),
        ({"in_any_state": True}, ()),
    ],
)
def test_states_differ_for_the_agent_in_what_it_measures_but_quantities(
    more: dict[str, Any], seen: tuple[Any, ...]
) -> None:
    ecm = kitchen(rule("fill_level > 0.9 and area == table", "align"), rule(WRAPPED, "wrap"), RULES[1])
    assert history(planned(believing(ecm, **more))).planned_in == seen


def test_a_skill_in_whose_place_another_may_be_tried_is_not_given_up() -> None:
    def failing(ecm: Ecm, name: str, **more: Any) -> set[tuple[Any, ...]]:
        """Failures that are noted where the step or the recovery of this skill fails."""
        system = believing(ecm, **more)
        rest = planned(system).remaining_rules
        nodes = [LoopState(phase, system.start(CLEAN), rest[-1:], 1) for phase in ("try", "recover")]
        moves = [
            move for node in nodes for move in system.transitions(node) if move.label == f"{name} → cold"
        ]
        assert moves
        return {one for move in moves for one in history(move.target).failures}

    noted = {(NONE, "steam", 1)}
    alone = rule(COOKED, "steam", 1, "align")
    assert failing(kitchen(alone), "steam") == {((False, False), "steam", 1)}
    assert failing(kitchen(RULES[0], RULES[1]), "steam") == set()
    named = {"boil": "steam"}
    assert failing(kitchen(*RULES), "steam", names=named) == noted
    assert failing(kitchen(rule(WRAPPED, "wrap", 1, "steam")), "steam") == noted
    assert failing(kitchen(rule(WRAPPED, "wrap", 1, "cooking")), "steam") == set()


def test_an_agent_that_never_gives_up_has_no_history_and_one_that_does_so_soonest_sees_no_states() -> None:
    system = believing(BOILING)
    never = system.never_giving_up()
    assert planned(never) == LoopState("try", NONE, (0, 1))
    assert planned(never.giving_up_soonest()) == planned(never)
    soonest = system.giving_up_soonest()
    assert history(planned(soonest)) == RunHistory(plan=(0, 1))
    assert [one.task for one in (never, soonest)] == [system.task] * 2


@pytest.mark.parametrize("margin", [Fraction(0), Fraction(1)])
def test_an_if_of_a_composition_may_fail_where_a_margin_makes_its_predicate_unknown(margin: Fraction) -> None:
    one = Step("steam", "steam", {}, {}, 0, None, None, SPAN)
    body = If(term(ALIGNED), ALIGNED, one, one, SPAN)
    text = "fill_level > 0.5"
    ecm = replace(
        kitchen(rule(COOKED, "making"), rule(ALIGNED, "align")),
        compositions={"made": Composition("made", term("true"), None, body, {}, SPAN)},
        capabilities={"making": ("made",)},
        definitions={ALIGNED: Definition(term(text), text, SPAN, margin)},
    )
    system = system_of(ecm)
    state = system.start({COOKED: False, ALIGNED: False})
    failed = [one for one in system.transitions(LoopState("try", state, (0,))) if one.target.state == state]
    assert [one.probability for one in failed] == ([Fraction(0)] if margin else [])


def test_each_outcome_of_a_recovery_that_leaves_a_predicate_open_is_a_case_of_its_own() -> None:
    helping = asking("help", outcome("first", {"holding": True}), outcome("second", {"holding": False}))
    ecm = module("m", (helping, asking("go", outcome("gone", {}, failure=True), kinds=())))
    go = PlanningRule(place_term("m.docked"), "m.docked", "go", {}, 1, "help", None, SPAN)
    arrive = Task("arrive", (), place_term("m.docked and holding"), "", (go,), {}, None, SPAN)
    system = TransitionSystem(replace(ecm, definitions=DEFINITIONS), arrive, places_site())
    state = system.start(dict.fromkeys(system.names, False))
    found = [(one.label, one.case) for one in system.transitions(LoopState("recover", state, (0,), 1))]
    cases = {label: {case for name, case in found if name == label} for label, _ in found}
    assert sorted(map(len, cases.values())) == [1, 1]
    assert len(found) == 4
    assert len(set().union(*cases.values())) == 2


def test_a_composition_is_one_try_with_its_name() -> None:
    def one(name: str) -> Step:
        return Step(name, name, {}, {}, 0, None, None, SPAN)

    both = Composition("both", term(f"not {ALIGNED}"), None, Seq((one("wrap"), one("boil"))), {}, SPAN)
    ecm = replace(
        kitchen(rule(COOKED, "making")), compositions={"both": both}, capabilities={"making": ("both",)}
    )
    system = system_of(ecm)
    done, failed = system.transitions(LoopState("try", NONE, (0,)))
    through = frozenset({(False, True, False), (True, True, False), NONE})
    assert done == Transition(
        *(LoopState("try", (True, True, False), ()), HALF, "step", "both → done", "both"),
        *((Fraction(2), Fraction(0), Fraction(0)), through),
    )
    assert failed == Transition(
        *(LoopState("plan", NONE), HALF, "step", "both → failed", "both"),
        *((Fraction(1), Fraction(0), Fraction(0)), through),
    )
    blocked = system.blocked_step(LoopState("try", (False, False, True), (0,)))
    assert blocked == (ecm.tasks["cook"].rules[0], "both")
    late = TimedPart(both.body, SPAN, True, Fraction(1))
    timed = system_of(replace(ecm, compositions={"both": replace(both, body=late)}))
    moves = timed.transitions(LoopState("try", NONE, (0,)))
    assert {(move.is_open, move.undecided) for move in moves} == {(True, Fraction(1))}
    assert timed.inexact_reason.startswith("a part may be stopped in its midst")


def test_an_outcome_that_leaves_too_much_open_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(invocation, "MAX_UNSETTLED", 1)
    wide = QuantityRange("fill_level", None, Fraction(0), Fraction(1))
    pour = skill("pour", replace(outcome("poured", {}), ranges=(wide,)))
    with pytest.raises(StateSpaceError, match=r"^`pour` leaves 1 variables of it at any value$"):
        system_of(kitchen(rule("fill_level > 0.5", "pour"), skills=(pour,)))


def test_after_the_last_try_the_last_recovery_runs_and_memory_may_come_to_it_sooner() -> None:
    system = system_of(kitchen(rule(WRAPPED, "wrap", 1, None, "align"), RULES[1]))
    reset = at("reset", "", (0,), 2)
    assert system.transitions(at("try", rest=(0, 1), tries=1)) == [
        Transition(at("try", "w", (1,)), HALF, "retry", "wrap → wrapped", "wrap"),
        Transition(reset, HALF, "retry", "wrap → torn", "wrap"),
    ]
    assert system.transitions(at("try", rest=(0, 1))) == [
        Transition(at("try", "w", (1,)), HALF, "step", "wrap → wrapped", "wrap"),
        Transition(at("recover", "", (0, 1), 1), HALF, "step", "wrap → torn", "wrap"),
        Transition(reset, Fraction(0), "step", "wrap → torn", "wrap"),
    ]
    assert system.transitions(reset) == [
        Transition(at("plan", "a"), Fraction(1), "recovery", "align → aligned")
    ]
    # It runs also where the step is not needed any more.
    assert system.transitions(at("reset", "w", (0,), 2)) == [
        Transition(at("plan", "wa"), Fraction(1), "recovery", "align → aligned")
    ]
    assert system.transitions(at("reset", "c", (0,), 2)) == [Transition(at("reached", "c"))]
    stuck = system_of(kitchen(rule(WRAPPED, "boil", 1, None, "align"), RULES[1]))
    assert stuck.transitions(at("try", rest=(0, 1), tries=1)) == [Transition(reset)]
    assert stuck.transitions(at("try", rest=(0, 1))) == [Transition(at("plan"))]


def test_of_several_recoveries_those_that_can_start_share_the_probability() -> None:
    system = system_of(kitchen(rule(WRAPPED, "wrap", 1, "cooking", "cooking"), RULES[1]))
    for node, after in ((at("recover", "w", (1, 0), 1), "try"), (at("reset", "w", (0,), 2), "plan")):
        if node.phase == "recover":
            node = replace(node, state=_state(""), remaining_rules=(0, 1))
        moves = system.transitions(node)
        assert {one.target.phase for one in moves} == {after}
        shares = [(one.choice, one.probability, one.label) for one in moves]
        alone = [("steam", HALF, "steam → cooked"), ("steam", HALF, "steam → cold")]
        both = [("boil", HALF, "boil → cooked"), *((n, QUARTER, label) for n, _, label in alone)]
        assert shares == (alone if node.phase == "recover" else both)


def test_a_verdict_ends_the_plan_where_a_run_may_be_given_up() -> None:
    gone = replace(outcome("gone", {}, failure=True), verdict="it is not there")
    found = skill("wrap", outcome("wrapped", {WRAPPED: True}), gone)
    look = skill("align", outcome("aligned", {ALIGNED: True}), gone)
    ecm = kitchen(*RULES, skills=(found, BOIL, STEAM, look))
    plain = system_of(ecm).transitions(at("try", rest=(0, 1)))
    assert [move.target.phase for move in plain] == ["try", "recover"]
    system = believing(ecm)
    moves = system.transitions(planned(system))
    assert [move.target.phase for move in moves] == ["try", "plan"]
    recovering = LoopState("recover", planned(system).state, (0, 1), 1)
    assert [move.target.phase for move in system.transitions(recovering)] == ["try", "plan"]


def test_tries_beyond_the_limit_end_the_run() -> None:
    system = believing(BOILING, counted_skill="wrap", most_tries=1)
    first = planned(system)
    tried = system.transitions(first)[1].target
    assert history(tried).tries == 1
    again = LoopState("try", tried.state, (0, 1), 1)
    assert system.transitions(again) == [Transition(LoopState("given up", tried.state))]
    helped = believing(kitchen(rule(WRAPPED, "wrap", 1, "align")), counted_skill="align", most_tries=0)
    node = LoopState("recover", planned(helped).state, (0,), 1)
    assert helped.transitions(node) == [Transition(LoopState("given up", node.state))]


def test_a_lost_hold_condition_is_a_failure_wherever_a_skill_of_the_loop_sets_what_it_reads() -> None:
    held = skill("wrap", outcome("wrapped", {WRAPPED: True}), hold=ALIGNED)
    start = LoopState("try", _state("a"), (0, 1))

    def lost_in(system: TransitionSystem) -> set[State]:
        moves = system.transitions(start)
        assert moves[0] == Transition(at("try", "wa", (1,)), Fraction(1), "step", "wrap → wrapped", "wrap")
        assert all(one.probability == 0 for one in moves[1:])
        return {one.target.state for one in moves[1:] if "unheld" in one.label}

    restored = system_of(kitchen(*RULES, skills=(held, BOIL, STEAM, ALIGN)))
    assert lost_in(restored) == {_state(true) for true in ("", "a", "w", "wa")}
    cold = skill("steam", outcome("cooked", {COOKED: True}))
    rules = (rule(WRAPPED, "wrap", 1, "boil"), rule(f"{COOKED} and {ALIGNED}", "steam"))
    alone = system_of(kitchen(*rules, skills=(held, BOIL, cold)))
    assert lost_in(alone) == {_state("a"), _state("wa")}


@pytest.mark.parametrize("verdict", ["", "it is torn"])
def test_a_failed_step_that_is_done_all_the_same_gives_nothing_up_but_after_a_verdict(verdict: str) -> None:
    torn = replace(outcome("torn", {ALIGNED: True}, failure=True), verdict=verdict)
    wrap = skill("wrap", outcome("wrapped", {WRAPPED: True}), torn)
    many = RunHistory(failures=frozenset({(NONE, "wrap", 200)}), verdicts=frozenset({("wrap", "torn")}))

    def failed(unless: str) -> LoopState:
        system = believing(kitchen(rule(unless, "wrap"), RULES[1], skills=(wrap, BOIL, STEAM)))
        return system.transitions(LoopState("try", (*NONE, many), (0, 1)))[1].target

    done, lost = failed(f"{WRAPPED} or {ALIGNED}"), failed(WRAPPED)
    assert (done.phase, done.remaining_rules, lost.phase) == ("try", (1,), "plan")
    assert history(lost).gave_up
    assert history(done).gave_up is bool(verdict)


def test_states_between_which_nothing_decides_are_a_case_of_their_outcome() -> None:
    either: dict[str, bool | None] = {COOKED: None}
    first = replace(outcome("first", {ALIGNED: True}), consequences=either)
    second = replace(outcome("second", {ALIGNED: False}), consequences=either)
    made = skill("wait", first, second, outcome("third", {WRAPPED: True, ALIGNED: True}))
    way = transition_system._SkillWay(invocation.Invocation(made, {}, SYSTEM.names))
    found = [(one.label, one.case) for one in way.moves(NONE, "step")]
    assert found == [
        *[("wait → first", "0")] * 2,
        *[("wait → second", "1")] * 2,
        ("wait → third", ""),
    ]
