"""Chains that `tools/fit_robot.py` makes of URDF files, against the same files in PyBullet."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np
import pytest

from aeros.kinematic_chain import PRISMATIC, frames_of, is_prismatic, mounting_of, zero_angle
from aeros.sim.bullet.client import DATA, bullet
from tools.fit_link_hulls import Points
from tools.fit_robot import Joint, denavit_hartenberg, main, read_chain, ready_posture, reversed_joint
from tools.urdf_shapes import find_mesh, link_vertices, read_mesh, read_urdf
from tools.urdf_tree import mass_of_parts, read_tree, shapes_of

XARM = Path(DATA) / "xarm" / "xarm6_robot.urdf"
IIWA = Path(DATA) / "kuka_iiwa" / "model.urdf"

_BOX = """\
<robot name="box"><link name="base"><collision><geometry>{collision}</geometry></collision>
<visual><geometry><mesh filename="look.dae"/></geometry></visual></link></robot>
"""


def _tips(path: Path, joints: list[Joint], q: list[float]) -> list[Points]:
    """Place of each URDF link, as PyBullet has it: (4, 4)."""
    client = bullet.connect(bullet.DIRECT)
    body = bullet.loadURDF(str(path), useFixedBase=True, physicsClientId=client)
    numbers = {
        bullet.getJointInfo(body, number, physicsClientId=client)[12].decode(): number
        for number in range(bullet.getNumJoints(body, physicsClientId=client))
    }
    moved = [numbers[joint.child] for joint in joints]
    for number, angle in zip(moved, q, strict=True):
        bullet.resetJointState(body, number, angle, physicsClientId=client)
    found = []
    for state in bullet.getLinkStates(body, moved, computeForwardKinematics=1, physicsClientId=client):
        pose: Points = np.eye(4)
        pose[:3, :3] = np.array(bullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        pose[:3, 3] = state[4]
        found.append(pose)
    bullet.disconnect(client)
    return found


@pytest.mark.parametrize("path", [XARM, IIWA], ids=["xarm6", "iiwa"])
def test_the_chain_is_that_of_the_urdf_in_any_posture(path: Path) -> None:
    _, joints = read_chain(read_urdf(path))
    rows, offsets = denavit_hartenberg(joints)
    q = np.linspace(-0.9, 1.1, len(rows)).tolist()
    frames = frames_of([mounting_of(row) for row in rows], q)[1:]
    for frame, offset, expected in zip(frames, offsets, _tips(path, joints, q), strict=True):
        pose: Points = np.eye(4)
        pose[:3, :] = np.array([frame.x, frame.y, frame.z, frame.origin]).T
        assert pose @ offset == pytest.approx(expected, abs=2e-5)


_MASS: Final = """\
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"""

_MIXED: Final = """\
<robot name="mixed">{links}
<joint name="j1" type="prismatic"><parent link="l0"/><child link="l1"/><origin xyz="0.1 0.2 0.3"/>
  <axis xyz="0 1 0"/><limit lower="-0.5" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0.1 0.4" rpy="0 0 0.3"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0.3 0 0" rpy="1.2 0 0"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j4" type="prismatic"><parent link="l3"/><child link="l4"/><origin xyz="0.1 0.1 0" rpy="0.2 0.4
  0"/> <axis xyz="0.6 0 0.8"/><limit lower="-0.3" upper="0.3" effort="1" velocity="1"/></joint>
<joint name="j5" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="0 0.1 0.1"/>
  <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>
