"""Bodies, people and layers are where a picture has them; the arm is that of the kinematics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aeros.sim.film import meshes as meshes_module
from aeros.sim.film.film_model import HIDDEN_GROUP, FilmModel, HullArm, MeshArm, arm_of
from aeros.sim.film.person_shapes import stances_of
from aeros.sim.film.recording import Actor, Recording, RecordingError
from aeros.sim.pictures.visual_shapes import VisualShape
from tests.described import described
from tests.reports_in_full import compare_with_section
from tests.unit.sim.film.recordings import ROBOT, recording, samples

URDF = "franka_panda/panda.urdf"


def test_things_that_a_picture_does_not_have_are_hidden() -> None:
    film = FilmModel(recording(3), (320, 180))
    stances = stances_of([sample.people for sample in samples(3)])
    shown = []
    for sample, people in zip(samples(3), stances, strict=True):
        film.place(sample, people)
        shown.append(int((film.model.geom_group != HIDDEN_GROUP).sum()))
    # The box appears in the second picture, and three of four cells are wiped in the third.
    assert np.diff(shown).tolist() == [1, -3]
    film.place(samples(1)[0], [])
    assert (film.model.geom_group == HIDDEN_GROUP).sum() > 10
    box = np.flatnonzero((film.model.geom_rgba[:, 0] > 0.79) & (film.model.geom_size == 0.05).all(axis=1))
    film.place(samples(3)[2], [])
    assert film.data.geom_xpos[box[0]].tolist() == pytest.approx([0.5, 0.0, 0.05])


def test_a_shape_that_cannot_be_drawn_is_named() -> None:
    flat = VisualShape("box", (0.1, 0.1, 0.0), (0.8, 0.1, 0.1))
    whole = recording(1)
    stage = replace(whole.stage, actors=(Actor("box", "", (flat,)), *whole.stage.actors[1:]))
    with pytest.raises(RecordingError, match="a shape of the recording cannot be drawn"):
        FilmModel(Recording(stage, whole.samples), (320, 180))
    outside = replace(ROBOT, urdf="../../../etc/hostname")
    assert isinstance(arm_of(outside), HullArm)


def test_meshes_and_hulls_of_an_arm_are_in_the_same_place(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pybullet_data")
    names = tuple(f"panda_joint{number}" for number in range(1, 8))
    robot = replace(ROBOT, urdf=URDF, urdf_joints=names)
    meshes, hulls = arm_of(robot), arm_of(ROBOT)
    assert isinstance(meshes, MeshArm)
    assert isinstance(hulls, HullArm)
    sample = samples(1)[0]
    links = list(meshes.poses(sample))[:8]
    for mesh, hull in zip(links, list(hulls.poses(sample))[:8], strict=True):
        assert mesh.position == pytest.approx(hull.position, abs=1e-6)
        assert abs(np.dot(mesh.orientation, hull.orientation)) == pytest.approx(1.0, abs=1e-6)
    *_, left, right = meshes.poses(sample)
    assert np.linalg.norm(np.subtract(left.position, right.position)) == pytest.approx(0.08, abs=1e-6)
    beside = ("left_link3", 2, robot.hulls[2][2])
    both = arm_of(replace(robot, hulls=(*robot.hulls, beside)))
    assert len(both.parts) == len(meshes.parts) + 1
    assert list(both.poses(sample))[:-1] == list(meshes.poses(sample))
    carrier = list(hulls.poses(sample))[2]
    assert list(both.poses(sample))[-1].position == pytest.approx(carrier.position)
    monkeypatch.setattr(meshes_module, "data_folder", lambda: None)
    assert isinstance(arm_of(robot), HullArm)


@pytest.mark.parametrize(
    "text",
    [
        "<robot>",
        '<robot><link name="a"><visual><geometry><mesh filename="a.obj"/></geometry></visual></link></robot>',
    ],
)
def test_an_arm_whose_urdf_cannot_be_read_is_drawn_by_its_hulls(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    monkeypatch.setattr(meshes_module, "data_folder", lambda: tmp_path)
    assert isinstance(arm_of(replace(ROBOT, urdf="arm.urdf")), HullArm)


EXPECTED = Path(__file__).with_name("film_model.txt")
BODIES = ("body_parentid", "body_mocapid", "geom_bodyid", "geom_type", "geom_size", "geom_rgba", "geom_pos")
SHAPES = ("geom_quat", "geom_group", "geom_matid", "geom_contype", "geom_conaffinity", "geom_dataid")
LIGHTS = ("light_pos", "light_dir", "light_castshadow", "light_diffuse", "light_ambient", "light_specular")
PAINT = ("mat_rgba", "mat_texid", "mat_texrepeat", "mat_reflectance", "mat_specular", "mat_shininess")
TEXTURES = ("tex_type", "tex_height", "tex_width")


def test_the_model_of_a_picture() -> None:
    pytest.importorskip("pybullet_data")
    for name, urdf in (("hulls", ""), ("meshes", URDF)):
        whole = recording(3)
        joints = tuple(f"panda_joint{number}" for number in range(1, 8)) if urdf else ()
        robot = replace(ROBOT, urdf=urdf, urdf_joints=joints)
        film = FilmModel(Recording(replace(whole.stage, robot=robot), whole.samples), (320, 180))
        stances = stances_of([sample.people for sample in whole.samples])
        film.place(whole.samples[2], stances[2])
        model, data = film.model, film.data
        values = {one: getattr(model, one) for one in (*BODIES, *SHAPES, *LIGHTS, *PAINT, *TEXTURES)}
        values |= {one: getattr(data, one) for one in ("mocap_pos", "mocap_quat")}
        values["sum of all pixels of textures"] = int(model.tex_data.sum())
        for one in ("global_", "quality", "headlight", "map", "rgba"):
            of = getattr(model.vis, one)
            names = [part for part in dir(of) if not part.startswith("_")]
            values |= {f"{one}.{part}": getattr(of, part) for part in names}
        text = "".join(f"{one}: {described(value)}\n" for one, value in values.items())
        compare_with_section(EXPECTED, name, text)
