"""The referee judges a goal by truth alone: false beats unknown, and unknown is never success."""

from __future__ import annotations

import pytest

from aeros.apps.goal import parse_goal
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.referee import GoalJudgement, judge_goal, truth_of
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.runtime.perception.kettle import full_site

SITE = load_site(reference_site_path(), Diagnostics())


def judged(goal: str, believed: bool = True, **truth: bool) -> GoalJudgement:
    assert SITE is not None
    return judge_goal(parse_goal(goal, SITE).term, believed, truth)


@pytest.mark.parametrize(
    ("goal", "truth", "expected"),
    [
        ("table_wiped", {"table_wiped": True}, True),
        ("table_wiped", {"table_wiped": False}, False),
        ("table_wiped", {}, None),
        ("not table_wiped", {"table_wiped": False}, True),
        ("table_wiped and table_organized", {"table_wiped": True, "table_organized": True}, True),
        ("table_wiped and table_organized", {"table_wiped": True}, None),
        ("table_wiped and table_organized", {"table_organized": False}, False),
        ("table_wiped or table_organized", {"table_wiped": True}, None),
        ("table_wiped and wiped_fraction >= 0.9", {"table_wiped": True}, None),
        ("table_wiped and wiped_fraction >= 0.9", {"table_wiped": False}, False),
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
    goal = parse_goal("kettle.water_hot and not table_wiped", site).term
    truth = {"water_hot": False, "table_wiped": False}
    found = judge_goal(goal, True, truth, module)
    assert found.is_false_claim
    assert found.values == {"kettle.water_hot": False, "table_wiped": False}
    assert judge_goal(goal, True, truth, "pot").true is None


@pytest.mark.parametrize(
    ("believed", "truth", "text", "false_claim"),
    [
        (True, {"table_wiped": True}, "goal reached: believed true, true in the simulator", False),
        (False, {"table_wiped": True}, "goal reached: believed false, true in the simulator", False),
        (False, {"table_wiped": False}, "goal reached: believed false, false in the simulator", False),
        (
            True,
            {"table_wiped": False},
            "goal reached: believed true, false in the simulator: table_wiped = false",
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
    found = judged("table_wiped", believed, **truth)
    assert (str(found), found.is_false_claim) == (text, false_claim)
    assert found.record() == {"believed": believed, "true": found.true, "values": truth}


def test_a_plant_tells_the_truth_of_its_scene_or_none() -> None:
    assert truth_of(make_plant(shipped_scene("fetch"), 0)) == {
        "object_grasped": False,
        "object_delivered": False,
    }
    assert truth_of(object()) == {}
