"""Every path of outcomes through a composition, and what is known at each point of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.flow import symbolic_paths
from aeros.spec.flow.symbolic_paths import (
    PathExploration,
    SymbolicState,
    SymbolicStates,
    TooManyPathsError,
    earlier_measurements,
    explore_paths,
    fold_constants,
    split_conjunction,
)
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq
from tests.differential.planning.number_loops import STATE as NUMBERS
from tests.unit.agent.dumplings import STATE, outcome, skill, term

TEXT = Source("text", "x" * 100)
WRAPPED, COOKED, ALIGNED = "dumpling_wrapped", "dumpling_cooked", "wrapper_aligned"
FULL = "fill_level > 0.5"
SKILLS: Mapping[str, Skill] = {
    one.id: one
    for one in (
        skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("torn", {ALIGNED: True}, failure=True)),
        skill("boil", outcome("cooked", {COOKED: True})),
        skill("align", outcome("aligned", {ALIGNED: False})),
        skill("look", outcome("seen", {}), Outcome("never", {COOKED: True}, False, Fraction(0), None)),
        skill("hold", outcome("held", {COOKED: True}), hold=WRAPPED),
        skill("fill", outcome("filled", {"fill_level": Fraction(1)})),
    )
}


def step(
    name: str, retry: int = 0, between: str | None = None, run: str | None = None, last: str | None = None
) -> Step:
    return Step(name, run or name, {}, {}, retry, between, last, TEXT.span(0, 1))


def choice(text: str, then: Part, otherwise: Part | None = None, at: int = 5) -> If[Step]:
    return If(term(text), text, then, otherwise, TEXT.span(at, at + 1))


def par(*branches: Part) -> Par[Step]:
    return Par(branches, TEXT.span(9, 10))


def either(*parts: Part) -> Fallback[Step]:
    return Fallback(parts, TEXT.span(8, 9))


def explored(body: Part, precondition: str = "true", **handlers: Step) -> PathExploration:
    composition = Composition("c", term(precondition), None, body, handlers, TEXT.span(0, 1))
    return explore_paths(composition, SKILLS, STATE)


def known(states: SymbolicStates) -> dict[str, tuple[str, ...]]:
    """Of each situation what is set and assumed, with the trace that leads to it."""
    return {_format_state(one): trace for one, trace in states.items()}


def _format_state(state: SymbolicState) -> str:
    assigned = sorted(f"{name}={value}" for name, value in state.assignment)
    return ", ".join([*assigned, *sorted(map(str, state.path_condition))])


def test_a_step_leads_to_its_successes_and_not_to_what_is_declared_impossible() -> None:
    assert known(explored(step("wrap")).final_states) == {f"{WRAPPED}=True": ("wrap → wrapped",)}
    assert known(explored(step("look")).final_states) == {"": ("look → seen",)}


def test_a_sequence_goes_on_with_what_the_steps_before_have_set() -> None:
    paths = explored(Seq((step("boil"), step("wrap"))))
    assert known(paths.states_at_steps["boil"]) == {"": ()}
    assert known(paths.states_at_steps["wrap"]) == {f"{COOKED}=True": ("boil → cooked",)}
    assert known(paths.final_states) == {
        f"{COOKED}=True, {WRAPPED}=True": ("boil → cooked", "wrap → wrapped")
    }
    assert known(explored(Seq(())).final_states) == {"": ()}


def test_a_further_try_begins_with_what_the_failure_has_set() -> None:
    paths = explored(step("wrap", 2))
    assert known(paths.states_at_steps["wrap"]) == {"": (), f"{ALIGNED}=True": ("wrap → torn",)}
    assert known(paths.final_states) == {
        f"{WRAPPED}=True": ("wrap → wrapped",),
        f"{WRAPPED}=True, {ALIGNED}=True": ("wrap → torn", "wrap → wrapped"),
    }


def test_a_handler_runs_between_two_tries_and_not_after_the_last() -> None:
    paths = explored(step("wrap", 1, "h"), h=step("h", run="align"))
    assert known(paths.states_at_steps["handler/h"]) == {f"{ALIGNED}=True": ("wrap → torn",)}
    assert known(paths.states_at_steps["wrap"]) == {
        "": (),
        f"{ALIGNED}=False": ("wrap → torn", "h → aligned"),
    }
    assert "handler/h" not in explored(step("wrap", 0, "h"), h=step("h", run="align")).states_at_steps


def test_each_way_out_of_a_condition_knows_how_it_was_decided() -> None:
    decided = choice(WRAPPED, step("boil"), step("align"))
    paths = explored(decided)
    condition = term(WRAPPED)
    assert known(paths.states_at_ifs[id(decided)]) == {"": ()}
    assert list(paths.states_at_steps["boil"]) == [SymbolicState(path_condition=frozenset({condition}))]
    assert list(paths.states_at_steps["align"]) == [
        SymbolicState(path_condition=frozenset({t.Not(condition)}))
    ]
    assert {next(iter(one.assignment)) for one in paths.final_states} == {(COOKED, True), (ALIGNED, False)}


def test_a_condition_that_is_decided_has_one_way_out() -> None:
    paths = explored(Seq((step("boil"), choice(COOKED, step("wrap"), step("align")))))
    assert (len(paths.states_at_steps["wrap"]), paths.states_at_steps["align"]) == (1, {})
    paths = explored(Seq((step("align"), choice(ALIGNED, step("wrap"), step("boil")))))
    assert (paths.states_at_steps["wrap"], len(paths.states_at_steps["boil"])) == ({}, 1)


def test_without_else_only_the_way_in_is_followed() -> None:
    paths = explored(choice(WRAPPED, step("boil")))
    assert list(paths.final_states.values()) == [("boil → cooked",)]


def test_the_precondition_holds_at_the_start_part_by_part() -> None:
    paths = explored(step("boil"), f"{WRAPPED} and not {ALIGNED}")
    (start,) = paths.states_at_steps["boil"]
    assert start.path_condition == {term(WRAPPED), term(f"not {ALIGNED}")}


def test_a_measurement_is_known_for_the_next_step_alone_and_then_by_another_name() -> None:
    paths = explored(choice(FULL, Seq((step("boil"), step("wrap"), choice(FULL, step("align"), Seq(()), 7)))))
    (first,), (second,) = paths.states_at_steps["boil"], paths.states_at_steps["wrap"]
    assert first.path_condition == {term(FULL)}
    assert {name for one in second.path_condition for name in t.variables_of(one)} == {"fill_level@1"}
    (last,) = paths.states_at_steps["align"]
    assert {name for one in last.path_condition for name in t.variables_of(one)} == {
        "fill_level@1",
        "fill_level",
    }
    assert {
        frozenset(name for one in state.path_condition for name in t.variables_of(one))
        for state in paths.final_states
    } == {frozenset({"fill_level@1", "fill_level@2"}), frozenset({"fill_level@1", "fill_level"})}


def test_a_measurement_that_is_set_is_forgotten_and_a_predicate_is_not() -> None:
    paths = explored(Seq((step("fill"), step("boil"))))
    assert known(paths.states_at_steps["boil"]) == {"fill_level=1": ("fill → filled",)}
    assert known(paths.final_states) == {f"{COOKED}=True": ("fill → filled", "boil → cooked")}


def _pours() -> Skill:
    half_full = QuantityRange("fill_level", None, Fraction(1, 4), Fraction(1, 2))
    full = QuantityRange("fill_level", None, Fraction(3, 4), Fraction(1))
    little = replace(outcome("little", {}, failure=True), ranges=(half_full,))
    return skill("pour", replace(outcome("poured", {}), ranges=(full,)), little)


def test_a_range_that_an_outcome_states_is_known_for_the_next_step_alone() -> None:
    skills = {**SKILLS, "pour": _pours()}
    body = Seq((step("pour"), step("boil"), step("wrap")))
    paths = explore_paths(Composition("c", t.TRUE, None, body, {}, TEXT.span(0, 1)), skills, STATE)
    (full,), (later,) = paths.states_at_steps["boil"], paths.states_at_steps["wrap"]
    assert full.known == {term("0.75 <= fill_level and fill_level <= 1")}
    assert later == SymbolicState(frozenset({(COOKED, True)}))


def test_a_range_stays_with_what_was_decided_on_and_does_not_multiply_tries() -> None:
    skills = {**SKILLS, "pour": _pours()}
    body = Seq((step("pour", retry=9), choice(FULL, step("boil"), step("align")), step("wrap")))
    paths = explore_paths(Composition("c", t.TRUE, None, body, {}, TEXT.span(0, 1)), skills, STATE)
    assert len(paths.states_at_steps["pour"]) == 2  # at first, and after any number of failures
    full, impossible = sorted(paths.states_at_steps["wrap"], key=lambda one: str(one.assignment))[::-1]
    for state in (full, impossible):
        assert len(state.path_condition) == 2
        assert {name for one in state.path_condition for name in t.variables_of(one)} == {"fill_level@1"}


def test_in_parallel_branches_a_range_is_not_known() -> None:
    skills = {**SKILLS, "pour": _pours()}
    body = par(Seq((step("pour"), step("boil"))), step("align"))
    paths = explore_paths(Composition("c", t.TRUE, None, body, {}, TEXT.span(0, 1)), skills, STATE)
    assert [state.known for state in paths.states_at_steps["boil"]] == [frozenset()]


def test_branches_begin_alike_and_end_with_what_all_have_set() -> None:
    paths = explored(par(step("boil"), Seq((step("wrap"), step("look")))))
    assert known(paths.states_at_steps["boil"]) == known(paths.states_at_steps["wrap"]) == {"": ()}
    assert known(paths.states_at_steps["look"]) == {f"{WRAPPED}=True": ("wrap → wrapped",)}
    assert list(known(paths.final_states)) == [f"{COOKED}=True, {WRAPPED}=True"]


def test_in_parallel_branches_a_measurement_is_not_known_at_once() -> None:
    paths = explored(Seq((choice(FULL, par(choice(FULL, step("boil"), at=7), step("wrap"))), step("look"))))
    for name in ("boil", "wrap"):
        (state,) = paths.states_at_steps[name]
        assert all("@" in read for one in state.path_condition for read in t.variables_of(one))
    # After the branches a measurement counts again.
    after = explored(Seq((par(step("boil"), step("wrap")), choice(FULL, step("look")))))
    assert term(FULL) in next(iter(after.states_at_steps["look"])).path_condition


def test_a_lost_hold_condition_leaves_a_count_that_it_reads_at_any_value() -> None:
    held = ActionCondition(NUMBERS["count"].variable, "", TEXT.span(0, 1))
    pour = replace(skill("pour", outcome("poured", {COOKED: True})), hold_condition=held)
    skills = {"add": skill("add", outcome("added", {"count": Fraction(1)})), "pour": pour}
    body = Seq((step("add"), step("pour", 1)))
    composition = Composition("c", t.TRUE, None, body, {}, TEXT.span(0, 1))
    tried = known(explore_paths(composition, skills, NUMBERS).states_at_steps["pour"])
    assert tried == {
        "count=1": ("add → added",),
        "": ("add → added", "pour → unheld"),
        f"{COOKED}=True": ("add → added", "pour → unheld"),
    }


def test_a_lost_hold_condition_is_a_failure_with_every_value_that_may_be_left() -> None:
    paths = explored(Seq((step("wrap"), step("hold", 1))))
    tried = known(paths.states_at_steps["hold"])
    assert tried[f"{WRAPPED}=True"] == ("wrap → wrapped",)
    assert tried[f"{WRAPPED}=False"] == ("wrap → wrapped", "hold → unheld")
    assert tried[f"{COOKED}=True, {WRAPPED}=False"] == ("wrap → wrapped", "hold → unheld")


def test_as_many_situations_are_explored_as_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    body = Seq((step("wrap", 1), step("boil")))  # two situations before each
    monkeypatch.setattr(symbolic_paths, "MAX_SYMBOLIC_STATES", 4)
    assert explored(body).final_states
    monkeypatch.setattr(symbolic_paths, "MAX_SYMBOLIC_STATES", 3)
    with pytest.raises(TooManyPathsError):
        explored(body)


def test_a_condition_is_reported_about_the_start() -> None:
    state = SymbolicState(frozenset({(WRAPPED, True), ("area", "pot")}))
    assert state.condition(term(f"{WRAPPED} and area == pot"), STATE) == t.TRUE
    assert state.condition(term(f"{COOKED} and {WRAPPED}"), STATE) == t.And((term(COOKED), t.TRUE))
    assert SymbolicState().condition(term(COOKED), STATE) == term(COOKED)


def test_earlier_measurements_are_declared_as_they_are_measured() -> None:
    old = t.Variable("fill_level@2", STATE["fill_level"].variable.type, t.VariableRole.STATE)
    terms = (t.Compare("<", old, STATE["fill_level"].variable), t.Compare("<", old, old))
    (found,) = earlier_measurements(terms, STATE)
    assert (found.variable, found.range) == (old, STATE["fill_level"].range)
    assert earlier_measurements([term(FULL)], STATE) == ()


def test_a_term_without_variables_is_its_value() -> None:
    assert fold_constants(t.Or((t.FALSE, t.Not(t.FALSE)))) == t.TRUE
    assert fold_constants(t.And((t.TRUE, t.FALSE))) == t.FALSE
    half = t.And((t.TRUE, term(WRAPPED)))
    assert fold_constants(half) is half


def test_a_conjunction_is_split_and_true_is_dropped() -> None:
    assert split_conjunction(t.And((term(WRAPPED), t.TRUE, term(COOKED)))) == {term(WRAPPED), term(COOKED)}
    assert split_conjunction(t.Or((t.TRUE, t.FALSE))) == {t.Or((t.TRUE, t.FALSE))}
    assert split_conjunction(t.TRUE) == frozenset()


def test_an_alternative_begins_where_the_one_before_has_failed() -> None:
    paths = explored(either(step("wrap"), step("align"), step("boil")))
    (start,) = paths.states_at_steps["align"]
    assert dict(start.assignment) == {ALIGNED: True}
    assert "boil" not in paths.states_at_steps or not paths.states_at_steps["boil"]
    ends = {frozenset(dict(one.assignment).items()) for one in paths.final_states}
    assert ends == {frozenset({(WRAPPED, True)}), frozenset({(ALIGNED, False)})}


def test_a_check_that_is_not_met_leads_to_the_next_alternative() -> None:
    check: Part = choice(COOKED, Seq(()), FailingPart(COOKED, TEXT.span(5, 6)))
    paths = explored(either(check, step("boil")))
    (start,) = paths.states_at_steps["boil"]
    assert start.path_condition == {t.Not(term(COOKED))}
    assert {one.path_condition for one in paths.final_states} == {
        frozenset({term(COOKED)}),
        frozenset({t.Not(term(COOKED))}),
    }


def test_each_try_of_a_part_begins_where_the_last_one_has_failed() -> None:
    part: Part = Seq((step("align"), step("wrap")))
    paths = explored(RetriedPart(part, 3, TEXT.span(8, 9)))
    assert {frozenset(one.assignment) for one in paths.states_at_steps["align"]} == {
        frozenset(),
        frozenset({(ALIGNED, True)}),
    }


def test_effects_of_other_branches_are_forgotten_after_one_has_failed() -> None:
    both = par(step("wrap"), step("boil"))
    paths = explored(either(both, step("look")), f"not {COOKED}")
    (start,) = paths.states_at_steps["look"]
    assert dict(start.assignment) == {
        ALIGNED: True
    }  # `boil` may have been stopped before or after its effect
    assert {name for one in start.path_condition for name in t.variables_of(one)} == {f"{COOKED}@1"}
