"""Two actions under way at once: shared actuators, joint rules in either order, and doubtful readings."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import nan
from typing import Any

import pytest

from aeros.runtime.gate import conditions
from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.joint_rules import ActiveAction, JointRules
from aeros.runtime.ports import Reading
from aeros.skill import Action, act
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import RealType
from aeros.spec.model.motion import HeldObject
from tests.unit.runtime.one_joint import governed
from tests.unit.runtime.together import configuration, move, roll

NOW = 100.0
MEASURED: dict[str, Any] = {"charge": 0.5, "hand": 0.0, "stop_pressed": False}


@cache
def compiled() -> JointRules:
    return JointRules(configuration().site, compiled=True)


def active(action: Action, time: Any = NOW, **changed: Any) -> ActiveAction:
    """An action decided on these values; None is not measured."""
    values = {name: value for name, value in {**MEASURED, **changed}.items() if value is not None}
    return ActiveAction(action, {name: Reading(value, time) for name, value in values.items()}, NOW, 7)


def objections(action: ActiveAction, *others: ActiveAction, by: JointRules | None = None) -> list[str]:
    return [f"{reason.code} {reason.rule}" for reason in (by or compiled()).objections(action, others)]


def test_one_action_alone_has_no_objections() -> None:
    assert objections(active(move(5.0))) == []


@pytest.mark.parametrize(
    ("speed", "pace", "broken"),
    [(0.5, 0.5, []), (0.75, 0.5, ["AE751 not-fast-together"]), (0.5, 0.75, ["AE751 not-fast-together"])],
)
def test_a_rule_reads_the_parameters_of_both_in_either_order(
    speed: float, pace: float, broken: list[str]
) -> None:
    moving, rolling = active(move(speed)), active(roll(pace))
    assert objections(moving, rolling) == broken
    assert objections(rolling, moving) == broken
    solver = JointRules(configuration().site, compiled=False)
    assert objections(rolling, moving, by=solver) == broken


def test_an_objection_names_the_action_under_way_and_the_rule() -> None:
    (reason,) = compiled().objections(active(move(1.0)), [active(roll(1.0))])
    assert reason.text == (
        "together with the `roll` under way it breaks `moving.speed + rolling.pace <= 1 m/s`: the cart tips"
    )


def test_state_is_that_of_the_action_that_is_decided_now() -> None:
    assert objections(active(move(), charge=0.1), active(roll())) == ["AE751 charge-for-both"]
    assert objections(active(roll(), charge=0.1), active(move())) == ["AE751 charge-for-both"]
    assert objections(active(roll()), active(move(), charge=0.1)) == []


def test_a_condition_on_state_and_parameter_is_of_both() -> None:
    far = "AE751 hand-near-while-rolling"
    assert objections(active(roll(), hand=1.0), active(move(0.25))) == []
    assert objections(active(roll(), hand=1.25), active(move(0.25))) == [far]
    assert objections(active(roll(), hand=-1.25), active(move(0.25))) == [far]
    assert objections(active(roll(), hand=1.25), active(move(0.0625))) == []


@pytest.mark.parametrize(
    ("values", "time", "found"),
    [
        ({"charge": None}, NOW, ["AE703 charge"]),
        ({"charge": nan}, NOW, ["AE704 charge"]),
        ({"charge": True}, NOW, ["AE704 charge"]),
        ({"charge": 1.5}, NOW, ["AE705 charge"]),
        ({"hand": None}, NOW, ["AE703 hand"]),
        ({}, NOW - 1.0, ["AE706 charge", "AE706 hand"]),
        ({"stop_pressed": None}, NOW, []),
    ],
)
def test_a_missing_malformed_or_stale_reading_that_a_rule_reads_objects(
    values: dict[str, Any], time: float, found: list[str]
) -> None:
    doubtful = active(roll(), time, **values)
    assert sorted(objections(doubtful, active(move()))) == found


def test_two_actions_never_move_one_actuator() -> None:
    lift = active(act("lift", height=1.0))
    (reason,) = compiled().objections(active(move()), [lift])
    assert (reason.code, reason.rule) == ("AE752", "arm")
    assert reason.text == "`arm` is being moved by the `lift` under way"
    assert objections(active(act("wait", duration=1.0)), lift) == []


@pytest.mark.parametrize(("grips", "found"), [("roll", ["AE764"]), ("wait", [])])
def test_nothing_moves_while_something_is_gripped_or_released(grips: str, found: list[str]) -> None:
    site = governed(configuration().site, "move")
    assert site.motion is not None
    box = AxisAlignedBox((Fraction(0),) * 3, (Fraction(1),) * 3)
    held = HeldObject("holding", box, frozenset({grips}))
    rules = JointRules(replace(site, motion=replace(site.motion, held=held)), compiled=True)
    slow, gripping = active(move(0.1)), active(roll(0.1))
    text = "the `{}` under way: what is held may change, and the motion's volume with it"
    moved, gripped = (
        [Reason(code, one, text.format(other)) for code in found]
        for one, other in (("move", "roll"), ("roll", "move"))
    )
    assert list(rules.objections(slow, [gripping])) == moved
    assert list(rules.objections(gripping, [slow])) == gripped
    assert [reason.code for reason in rules.objections(gripping, [])] == []


def test_each_action_under_way_is_compared() -> None:
    found = objections(active(move(1.0)), active(act("lift", height=1.0)), active(roll(1.0)))
    assert found == ["AE752 arm", "AE751 not-fast-together"]


def test_a_solver_that_cannot_decide_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        conditions.SolverCondition, "decide", lambda self, values: conditions.ConditionValue.UNDECIDED
    )
    solver = JointRules(configuration().site, compiled=False)
    names = ("not-fast-together", "charge-for-both", "hand-near-while-rolling")
    assert set(solver.objections(active(move()), [active(roll())])) == {
        Reason("AE790", name, f"the solver could not decide `{name}`") for name in names
    }


def test_the_rules_of_a_pair_come_with_the_actions_in_the_order_of_the_roles() -> None:
    moving, rolling = active(move()), active(roll())
    roles = {rule.id: pair for rule, pair in compiled().rules_for_pair(rolling, moving)}
    assert roles == {
        "not-fast-together": (moving, rolling),
        "charge-for-both": (rolling, moving),
        "hand-near-while-rolling": (moving, rolling),
    }
    assert list(compiled().rules_for_pair(moving, active(move()))) == []


def test_every_value_that_is_not_measured_is_named() -> None:
    site = configuration().site
    (near,) = (rule for rule in site.joint_rules if rule.id == "hand-near-while-rolling")
    charge = site.state["charge"].variable
    assert isinstance(charge.type, RealType)
    charged = t.Compare("<=", t.Literal(Fraction(0), charge.type), charge)
    both = replace(near, term=t.conjunction(near.term, charged))
    by = JointRules(replace(site, joint_rules=(both,)), compiled=True)
    for mode in (by, compiled()):
        found = objections(active(roll(), hand=None, charge=None), active(move()), by=mode)
        assert sorted(found) == ["AE703 charge", "AE703 hand"]
