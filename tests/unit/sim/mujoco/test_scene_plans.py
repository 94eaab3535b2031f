"""Bodies of scenes as links: shapes, masses and joints as declared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.sim.mujoco.plans import inertia_of_shapes
from aeros.sim.mujoco.scene_plans import plan_body
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import Basin, Box, Compound, Cylinder, Joint, Part, Sphere, UrdfModel
from tests.shipped_scenes import SHIPPED, shipped_scene
from tests.unit.sim.engine.declared_bodies import body

URDF = """<robot name="door">
<link name="frame"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
<link name="leaf"><inertial><origin xyz="0.1 0 0" rpy="0 0 1.5707963"/><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/></inertial>
<collision><geometry>{shape}</geometry></collision></link>
<link name="knob"><inertial><mass value="0.1"/></inertial>
<collision><geometry><sphere radius="0.02"/></geometry></collision></link>
<joint name="hinge" type="{kind}"><parent link="frame"/><child link="leaf"/><origin xyz="0 0 0.5"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="2" effort="1" velocity="1"/><dynamics damping="0.3"/></joint>
<joint name="stuck" type="fixed"><parent link="leaf"/><child link="knob"/></joint></robot>"""

CAPSULE = '<capsule radius="0.1" length="0.5"/>'


def model(folder: Path, kind: str = "revolute", shape: str = CAPSULE, **more: Any) -> UrdfModel:
    path = folder / "door.urdf"
    path.write_text(URDF.format(kind=kind, shape=shape))
    return UrdfModel(str(path), ("frame", "leaf", "knob"), {"hinge": kind}, **more)


@pytest.mark.parametrize(
    ("shape", "kinds"),
    [
        (Box((1.0, 2.0, 3.0)), ["box"]),
        (Cylinder(0.1, 0.2), ["cylinder"]),
        (Sphere(0.1), ["sphere"]),
        (Basin((0.2, 0.1, 0.05)), ["box"] * 5),
        (
            Compound(
                (
                    Part(Box((1.0, 1.0, 1.0)), (0.0, 0.0, 1.0), (0.5, 0.5, 0.5)),
                    Part(Sphere(0.1), (0.0, 0.0, 0.0), (0.5, 0.5, 0.5)),
                )
            ),
            ["box", "sphere"],
        ),
    ],
)
def test_a_rigid_body_is_one_link_of_its_shapes(shape: Any, kinds: list[str]) -> None:
    (link,) = plan_body(body(shape=shape, mass=0.4, friction=0.7, rolling_resistance=0.001))
    assert [one.kind for one in link.shapes] == kinds
    assert len(link.visuals) == len(kinds)
    assert link.friction == (0.7, 0.02, 0.001)
    assert link.inertia is not None
    assert link.inertia.mass == 0.4
    assert np.all(np.linalg.eigvalsh(link.inertia.matrix) > 0.0)
    assert plan_body(body(shape=shape))[0].inertia is None


def test_links_of_a_file_follow_their_parents_with_masses_and_limits(tmp_path: Path) -> None:
    frame, leaf, knob = plan_body(body(shape=model(tmp_path, link_friction={"leaf": 0.9})))
    assert [one.parent for one in (frame, leaf, knob)] == [None, "frame", "leaf"]
    assert frame.inertia is None  # it is fixed to W
    assert leaf.joint is not None
    assert leaf.joint[:6] == ("hinge", False, (0.0, 0.0, 1.0), (-1.0, 2.0), 0.0, 0.3)
    assert (leaf.friction.lateral, knob.friction.lateral) == (0.9, 0.5)
    assert leaf.place.position == (0.0, 0.0, 0.5)
    assert leaf.inertia is not None
    assert leaf.inertia.centre == (0.1, 0.0, 0.0)
    assert np.allclose(leaf.inertia.matrix, np.diag((2.0, 1.0, 3.0)), atol=1e-6)
    assert knob.joint is None
    assert knob.inertia is not None
    assert knob.inertia.matrix[0, 0] == pytest.approx(0.4 * 0.1 * 0.02**2)


def test_a_scene_sets_friction_and_range_of_a_joint(tmp_path: Path) -> None:
    settings = {"hinge": Joint(0.5, (0.0, 1.0))}
    _, leaf, _ = plan_body(body(shape=model(tmp_path, "continuous", joint_settings=settings)))
    assert leaf.joint is not None
    assert (leaf.joint.limits, leaf.joint.friction) == ((0.0, 1.0), 0.5)
    _, free, _ = plan_body(body(shape=model(tmp_path, "continuous")))
    assert free.joint is not None
    assert free.joint.limits is None


@pytest.mark.parametrize(
    ("shape", "kind"),
    [
        ('<box size="1 2 3"/>', "box"),
        ('<cylinder radius="0.1" length="0.5"/>', "cylinder"),
        (CAPSULE, "capsule"),
        ('<sphere radius="0.1"/>', "sphere"),
    ],
)
def test_every_shape_of_a_file_is_read(tmp_path: Path, shape: str, kind: str) -> None:
    _, leaf, _ = plan_body(body(shape=model(tmp_path, shape=shape), mass=1.0))
    assert [one.kind for one in leaf.shapes] == [kind]


def test_a_file_that_is_missing_or_has_a_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="model file not found"):
        plan_body(body(shape=UrdfModel(str(tmp_path / "absent.urdf"), ("a",), {})))
    with pytest.raises(UserError, match=r"door.urdf`: a link collides by a mesh"):
        plan_body(body(shape=model(tmp_path, shape='<mesh filename="leaf.stl"/>')))


def test_shipped_models_declare_the_inertia_of_their_shapes() -> None:
    models = {
        one.shape.path: one.shape
        for scene in map(shipped_scene, SHIPPED)
        for one in scene.bodies.values()
        if isinstance(one.shape, UrdfModel)
    }
    assert {Path(path).stem for path in models} >= {"press", "wrapper", "sponge"}
    links = [link for shape in models.values() for link in plan_body(body(shape=shape, mass=1.0))]
    assert len(links) > 6
    for link in links:
        assert link.inertia is not None
        mass, centre, declared = link.inertia
        of_shapes = inertia_of_shapes(mass, link.shapes).matrix
        # About the origin of the link, by the parallel-axis theorem.
        place = np.array(centre)
        about_origin = declared + mass * (place @ place * np.eye(3) - np.outer(place, place))
        assert about_origin == pytest.approx(of_shapes, rel=1e-3, abs=1e-3 * np.trace(of_shapes)), link.name
