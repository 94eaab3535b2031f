"""Grippers that `tools/fit_gripper.py` reads from URDF files, whatever their links are called."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.fit_gripper import read_gripper_urdf

URDF = Path(__file__).parents[1] / "scara" / "gripper.urdf"
TEXT = URDF.read_text(encoding="utf-8")


def test_fingers_along_x_are_laid_along_y_and_closed() -> None:
    found = read_gripper_urdf(URDF)
    assert found.tool == pytest.approx(0.166)
    assert found.lines[:3] == ["  tool: 166 mm", "  widest_gap: 110 mm", "  palm:"]
    assert found.lines[-2:] == [
        "      - {edges: [0.03, 0.025, 0.03], at: [0.0, 0.0225, 0.115]}",
        "      - {edges: [0.022, 0.012, 0.06], at: [0.0, 0.006, 0.145]}",
    ]
    assert found.fingers.max(axis=0) == pytest.approx([0.015, 0.09, 0.175])


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ('name="follow" type="prismatic"', 'name="follow" type="fixed"', "that move are `drive`"),
        ('name="drive" type="prismatic"', 'name="drive" type="revolute"', "suction and fingers that swing"),
        ('<axis xyz="1 0 0"/>', '<axis xyz="0.7 0.7 0"/>', "neither along x nor along y"),
        ('size="0.012 0.022 0.06"', 'size="0.012 0.022 0.09"', "the fingers and their ways are not the same"),
        ('upper="0.055"', 'upper="wide"', "`upper` of `<limit>` in the URDF is `wide`"),
        ('<child link="jaw_l"/>', '<child link="thumb"/>', "give each joint links that are there"),
        ('<mass value="0.8"/>', '<mass value="0"/>', "the palm of the gripper has no mass"),
        ("<robot", "<robot <", "not well-formed"),
        ('<mass value="0.06"/>', '<mass value="0"/>', "the finger of `drive` has no mass"),
        ('upper="0.055"', 'upper="0.02"', "the fingers and their ways are not the same"),
        ('<mimic joint="drive"/>', '<mimic joint="drive" multiplier="0.5"/>', "move by different ways"),
    ],
)  # fmt: skip
def test_another_gripper_is_refused_with_its_cause(old: str, new: str, cause: str, tmp_path: Path) -> None:
    assert old in TEXT
    path = tmp_path / "gripper.urdf"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SystemExit) as error:
        read_gripper_urdf(path)
    assert cause in str(error.value)


def test_fingers_that_stay_apart_or_lead_backwards_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "gripper.urdf"
    for old, new, cause in (
        ('lower="0"', 'lower="0.005"', "the closed fingers are 10 mm apart"),
        ('xyz="0 0 0.1" rpy', 'xyz="0 0 -0.1" rpy', "do not lead out of the palm along z"),
    ):
        path.write_text(TEXT.replace(old, new), encoding="utf-8")
        with pytest.raises(SystemExit) as error:
            read_gripper_urdf(path)
        assert cause in str(error.value)


def test_shapes_that_overlap_when_closed_open_no_wider(tmp_path: Path) -> None:
    path = tmp_path / "gripper.urdf"
    path.write_text(TEXT.replace('lower="0"', 'lower="-0.005"'), encoding="utf-8")
    assert read_gripper_urdf(path).lines == read_gripper_urdf(URDF).lines


@pytest.mark.parametrize("parent", ["rg_base", "jaw_l"])
def test_a_frame_without_a_shape_changes_nothing(parent: str, tmp_path: Path) -> None:
    path = tmp_path / "gripper.urdf"
    joint = f'<joint name="at" type="fixed"><parent link="{parent}"/><child link="tcp"/></joint>'
    path.write_text(TEXT.replace("</robot>", f'<link name="tcp"/>{joint}</robot>'), encoding="utf-8")
    assert read_gripper_urdf(path).lines == read_gripper_urdf(URDF).lines