"""


def test_a_chain_with_prismatic_joints_is_that_of_the_urdf_in_any_posture(tmp_path: Path) -> None:
    path = tmp_path / "mixed.urdf"
    links = "".join(f'<link name="l{number}">{_MASS}</link>' for number in range(6))
    path.write_text(_MIXED.format(links=links), encoding="utf-8")
    _, joints = read_chain(read_urdf(path))
    rows, offsets = denavit_hartenberg(joints)
    assert [is_prismatic(row) for row in rows] == [True, False, False, True, False]
    chance = np.random.default_rng(3)
    lowest, highest = (np.array([getattr(one, end) for one in joints]) for end in ("lowest", "highest"))
    for q in chance.uniform(lowest, highest, (20, 5)).tolist():
        frames = frames_of([mounting_of(row) for row in rows], q)[1:]
        for frame, offset, expected in zip(frames, offsets, _tips(path, joints, q), strict=True):
            pose: Points = np.eye(4)
            pose[:3, :] = np.array([frame.x, frame.y, frame.z, frame.origin]).T
            assert pose @ offset == pytest.approx(expected, abs=1e-5)


def test_a_prismatic_joint_without_limits_is_refused() -> None:
    joint = '<joint name="j1" type="prismatic"><parent link="a"/><child link="b"/></joint>'
    with pytest.raises(SystemExit, match="prismatic joint `j1` has no `<limit>`"):
        read_chain(ElementTree.fromstring(f"<robot>{joint}</robot>"))  # noqa: S314  text of this test


def _limited(kind: str, limit: str) -> Joint:
    """The joint of a URDF of one."""
    joint = f'<joint name="j1" type="{kind}"><parent link="a"/><child link="b"/><limit {limit}/></joint>'
    _, (found,) = read_chain(ElementTree.fromstring(f"<robot>{joint}</robot>"))  # noqa: S314
    return found


@pytest.mark.parametrize(
    ("kind", "limit"),
    [
        ("prismatic", 'lower="0.3" upper="-0.3"'),
        ("prismatic", 'effort="1"'),
        ("revolute", 'lower="1" upper="1"'),
    ],
)
def test_limits_without_room_between_them_are_refused(kind: str, limit: str) -> None:
    with pytest.raises(SystemExit, match=r"joint `j1` in the URDF are .*; write `lower` and `upper`"):
        _limited(kind, limit)


def test_limits_that_are_left_out_are_those_of_urdf() -> None:
    assert _limited("prismatic", 'upper="0.3"')[3:5] == (0.0, 0.3)
    assert _limited("continuous", 'lower="0" upper="0"')[3:5] == (-np.pi, np.pi)


def test_a_short_way_of_a_prismatic_joint_has_room_for_a_ready_posture() -> None:
    _, joints = read_chain(read_urdf(XARM))
    rows, _ = denavit_hartenberg(joints)
    lowest, highest = (np.array([getattr(one, end) for one in joints]) for end in ("lowest", "highest"))
    lift = ((0.0, 0.0, 0.0, 0.0, PRISMATIC), *rows)
    ends = (np.array([0.0, *lowest]), np.array([0.08, *highest]))
    ready, _ = ready_posture(lift, 0.045, 0.0, ends, lambda _: None)
    assert ready is not None
    assert 0.02 <= ready[0] <= 0.06


def test_a_joint_between_parallel_axes_gets_the_angle_at_its_position_zero() -> None:
    _, joints = read_chain(read_urdf(XARM))
    zeros = [zero_angle(row) for row in denavit_hartenberg(joints)[0]]
    assert zeros == pytest.approx([0.0, -1.384918, 1.384918, 0.0, 0.0, 0.0], abs=1e-4)


def test_a_first_joint_whose_axis_passes_beside_the_bases_origin_is_refused() -> None:
    _, joints = read_chain(read_urdf(IIWA))
    first = joints[0]._replace(place=joints[0].place + np.array([[0.0, 0.0, 0.0, 0.1]] * 3 + [[0.0] * 4]))
    with pytest.raises(SystemExit, match="joint 1 is not normal to the base's x, or passes beside it"):
        denavit_hartenberg([first, *joints[1:]])


def test_in_the_ready_posture_the_tool_points_down() -> None:
    _, joints = read_chain(read_urdf(XARM))
    rows, _ = denavit_hartenberg(joints)
    lowest, highest = (np.array([getattr(one, end) for one in joints]) for end in ("lowest", "highest"))
    ready, _ = ready_posture(rows, 0.045, 0.0, (lowest, highest), lambda _: None)
    assert ready is not None
    assert ((lowest < ready) & (ready < highest)).all()
    frame = frames_of([mounting_of(row) for row in rows], ready.tolist())[-1]
    assert frame.z == pytest.approx((0.0, 0.0, -1.0), abs=1e-5)
    assert frame.x == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)


@pytest.mark.parametrize(
    ("shape", "corner"),
    [
        ('<box size="0.2 0.4 0.6"/>', (0.1, 0.2, 0.3)),
        ('<cylinder radius="0.1" length="0.4"/>', (0.1 / np.cos(np.pi / 16),) * 2 + (0.2,)),
        ('<sphere radius="0.1"/>', (0.1, 0.1, 0.1)),
    ],
)
def test_simple_shapes_are_enclosed_and_pictures_of_other_formats_left_out(
    tmp_path: Path, shape: str, corner: tuple[float, ...]
) -> None:
    urdf = tmp_path / "box.urdf"
    urdf.write_text(_BOX.format(collision=shape), encoding="utf-8")
    (link,) = read_urdf(urdf).findall("link")
    points = link_vertices(link, urdf)
    assert points.max(axis=0) == pytest.approx(corner)
    assert points.min(axis=0) == pytest.approx([-one for one in corner])


def test_a_mesh_of_a_package_is_found_above_the_urdf(tmp_path: Path) -> None:
    for folder in ("arm_description/urdf", "arm_description/meshes"):
        (tmp_path / folder).mkdir(parents=True)
    mesh = tmp_path / "arm_description" / "meshes" / "one.stl"
    mesh.touch()
    urdf = tmp_path / "arm_description" / "urdf" / "arm.urdf"
    assert find_mesh("package://arm_description/meshes/one.stl", urdf) == mesh
    with pytest.raises(SystemExit, match="no file `arm_description/meshes/two"):
        find_mesh("package://arm_description/meshes/two.stl", urdf)


_JOINT = """\
<joint name="one" type="revolute"><parent link="base"/><child link="{child}"/><origin xyz="{xyz}"/></joint>
"""


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            _JOINT.format(child="two", xyz="0 0"),
            "`xyz` of `<origin>` in the URDF is `0 0`; it needs 3 numbers",
        ),
        (_JOINT.format(child="two", xyz="0 0 up"), "is `0 0 up`; it needs 3 numbers"),
        (_JOINT.format(child="two", xyz="0 0 1"), "names the link `base`, which is not there"),
    ],
)
def test_a_chain_that_cannot_be_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str, message: str
) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(f"<robot>{content}</robot>", encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["fit_robot", str(urdf), "arm", "0.1", "0"])
    with pytest.raises(SystemExit, match=message):
        main()


_FIXED: Final = """\
<robot name="fixed"><link name="world"/>
<link name="plate"><collision><geometry><box size="0.6 0.6 0.02"/></geometry></collision></link>
<link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<link name="arm">{mass}<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<link name="frame"/><link name="camera"><inertial><origin xyz="0 0 0.1"/><mass value="3"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision></link>
<link name="wrist">{mass}</link>
<joint name="on" type="fixed"><parent link="world"/><child link="plate"/><origin xyz="0 0 0.5"/></joint>
<joint name="up" type="fixed"><parent link="plate"/><child link="base"/><origin xyz="0 0 0.1"/></joint>
<joint name="j1" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="at" type="fixed"><parent link="arm"/><child link="frame"/><origin xyz="0.4 0 0"/></joint>
<joint name="eye" type="fixed"><parent link="frame"/><child link="camera"/><origin xyz="0 0 0.3"/></joint>
<joint name="j2" type="{kind}"><parent link="{parent}"/><child link="wrist"/><axis xyz="0 0 1"/>{more}</joint>
</robot>
"""


def _fixed(kind: str = "revolute", parent: str = "frame", more: str = "") -> ElementTree.Element:
    """A URDF with links that fixed joints hold: below the base, on the arm, and between its joints."""
    text = _FIXED.format(mass=_MASS, kind=kind, parent=parent, more=more)
    return ElementTree.fromstring(text)  # noqa: S314  text of this test


def test_fixed_joints_make_one_link_of_several(tmp_path: Path) -> None:
    root = _fixed()
    foot, (first, second) = read_chain(root)
    tree = read_tree(root)
    assert [name for name, _ in foot] == ["base", "world", "plate"]
    assert [name for name, _ in first.part] == ["arm", "frame", "camera"]
    assert second.place[:3, 3] == pytest.approx((0.4, 0.0, 0.0))
    stand = np.concatenate(shapes_of(foot, tree, tmp_path))
    assert stand.min(axis=0) == pytest.approx((-0.3, -0.3, -0.11))
    assert np.concatenate(shapes_of(first.part, tree, tmp_path)).max(axis=0) == pytest.approx(
        (0.41, 0.05, 0.31)
    )
    mass = mass_of_parts(first.part, tree, "arm")
    assert mass.mass == 4.0
    assert mass.centre == pytest.approx([0.3, 0.0, 0.3])
    # Of 1 kg and 3 kg, 0.4 m apart along x and along z: 0.12 kg m^2 about y for each, and as much as product.
    assert mass.inertia == pytest.approx([2.12, 2.24, 2.12, 0.0, -0.12, 0.0])


@pytest.mark.parametrize(
    ("kind", "parent", "more", "message"),
    [
        ("floating", "frame", "", r"`frame` has the joints `j2` \(floating\)"),
        ("revolute", "plate", "", r"not one chain .* the joints `j1` \(revolute\), `j2` \(revolute\)"),
        ("revolute", "frame", '<mimic joint="j1"/>', "the joint `j2` mimics another one"),
    ],
)
def test_joints_that_no_chain_has_are_refused(kind: str, parent: str, more: str, message: str) -> None:
    with pytest.raises(SystemExit, match=message):
        read_chain(_fixed(kind, parent, more))


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        (["nan", "0"], "FLANGE is nan"),
        (["0", "0"], "FLANGE is 0"),
        (["45", "0"], "FLANGE is 45; give the distance in m"),
        (["0.1", "inf"], "TURN is inf"),
        (["0.1", "180"], "TURN is 180; give an angle in rad"),
        (["0.1", "0", "-0.1"], "ADAPTER is -0.1"),
        (["0.1", "0", "0.2"], "ADAPTER is 0.2; .* no more than that of FLANGE"),
        (["0.1", "0", "nan"], "ADAPTER is nan"),
    ],
)
def test_odd_numbers_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], numbers: list[str], message: str
) -> None:
    monkeypatch.setattr(sys, "argv", ["fit_robot", "arm.urdf", "arm", "--", *numbers])
    with pytest.raises(SystemExit):
        main()
    assert re.search(message, capsys.readouterr().err)


def test_a_posture_in_which_links_meet_is_not_the_ready_one() -> None:
    _, joints = read_chain(read_urdf(XARM))
    rows, _ = denavit_hartenberg(joints)
    ends = (np.array([one.lowest for one in joints]), np.array([one.highest for one in joints]))
    first, _ = ready_posture(rows, 0.045, 0.0, ends, lambda _: None)
    assert first is not None
    near = first.copy()
    second, met = ready_posture(
        rows, 0.045, 0.0, ends, lambda q: ("hand", "link3") if np.allclose(q, near) else None
    )
    assert second is not None
    assert not np.allclose(second, near)
    assert met["hand", "link3"] >= 1


def test_an_axis_that_points_into_the_arm_is_reversed() -> None:
    _, joints = read_chain(read_urdf(XARM))
    turned = reversed_joint(joints[-1])
    plain, other = (denavit_hartenberg([*joints[:-1], last])[0] for last in (joints[-1], turned))
    q = np.linspace(-0.9, 1.1, len(joints))
    frame = frames_of([mounting_of(row) for row in plain], q.tolist())[-1]
    against = frames_of([mounting_of(row) for row in other], [*q[:-1].tolist(), -float(q[-1])])[-1]
    assert against.z == pytest.approx([-one for one in frame.z], abs=1e-9)
    assert against.origin == pytest.approx(frame.origin, abs=1e-9)
    assert abs(float(np.dot(against.x, frame.x))) == pytest.approx(1.0)
    assert (turned.lowest, turned.highest) == (-joints[-1].highest, -joints[-1].lowest)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("one.stl", b"abc"),
        ("one.obj", b"v 1 up 2"),
        ("one.obj", b"v 1 2"),
        ("one.obj", b""),
        ("one.obj", b"\xff"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SystemExit, match=f"{name}: (not an OBJ or STL file|no vertices)"):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("shape", ["<box/>", '<sphere radius="wide"/>', '<cylinder radius="1"/>'])
def test_a_shape_without_its_numbers_is_refused(tmp_path: Path, shape: str) -> None:
    urdf = tmp_path / "box.urdf"
    urdf.write_text(_BOX.format(collision=shape), encoding="utf-8")
    (link,) = read_urdf(urdf).findall("link")
    with pytest.raises(SystemExit, match="it needs"):
        link_vertices(link, urdf)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<robot><link name="a"/><link name="b"/></robot>', "not one chain .* begins at `a`, `b`"),
        ('<robot><link name="a"/></robot>', "not one chain .* no joint of it moves"),
        (
            '<robot><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
            '<axis xyz="0 0 0"/></joint></robot>',
            "the axis of the joint `j` has no direction",
        ),
        (
            "<robot>"
            '<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>'
            '<joint name="k" type="revolute"><parent link="b"/><child link="c"/></joint>'
            '<joint name="l" type="revolute"><parent link="c"/><child link="b"/></joint>'
            "</robot>",
            "the joints of the URDF lead back to the link `b`",
        ),
        ("<robot>", "no element found"),
        (None, "No such file"),
    ],
)
def test_a_urdf_that_cannot_be_used_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str | None, message: str
) -> None:
    urdf = tmp_path / "arm.urdf"
    if content is not None:
        urdf.write_text(content, encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["fit_robot", str(urdf), "arm", "0.1", "0"])
    with pytest.raises(SystemExit, match=message):
        main()
