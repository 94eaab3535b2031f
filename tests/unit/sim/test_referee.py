"""The referee judges a goal by truth alone: false beats unknown, and unknown is never success."""

from __future__ import annotations

import pytest

from aeros.apps.goal import parse_goal
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.referee import GoalJudgement, judge_goal, truth_of
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.agent.instructions.lists.reference import reference_modules
from tests.unit.runtime.perception.kettle import full_site

SITE = load_site(reference_site_path(), Diagnostics())


def judged(goal: str, believed: bool = True, **truth: bool) -> GoalJudgement:
    assert SITE is not None
    return judge_goal(parse_goal(goal, SITE).term, believed, truth)


@pytest.mark.parametrize(
    ("goal", "truth", "expected"),
    [
        ("estop_pressed", {"estop_pressed": True}, True),
        ("estop_pressed", {"estop_pressed": False}, False),
        ("estop_pressed", {}, None),
        ("not estop_pressed", {"estop_pressed": False}, True),
        ("estop_pressed and holding", {"estop_pressed": True, "holding": True}, True),
        ("estop_pressed and holding", {"estop_pressed": True}, None),
        ("estop_pressed and holding", {"holding": False}, False),
        ("estop_pressed or holding", {"estop_pressed": True}, None),
        ("estop_pressed and finger_gap >= 50 mm", {"estop_pressed": True}, None),
        ("estop_pressed and finger_gap >= 50 mm", {"estop_pressed": False}, False),
    ],
)
def test_a_goal_is_judged_as_far_as_its_truth_is_defined(
    goal: str, truth: dict[str, bool], expected: bool | None
) -> None:
    found = judged(goal, **truth)
    assert found.true is expected
    assert found.values == truth


def test_a_scene_names_a_modules_own_predicate_by_its_short_name() -> None:
    site, module = full_site(), "kettle"
    goal = parse_goal("kettle.water_hot and not estop_pressed", site).term
    truth = {"water_hot": False, "estop_pressed": False}
    found = judge_goal(goal, True, truth, module)
    assert found.is_false_claim
    assert found.values == {"kettle.water_hot": False, "estop_pressed": False}
    assert judge_goal(goal, True, truth, "pot").true is None


@pytest.mark.parametrize(
    ("believed", "truth", "text", "false_claim"),
    [
        (True, {"estop_pressed": True}, "goal reached: believed true, true in the simulator", False),
        (False, {"estop_pressed": True}, "goal reached: believed false, true in the simulator", False),
        (False, {"estop_pressed": False}, "goal reached: believed false, false in the simulator", False),
        (
            True,
            {"estop_pressed": False},
            "goal reached: believed true, false in the simulator: estop_pressed = false",
            True,
        ),
        (
            True,
            {},
            "goal reached: believed true, not refereed: the scene does not define its truth",
            False,
        ),
    ],
)
def test_belief_and_truth_stand_side_by_side(
    believed: bool, truth: dict[str, bool], text: str, false_claim: bool
) -> None:
    found = judged("estop_pressed", believed, **truth)
    assert (str(found), found.is_false_claim) == (text, false_claim)
    assert found.record() == {"believed": believed, "true": found.true, "values": truth}


def test_a_plant_tells_the_truth_of_its_scene_or_none() -> None:
    assert truth_of(make_plant(shipped_scene("bare"), 0)) == {}
    truth = truth_of(make_plant(shipped_scene("fetch"), 0))
    assert len(truth) == 2 * 2 + 2 * 4
    assert not any(truth.values())
    assert truth_of(object()) == {}


def test_a_goal_is_judged_for_the_arguments_of_the_instruction() -> None:
    goal = t.Variable("m.near", BOOL, t.VariableRole.STATE)
    truth = {"m.near(to = left)": True, "m.near(to = right)": False}
    judged_for = {
        side: judge_goal(goal, True, truth, "m", {"m.to": side}).true for side in ("left", "right", "up")
    }
    assert judged_for == {"left": True, "right": False, "up": None}
    assert judge_goal(goal, True, truth, "m").true is None


def test_a_goal_over_two_modules_is_judged_for_the_parameters_of_both() -> None:
    names = ("m.near", "n.near")
    goal = t.And(tuple(t.Variable(one, BOOL, t.VariableRole.STATE) for one in names))
    truth = {"m.near(to = left)": True, "n.near(to = left)": False, "n.near(to = right)": True}
    assert judge_goal(goal, True, truth, "m", {"m.to": "left", "n.to": "right"}).true is True
    assert judge_goal(goal, True, truth, "m", {"m.to": "left", "n.to": "left"}).true is False
    assert judge_goal(goal, True, truth, "m", {"m.to": "left"}).true is None


@pytest.mark.parametrize(
    ("cooked", "count", "expected"), [(2, 2, True), (1, 2, False), (1, 1, True), (0, 1, False)]
)
def test_a_number_is_judged_as_a_truth_is(cooked: int, count: int, expected: bool) -> None:
    goal = reference_modules()["make_dumplings"].tasks["make_dumplings"].goal
    truth = {"make_dumplings.dumplings_cooked": cooked, "make_dumplings.dumpling_cooked": cooked > 0}
    found = judge_goal(goal, True, truth, "make_dumplings", {"make_dumplings.count": count})
    assert (found.true, dict(found.values)) == (expected, {"make_dumplings.dumplings_cooked": cooked})
    assert expected or f"make_dumplings.dumplings_cooked = {cooked}" in str(found)
