"""State variables of a loop: the values of each, at the start and after outcomes that do not decide them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop import loop_variables
from aeros.spec.closed_loop.loop_variables import (
    LoopVariables,
    StateSpaceError,
    bound_inputs,
    conditions_of,
    recoveries_of,
    skills_of,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.expr.lower import lower
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill, Task, TaskInvariant
from aeros.spec.model.hold_conditions import HOLD_LOST, STOPPED
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.step_graph import HeldPart, If
from tests.differential.planning.number_loops import STATE
from tests.differential.planning.number_loops import term as number_term
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import FORCE, PREDICATES, SPAN, module, outcome, rule, site, skill, task, term
from tests.unit.spec.consequences import places

HALF, FULL = Fraction(1, 2), Fraction(1)
LEFT_HALF = QuantityRange("fill_level", None, Fraction(0), HALF)
FILL = skill("fill", Outcome("filled", {"fill_level": FULL}, False, None, None))
POUR = skill(
    "pour",
    Outcome("poured", {}, False, None, None, ranges=(LEFT_HALF,)),
    Outcome("spilt", {PREDICATES[0]: True}, True, None, None),
)


def variables(goal: str, *skills: Skill, initial: dict[str, Any] | None = None) -> LoopVariables:
    rules = [rule(goal, one.id) for one in skills]
    pursued = replace(task("fill", ("fill",), goal, *rules), initial=initial or {})
    return LoopVariables(module("kitchen", skills, pursued), pursued, replace(site(), state=STATE))


def test_values_are_listed_and_quantities_have_cells_at_every_number_that_is_stated() -> None:
    found = variables(
        "fill_level >= 0.75 and area == pot", FILL, POUR, initial={"fill_level": Fraction(1, 4)}
    )
    quarters = {Fraction(number, 4) for number in range(5)}
    assert found.breakpoints["fill_level"] == quarters
    assert set(found.values["fill_level"]) >= quarters
    assert found.values["area"] == ("table", "pot")
    assert list(found.variables) == sorted(found.variables)


def test_a_start_has_the_values_that_are_stated_and_all_of_others() -> None:
    found = variables("fill_level > 0.5 and dumpling_cooked", FILL, initial={"fill_level": HALF})
    assert found.starts({"fill_level": HALF}) == {"fill_level": (HALF,), "dumpling_cooked": (False, True)}


@pytest.mark.parametrize("end", [HOLD_LOST, STOPPED])
def test_a_halted_run_leaves_a_count_that_its_condition_reads_at_any_value(end: str) -> None:
    counting = skill("add", Outcome("added", {"count": Increment(FULL)}, False, None, None))
    found = variables("fill_level >= 0.5", counting)
    held = ActionCondition(t.And((STATE["count"].variable,)), "", SPAN)
    halted = Outcome(end, {}, True, Fraction(0), None)
    assert found.after(replace(counting, hold_condition=held), halted).opened == {
        "count": found.values["count"]
    }
    both = t.And((STATE["count"].variable, STATE["fill_level"].variable))
    opened = found.after(replace(counting, hold_condition=replace(held, term=both)), halted).opened
    assert opened == {name: found.values[name] for name in ("count", "fill_level")}
    set_before = replace(halted, effects={"count": FULL})
    assert found.after(replace(counting, hold_condition=held), set_before).opened == {}
    assert found.after(counting, halted).opened == {}


def test_a_run_leaves_a_quantity_that_it_moves_anywhere_unless_the_outcome_states_it() -> None:
    drive = places.asking("go", outcome("gone", {}), outcome("exact", {"base": FULL}))
    pursued = replace(
        task("go", ("go",), PREDICATES[0], rule(PREDICATES[0], "go")), goal=places.term("base > 1")
    )
    bounded = replace(places.STATE["base"], range=(Fraction(0), Fraction(2)))
    place = replace(places.site(), state={**places.STATE, **STATE, "base": bounded})
    found = LoopVariables(module("m", (drive,), pursued), pursued, place)
    assert found.after(drive, drive.outcomes["gone"]).opened == {"base": found.values["base"]}
    assert found.after(drive, drive.outcomes["exact"]).opened == {}


def test_a_vector_counts_as_the_components_that_are_read() -> None:
    found = variables("tool.z > 100 mm", FILL)
    assert list(found.variables) == ["fill_level", "tool.z"]
    assert found.declared["tool.z"].name == "tool"
    assert found.format("tool.z", Fraction(1, 10)) == "tool.z = 0.1"


def test_an_outcome_leaves_a_quantity_where_it_states_and_else_as_it_was() -> None:
    found = variables("fill_level > 0.25", FILL, POUR)
    poured, spilt = POUR.outcomes.values()
    inside = found.after(POUR, poured).opened["fill_level"]
    assert inside == tuple(one for one in found.values["fill_level"] if one <= HALF)
    assert found.after(FILL, FILL.outcomes["filled"]).opened == {}
    # Of what measures it, nothing is known here, so a perceiver is assumed, and nothing moves that.
    assert found.after(POUR, spilt).opened == {}


@pytest.mark.parametrize(
    ("goal", "limit", "message"),
    [
        ("fill_level > joint[j1]", {}, "`fill_level` is compared with `joint\\[j1\\]`"),
        ("fill_level > 0.5", {"MAX_CELLS": 3}, "`fill_level` is compared with more than 1 numbers"),
    ],
)
def test_an_infinite_variable_is_refused(
    goal: str, limit: dict[str, int], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in limit.items():
        monkeypatch.setattr(loop_variables, name, value)
    with pytest.raises(StateSpaceError, match=f"^{message}$"):
        variables(goal, FILL)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("fill_level", "it depends on `fill_level`, which has no range"),
        ("count", "it depends on `count`, which is a whole number without a range"),
    ],
)
def test_a_number_without_a_range_is_refused(name: str, message: str) -> None:
    pursued = task("fill", ("fill",), "dumpling_cooked", rule("dumpling_cooked", "fill"))
    pursued = replace(pursued, goal=number_term(f"{name} > 0"))
    unbounded = {**STATE, name: replace(STATE[name], range=None)}
    with pytest.raises(StateSpaceError, match=f"^{message}$"):
        LoopVariables(module("kitchen", (FILL,), pursued), pursued, replace(site(), state=unbounded))


@pytest.mark.parametrize(("low", "high"), [(-2, 1), (0, 0), (2, 4)])
def test_a_whole_number_has_each_value_of_its_range(low: int, high: int) -> None:
    pursued = replace(task("fill", ("fill",), "dumpling_cooked"), goal=number_term("count > 2"))
    ranged = {**STATE, "count": replace(STATE["count"], range=(Fraction(low), Fraction(high)))}
    made = LoopVariables(module("kitchen", (), pursued), pursued, replace(site(), state=ranged))
    assert made.values["count"] == tuple(range(low, high + 1))


def test_as_many_values_as_allowed_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop_variables, "MAX_NUMBERS", 5)
    monkeypatch.setattr(loop_variables, "MAX_CELLS", 5)
    pursued = replace(task("fill", ("fill",), "dumpling_cooked"), goal=number_term("count > 2"))
    made = LoopVariables(module("kitchen", (), pursued), pursued, replace(site(), state=STATE))
    assert made.values["count"] == (0, 1, 2, 3, 4)
    monkeypatch.setattr(loop_variables, "MAX_NUMBERS", 4)
    with pytest.raises(StateSpaceError, match=r"^`count` has more than 4 values$"):
        LoopVariables(module("kitchen", (), pursued), pursued, replace(site(), state=STATE))
    assert len(variables("fill_level > 0.5", FILL).values["fill_level"]) == 4


def test_conditions_have_the_inputs_of_each_step() -> None:
    forced = skill("force", inputs={"force": FORCE}, precondition="inputs.force > 0.4")
    rules = (replace(rule("dumpling_cooked", "force"), inputs={"force": HALF}),)
    pursued: Task = task("press", ("press",), "dumpling_cooked", *rules)
    *_, precondition = conditions_of(module("kitchen", (forced,), pursued), pursued)
    assert lower(precondition) == t.TRUE
    assert bound_inputs(forced, {}) == {"inputs.force": FORCE.default_value}


def test_skills_of_a_loop_are_those_of_its_steps_and_recoveries() -> None:
    handled = rule("dumpling_cooked", "fill", 1, "pour", "fill")
    pursued = task("cook", ("cook",), "dumpling_cooked", handled)
    assert recoveries_of(handled) == ("pour", "fill")
    assert [one.id for one in skills_of(module("kitchen", (FILL, POUR), pursued), pursued)] == [
        "fill",
        "pour",
    ]


# A task whose steps are a composition and a skill, with everything that a loop reads.

_PREDICATES = PREDICATES[:4]
FIRST, SECOND, THIRD, FOURTH = (term(name) for name in _PREDICATES)


def _step(name: str, *choices: str) -> Step:
    return Step(name, name, {"force": HALF}, {}, 0, None, None, SPAN, choices)


def _composed() -> tuple[Ecm, Task]:
    held = ActionCondition(SECOND, "", SPAN, (Conjunct(SECOND, SPAN),))
    choice = If(
        FIRST,
        PREDICATES[0],
        _step("fill"),
        HeldPart(_step("either", "pour", "press"), SPAN, True, held),
        SPAN,
    )
    press = skill("press", inputs={"force": FORCE}, precondition=f"inputs.force > 0.4 and {PREDICATES[3]}")
    skills = (FILL, POUR, press, skill("cure"), skill("help", precondition=PREDICATES[4]))
    cooking = replace(rule(PREDICATES[0], "cooking", 1, "helping"), inputs={})
    pressing = replace(rule(PREDICATES[1], "press", 1, None, "press"), inputs={"force": Fraction(1, 4)})
    pursued = task("cook", ("cook",), PREDICATES[2], cooking, pressing)
    pursued = replace(pursued, invariants=(TaskInvariant("kept", FOURTH, "", SPAN),))
    made = Composition("made", THIRD, SPAN, choice, {"cure": _step("cure")}, SPAN)
    ecm = replace(
        module("kitchen", skills, pursued),
        compositions={"made": made},
        capabilities={"cooking": ("made",), "helping": ("help", "cure")},
    )
    return ecm, pursued


def test_a_loop_reads_every_condition_of_its_task_and_of_what_it_may_run() -> None:
    found = list(conditions_of(*_composed()))
    assert found[:7] == [THIRD, FIRST, SECOND, FOURTH, FIRST, SECOND, THIRD]
    # Of `press` in the composition, of `help`, of `press` as a step, and of `press` as a recovery.
    as_texts = [sorted(t.variables_of(one)) for one in found[7:]]
    assert as_texts == [[PREDICATES[3]], [PREDICATES[4]], [PREDICATES[3]], [PREDICATES[3]]]
    values = [is_true(one, dict.fromkeys(PREDICATES, True)) for one in found[7:]]
    assert values == [True, True, False, True]


def test_a_loop_runs_the_skills_of_compositions_their_handlers_and_its_recoveries() -> None:
    names = [one.id for one in skills_of(*_composed())]
    assert names == ["cure", "fill", "help", "pour", "press"]


def test_numbers_of_a_vector_are_those_of_its_components() -> None:
    stated = {"tool": (HALF, Fraction(0), Fraction(1, 4))}
    found = variables("tool.z > 100 mm and joint[j2] < 1", initial=stated)
    assert {"tool.z", "joint[j2]"} <= found.variables.keys()
    assert Fraction(1, 4) in found.breakpoints["tool.z"]
    assert found.declared["joint[j2]"].name == "joint"
    starts = found.starts({"tool": (Fraction(0), Fraction(0), Fraction(1, 5))})
    assert starts["tool.z"] == (Fraction(1, 5),)
    assert starts["joint[j2]"] == found.values["joint[j2]"]


def test_parts_of_variables_of_a_module_have_the_declaration_of_the_whole() -> None:
    declared = {
        "m.tool": dumplings.state("m.tool", VectorType(LENGTH), (Fraction(-1), Fraction(1))),
        "m.arm": dumplings.state("m.arm", STATE["joint"].variable.type, (Fraction(-3), Fraction(3))),
    }
    scope = Scope({name: one.variable for name, one in declared.items()}, enums={"joints": dumplings.JOINTS})
    goal = check(parse("m.tool.z > 100 mm and m.arm[j2] < 0"), scope, BOOL)
    pursued = replace(task("fill", ("fill",), PREDICATES[0]), goal=goal)
    found = LoopVariables(module("m", (), pursued), pursued, replace(site(), state=declared))
    assert {name: one.name for name, one in found.declared.items()} == {
        "m.arm[j2]": "m.arm",
        "m.tool.z": "m.tool",
    }


def test_values_are_written_as_in_a_manifest() -> None:
    found = variables("fill_level > 0.5 and dumpling_cooked and area == pot")
    assert found.format("fill_level", HALF) == "fill_level = 0.5"
    assert found.format("dumpling_cooked", True) == "dumpling_cooked = true"
    assert found.format("area", "pot") == "area = pot"


def _defined(text: str) -> LoopVariables:
    """Variables of a loop with this definition of a predicate that one of its skills sets."""
    goal = f"{PREDICATES[0]} and fill_level > 0.5 and joint[j1] > 0"
    pursued = task("fill", ("fill",), goal, rule(goal, "pour"))
    definitions = {PREDICATES[0]: Definition(term(text), text, SPAN)}
    ecm = replace(module("kitchen", (POUR,), pursued), definitions=definitions)
    return LoopVariables(ecm, pursued, replace(site(), state=STATE))


def test_a_definition_with_cells_decides_what_an_outcome_leaves_open() -> None:
    found = _defined("fill_level > 0.25")
    assert found.facts.conditions == {PREDICATES[0]: term("fill_level > 0.25")}
    assert Fraction(1, 4) in found.breakpoints["fill_level"]
    values = found.after(POUR, POUR.outcomes["spilt"])
    assert values.opened == {"fill_level": found.values["fill_level"]}
    (agrees,) = values.constraints
    assert t.variables_of(agrees).keys() == {"fill_level"}


@pytest.mark.parametrize("text", ["fill_level > joint[j1]", "joint[j2] > 0"])
def test_a_definition_without_cells_or_of_what_the_loop_does_not_read_decides_nothing(text: str) -> None:
    found = _defined(text)
    assert found.facts.conditions == {}
    assert found.after(POUR, POUR.outcomes["spilt"]).constraints == ()
