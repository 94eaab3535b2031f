"""Standing arms of a robot file: every fault has a place, a cause and a cure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.kinematic_chain import frames_of
from aeros.sim.robot.robot_file import read_robot, robot_of
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from tests.unit.sim.robot.standing_arms.two_armed_robots import (
    SECTION,
    two_pandas,
    write_two_armed_site,
    write_two_arms,
)

TEXT = f"standing_arms:{SECTION}"
POSTURE = "[0.0, -1.2, 0.0, -2.7, 0.0, 1.5, 0.785]"
TOLERANCE = "[5, 5, 5, 5, 5, 5, 5]"
ARM = TEXT.removeprefix("standing_arms:\n")


def changed(old: str, new: str) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, 1)


def faults_of(path: Path) -> list[Diagnostic]:
    with pytest.raises(UserError) as error:
        read_robot(str(path))
    return list(error.value.diagnostics)


def test_links_of_a_standing_arm_are_where_its_posture_has_them() -> None:
    robot = two_pandas()
    (arm,) = robot.standing_arms
    assert arm.model is not robot
    assert arm.tolerance == (0.005,) * 7
    frames = frames_of(arm.model.mountings, arm.posture)
    hulls = {hull.link: hull for hull in robot.body.hulls}
    for hull in arm.model.body.hulls:
        carried = hulls[f"left_{hull.link}"]
        assert carried.joint == 0
        expected = np.array([frames[hull.joint].to_base(corner) for corner in hull.corners])
        assert np.array(carried.corners) - np.array((0.0, 0.5, 0.0)) == pytest.approx(expected)
        assert carried.radius >= hull.radius
    assert [one.link for one in robot.capsules if one.link.startswith("left_")] == [
        f"left_{one.link}" for one in arm.model.capsules
    ]


@pytest.mark.parametrize(
    ("section", "headline", "marked"),
    [
        (changed(POSTURE, "[0, 0, 0]"), "this column has 3 values; the chain has 7 joints", "unit: rad"),
        (changed(TOLERANCE, "[5]"), "this column has 1 values; the chain has 7 joints", "unit: mrad"),
        (
            changed("-2.7", "-3.0719"),
            "joint 4 of `panda` stands at -3.0719 rad, outside of its limits, -3.0718 to -0.0698",
            "-3.0719",
        ),
        (changed("-2.7", ".nan"), "`values`: expected a number, found `.nan`", ".nan"),
        (changed("unit: rad", "unit: m"), "expected a unit of rad, found `m`", "m"),
        (changed("[5, 5,", "[-5, 5,"), "`-5` is below 0", "-5"),
        (changed("robot: panda", "robot: pandas"), "there is no robot `pandas`", "pandas"),
        (changed("robot: panda", "robot: gone.yaml"), "there is no file `", "gone.yaml"),
        (
            changed("robot: panda", "robot: two_pandas.yaml"),
            "the robot carries itself: ",
            "two_pandas.yaml",
        ),
        (changed("at: [0.0, 0.5", "at: [0.0, 500"), "`500` is beyond 10 m", "500"),
        (
            changed("at: [0.0, 0.5, 0.0]", "at: [0.0, 0.5]"),
            "`at`: 2 entries are not allowed here",
            "at: [0.0, 0.5]",
        ),
        (changed("    at:", "    joint: 8\n    at:"), "no 8 joints carry the arm: the moving arm has 7", "8"),
        (changed("    at:", "    joint: -1\n    at:"), "no -1 joints carry the arm", "-1"),
        (changed("yaw: [0.0, 0.0, 0.0]", "yaw: [0, 0, 90]"), "`90` is beyond 6.2832 rad", "90"),
        (changed("prefix: left_", 'prefix: ""'), "`prefix`: `` is not a well-formed identifier", '""'),
        (TEXT + ARM, "both arms have a link `left_fingers`; choose another prefix", "left_"),
        (
            changed("at: [0.0, 0.5", "at: [0.0, 0.1"),
            "`left_link1` overlaps `foot` in",
            "prefix: left_",
        ),
        (
            TEXT + ARM.replace("left_", "third_").replace("0.5", "0.52"),
            "`third_link1` overlaps `left_foot` in the ready posture",
            "prefix: third_",
        ),
        (TEXT + "    colour: red\n", "unknown field `colour`", "colour"),
    ],
)
def test_faults_have_place_cause_and_cure(tmp_path: Path, section: str, headline: str, marked: str) -> None:
    found = faults_of(write_two_arms(tmp_path, section))[0]
    assert found.headline.startswith(headline)
    assert found.help
    assert found.primary is not None
    span = found.primary.span
    assert Path(span.source.path).name == "two_pandas.yaml"
    assert span.source.text[span.start :].startswith(marked)


def test_each_arm_that_overlaps_another_is_reported_once(tmp_path: Path) -> None:
    inside, further = changed("at: [0.0, 0.5", "at: [0.0, 0.1"), ARM.replace("left_", "third_")
    found = faults_of(write_two_arms(tmp_path, inside + further + further.replace("third_", "fourth_")))
    overlapping = ["`left_link1` overlaps `foot`", "`fourth_link1` overlaps `third_foot`"]
    assert [one.headline for one in found] == [f"{one} in the ready posture" for one in overlapping]


def test_a_circle_of_files_is_found_and_a_fault_of_a_carried_arm_has_its_own_file(tmp_path: Path) -> None:
    first = write_two_arms(tmp_path, changed("robot: panda", "robot: other.yaml"))
    other = write_two_arms(tmp_path, changed("robot: panda", "robot: two_pandas.yaml"), name="other")
    (found,) = faults_of(first)
    assert found.headline == (
        "the robot carries itself: `two_pandas.yaml` carries `other.yaml` carries `two_pandas.yaml`"
    )
    assert found.primary is not None
    assert Path(found.primary.span.source.path).name == "other.yaml"
    other.write_text("schema: aeros/robot/1\n", encoding="utf-8")
    assert all(
        one.primary is not None and Path(one.primary.span.source.path).name == "other.yaml"
        for one in faults_of(first)
    )


def test_an_arm_may_carry_an_arm_that_has_one(tmp_path: Path) -> None:
    write_two_arms(tmp_path, name="pair")
    section = changed("robot: panda", "robot: pair.yaml").replace("at: [0.0", "at: [-0.3")
    robot = read_robot(str(write_two_arms(tmp_path, section)))
    names = [hull.link for hull in robot.body.hulls]
    assert len(names) == len({*names}) == 30
    assert "left_left_hand" in names
    into_it = section.replace(POSTURE, "[0.95, 0.6, 0.0, -1.6, 0.0, 2.2, 0.8]")
    found = faults_of(write_two_arms(tmp_path, into_it, name="other"))[0]
    assert found.headline.startswith("`left_link")
    assert "overlaps `left_left_" in found.headline


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """The reference site with two arms, of which one stands elsewhere than its file says."""
    path = write_two_armed_site(tmp_path_factory.mktemp("site"))
    robot = "robot: two_pandas.yaml\n"
    postures = "standing_postures: {left_: [0.5, -1, 0, -2.5, 0, 1.5, 0]}\n"
    path.write_text(path.read_text(encoding="utf-8").replace(robot, robot + postures, 1), encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    assert site is not None, list(diagnostics)
    return site


def test_a_site_may_let_the_arm_stand_elsewhere(site: Site) -> None:
    robot, moved = robot_of(replace(site, standing_postures={})), robot_of(site)
    assert moved is robot_of(site)
    assert moved.standing_arms[0].posture == (0.5, -1.0, 0.0, -2.5, 0.0, 1.5, 0.0)
    assert [hull.link for hull in moved.body.hulls] == [hull.link for hull in robot.body.hulls]
    assert moved.body.hulls[:11] == robot.body.hulls[:11]
    assert moved.body.hulls[-1] != robot.body.hulls[-1]
    assert len(moved.body.balls) == len(robot.body.balls)
    assert len(moved.capsules) == len(robot.capsules)


@pytest.mark.parametrize(
    ("postures", "headline"),
    [
        ({"right_": (0, 0, 0, -2, 0, 1, 0)}, "the robot `two_pandas` has no standing arm `right_`"),
        ({"left_": (0, 0)}, "the posture of `left_` has 2 values; it has 7 joints"),
        ({"left_": (0, 0, 0, 2, 0, 1, 0)}, "joint 4 of `panda` stands at 2 rad, outside of its limits"),
        ({"left_": (-1.57, 1.2, 0, -0.5, 0, 1.5, 0)}, "`left_link5` overlaps `link"),
        ({"left_": (0, 1.7, 0, -3.07, 0, 0, 0)}, "`left_link5` overlaps `left_foot`"),
    ],
)
def test_a_site_whose_posture_does_not_fit_is_refused(site: Site, postures: Any, headline: str) -> None:
    with pytest.raises(UserError) as error:
        robot_of(replace(site, standing_postures=postures))
    (found,) = error.value.diagnostics
    assert found.headline.startswith(headline)
    assert found.help
    assert found.primary is not None
    span = found.primary.span
    assert span.source.text[span.start :].startswith("standing_postures:")


def test_a_barrier_that_names_no_link_of_a_standing_arm_is_refused(site: Site) -> None:
    assert site.motion is not None
    alone = [
        replace(one, links=frozenset(("fingers", "held"))) if one.id == "fingers-off-the-bench" else one
        for one in site.motion.barriers
    ]
    with pytest.raises(UserError) as error:
        robot_of(replace(site, motion=replace(site.motion, barriers=tuple(alone))))
    (found,) = error.value.diagnostics
    assert found.headline == "the barrier `fingers-off-the-bench` names no link of the standing arm `left_`"
