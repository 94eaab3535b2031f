"""Visible parts of a model and the poses of its links."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from aeros.sim.geometry import to_world
from aeros.sim.pictures.urdf_model import UrdfVisuals
from aeros.spec.model.scene import GREY

MODEL = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base"><visual><geometry><box size="1 2 3"/></geometry><material name="red"/></visual></link>
  <link name="lid">
    <visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
      <geometry><cylinder radius="1" length="2"/></geometry>
      <material name="own"><color rgba="0 1 0 1"/></material></visual>
    <visual><geometry><sphere radius="0.5"/></geometry></visual>
    <visual><geometry><mesh filename="lid.stl"/></geometry></visual>
  </link>
  <link name="pin"/>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="lid"/><origin xyz="1 0 0"/><axis xyz="0 2 0"/>
  </joint>
  <joint name="slot" type="prismatic"><parent link="lid"/><child link="pin"/></joint>
</robot>"""


@pytest.fixture
def model(tmp_path: Path) -> UrdfVisuals:
    (tmp_path / "arm.urdf").write_text(MODEL)
    return UrdfVisuals(str(tmp_path / "arm.urdf"))


def test_visible_parts_have_links_colours_and_places(model: UrdfVisuals) -> None:
    found = [(link, one.colour, one.place.position) for link, one in model.solids]
    assert found == [
        ("base", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ("lid", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        ("lid", GREY, (0.0, 0.0, 0.0)),
    ]
    cylinder = model.solids[1][1]
    assert to_world(cylinder.place, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 1.0))


def test_a_link_moves_with_the_joints_before_it(model: UrdfVisuals) -> None:
    assert model.link_pose("base", {"hinge": 1.0}).position == (0.0, 0.0, 0.0)
    assert model.link_pose("lid", {}).position == (1.0, 0.0, 0.0)
    # Half a turn about y: what was ahead is behind.
    lid = model.link_pose("lid", {"hinge": pi})
    assert to_world(lid, (0.5, 0.0, 0.0)) == pytest.approx((0.5, 0.0, 0.0))
    # A slot without an axis is along x.
    pin = model.link_pose("pin", {"hinge": pi / 2, "slot": 0.25})
    assert pin.position == pytest.approx((1.0, 0.0, -0.25))


@pytest.mark.parametrize(
    ("rpy", "x", "y"),
    [
        ("1.5707963267948966 0 0", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ("0 1.5707963267948966 0", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
        ("1.5707963267948966 0 1.5707963267948966", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ],
)
def test_angles_turn_about_x_then_y_then_z(
    tmp_path: Path, rpy: str, x: tuple[float, ...], y: tuple[float, ...]
) -> None:
    file = tmp_path / "one.urdf"
    file.write_text(
        f'<robot name="one"><link name="a"><visual><origin rpy="{rpy}"/>'
        '<geometry><box size="1 1 1"/></geometry></visual></link></robot>'
    )
    place = UrdfVisuals(str(file)).solids[0][1].place
    assert to_world(place, (1.0, 0.0, 0.0)) == pytest.approx(x)
    assert to_world(place, (0.0, 1.0, 0.0)) == pytest.approx(y)
