"""Stops of parts inside the loop are refused where too many states may follow."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.closed_loop.loop_stops import stop_in_loop
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.hold_conditions import STOPPED
from aeros.spec.model.step_graph import HeldPart, Par, Seq, TimedPart
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import SPAN, outcome, skill

NUMBER = dumplings.state("count", IntegerType(), (Fraction(0), Fraction(9)))
FLAGS = {f"flag_{n}": dumplings.state(f"flag_{n}") for n in range(7)}
LARGE = dumplings.state("large", IntegerType(), (Fraction(0), Fraction(64)))
RANGES = {
    f"from {low} to {high}": dumplings.state(
        f"from {low} to {high}", IntegerType(), (Fraction(low), Fraction(high))
    )
    for low, high in ((-31, 32), (-32, 32), (1, 64), (0, 64))
}
STATE = {**dumplings.STATE, "count": NUMBER, "large": LARGE, **FLAGS, **RANGES}
SKILLS = {
    one.id: one
    for one in (
        skill("few", outcome("done", {"flag_0": True})),
        skill("other", outcome("done", {"flag_1": True})),
        skill("many", outcome("done", dict.fromkeys(FLAGS, True))),
        skill("counts", outcome("done", {"count": Fraction(1)})),
        skill("counts_many", outcome("done", {"large": Fraction(1)})),
    )
}


def stop(*names: str, is_parallel: bool = True) -> str:
    steps = tuple(Step(name, name, {}, {}, 0, None, None, SPAN) for name in names)
    inner: Part = Par(steps, SPAN) if is_parallel else Seq(steps)
    part: TimedPart[Step] = TimedPart(inner, SPAN, True, Fraction(1))
    composition = Composition("c", t.TRUE, None, part, {}, SPAN)
    return stop_in_loop(part, composition, SKILLS, STATE, {}).id


def test_a_stop_with_few_states_after_it_is_described() -> None:
    assert stop("few", "other") == STOPPED
    assert stop("few", "counts") == STOPPED


@pytest.mark.parametrize("name", ["many", "counts_many"])
def test_too_many_states_after_a_stop_of_parallel_steps_are_refused(name: str) -> None:
    with pytest.raises(StateSpaceError, match=r"^a part of `c` that may be stopped leaves too much open$"):
        stop("few", name)
    assert stop("few", name, is_parallel=False) == STOPPED


def test_a_number_that_no_skill_sets_does_not_count_among_what_a_stop_leaves_open() -> None:
    held = ActionCondition(LARGE.variable, "", SPAN)
    body = HeldPart(Step("few", "few", {}, {}, 0, None, None, SPAN), SPAN, True, held)
    composition = Composition("c", t.TRUE, None, body, {}, SPAN)
    others = {name: one for name, one in SKILLS.items() if name != "counts_many"}
    assert stop_in_loop(body, composition, others, STATE, {}).id == STOPPED
    with pytest.raises(StateSpaceError, match=r"^a part of `c` that may be stopped leaves too much open$"):
        stop_in_loop(body, composition, SKILLS, STATE, {})


@pytest.mark.parametrize("name", RANGES)
def test_a_number_has_as_many_values_as_whole_numbers_in_its_range(name: str) -> None:
    held = ActionCondition(RANGES[name].variable, "", SPAN)
    body = HeldPart(Step("few", "few", {}, {}, 0, None, None, SPAN), SPAN, True, held)
    composition = Composition("c", t.TRUE, None, body, {}, SPAN)
    skills = {**SKILLS, "sets": skill("sets", outcome("done", {name: Fraction(1)}))}
    if name in ("from -31 to 32", "from 1 to 64"):  # 64 values
        assert stop_in_loop(body, composition, skills, STATE, {}).id == STOPPED
        return
    with pytest.raises(StateSpaceError, match=r"^a part of `c` that may be stopped leaves too much open$"):
        stop_in_loop(body, composition, skills, STATE, {})


def test_a_handler_of_a_parallel_step_is_stopped_too() -> None:
    handled = Step("few", "few", {}, {}, 0, "cure", None, SPAN)
    part: TimedPart[Step] = TimedPart(Par((handled, handled), SPAN), SPAN, True, Fraction(1))
    for name in ("other", "many"):
        cure = Step(name, name, {}, {}, 0, None, None, SPAN)
        composition = Composition("c", t.TRUE, None, part, {"cure": cure}, SPAN)
        if name == "other":
            hold = stop_in_loop(part, composition, SKILLS, STATE, {}).hold_condition
            assert hold is not None
            assert t.variables_of(hold.term).keys() == {"flag_0", "flag_1"}
            continue
        with pytest.raises(StateSpaceError, match=r"leaves too much open$"):
            stop_in_loop(part, composition, SKILLS, STATE, {})
