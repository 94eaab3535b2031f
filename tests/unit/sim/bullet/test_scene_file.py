"""Scene files: what they say is built, and what cannot be built is refused before anything moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.sim.bullet import panda
from aeros.sim.bullet.bodies import GREY, Box, Cylinder, UrdfModel
from aeros.sim.bullet.scene_file import read_bodies, shipped_scenes
from aeros.sim.physics import make_plant
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError

pytestmark = pytest.mark.physics

ECMS = str(Path(__file__).parents[4] / "ecms")
MODEL = """<robot name="vase"><link name="a">
<inertial><mass value="0.8"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry>
<cylinder radius="0.05" length="0.2"/>
</geometry></collision></link></robot>
"""


def write(folder: Path, bodies: str, model: str = MODEL) -> str:
    (folder / "vase.urdf").write_text(model)
    path = folder / "scene.yaml"
    path.write_text(f"schema: aeros/scene/1\ndescription: Things.\nbodies:\n{bodies}")
    return str(path)


def refused(name_or_path: str) -> Diagnostic:
    with pytest.raises(UserError) as error:
        read_bodies(name_or_path)
    (found,) = error.value.diagnostics
    return found


def test_a_file_says_all_of_a_body(tmp_path: Path) -> None:
    crate, bottle, vase = read_bodies(
        write(
            tmp_path,
            "  crate: {box: [10 cm, 0.2 m, 300 mm], at: [1 m, -1 m, 15 cm], yaw: 1 rad, colour: [1, 1, 0]}\n"
            "  bottle: {cylinder: [3 cm, 20 cm], at: [1 m, 1 m, 0.1 m], mass: 500 g, friction: 0.3}\n"
            "  vase: {urdf: vase.urdf, at: [0 m, 1 m, 0 m]}\n",
        )
    )
    assert (crate.shape, crate.position, crate.yaw) == (Box((0.1, 0.2, 0.3)), (1.0, -1.0, 0.15), 1.0)
    assert (crate.mass, crate.colour) == (0.0, (1.0, 1.0, 0.0, 1.0))
    assert (bottle.shape, bottle.mass, bottle.friction) == (Cylinder(0.03, 0.2), 0.5, 0.3)
    assert (vase.shape, vase.colour) == (UrdfModel(str(tmp_path / "vase.urdf")), GREY)


@pytest.mark.parametrize(
    ("body", "code", "message"),
    [
        ("{at: [1 m, 1 m, 1 m]}", "AE208", "exactly one of"),
        ("{box: [1 m, 1 m, 1 m], urdf: vase.urdf, at: [1 m, 1 m, 1 m]}", "AE208", "`box` and `urdf`"),
        ("{box: [1 m, 1 m, .nan], at: [1 m, 1 m, 1 m]}", "AE207", "`.nan` is not a number"),
        ("{box: [1 m, 1 m, nan m], at: [1 m, 1 m, 1 m]}", "AE207", "`nan m` is not a number"),
        ("{box: [1 m, 1 m, 0 m], at: [1 m, 1 m, 1 m]}", "AE111", "outside its bounds"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1e999 m]}", "AE207", "is beyond"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 s]}", "AE204", "expected a value in m"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 m], mass: -1 kg}", "AE111", "outside its bounds"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 m], loose: true}", "AE208", "is only valid with `urdf`"),
        ("{urdf: vase.urdf, at: [1 m, 1 m, 1 m], mass: 1 kg}", "AE208", "the model's file sets its mass"),
        ("{urdf: vese.urdf, at: [1 m, 1 m, 1 m]}", "AE002", "vese.urdf`, the model of `it`"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 m], weight: 1 kg}", "AE101", "unknown field `weight`"),
    ],
)
def test_an_invalid_body_is_reported_at_its_place(body: str, code: str, message: str, tmp_path: Path) -> None:
    found = refused(write(tmp_path, f"  it: {body}\n"))
    assert found.code == code
    assert message in found.headline
    assert found.primary is not None
    assert found.primary.span.line == 4


@pytest.mark.parametrize(
    ("old", "new", "code", "line"),
    [
        ('value="0.8"', 'value="nan"', "AE108", 2),
        ('radius="0.05"', 'radius="-1"', "AE111", 4),
        ('length="0.2"', 'length="0.2 0.3"', "AE108", 4),
        ("<cylinder", '<mesh filename="vase.stl"/><cylinder', "AE002", 4),
        ("</link>", "", "AE141", 5),
        ("<robot", "<!DOCTYPE robot><robot", "AE141", 1),
        ("robot", "thing", "AE141", 1),
    ],
)
def test_a_model_that_is_none_is_refused_at_its_place(
    old: str, new: str, code: str, line: int, tmp_path: Path
) -> None:
    scene = write(tmp_path, "  it: {urdf: vase.urdf, at: [1 m, 1 m, 1 m]}\n", MODEL.replace(old, new))
    found = refused(scene)
    assert found.code == code
    assert found.primary is not None
    assert (found.primary.span.source.path, found.primary.span.line) == (str(tmp_path / "vase.urdf"), line)


def test_a_model_that_the_simulator_cannot_load_is_refused(tmp_path: Path) -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="nobody"/></joint></robot>'
    scene = write(
        tmp_path, "  it: {urdf: vase.urdf, at: [1 m, 1 m, 1 m]}\n", MODEL.replace("</robot>", joint)
    )
    with pytest.raises(UserError) as error:
        make_plant("bare", 0, bodies=read_bodies(scene))
    assert [found.code for found in error.value.diagnostics] == ["AE141"]


def test_bodies_that_overlap_are_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bodies = (
        "  crate: {box: [10 cm, 10 cm, 10 cm], at: [0 m, 2 m, 5 cm]}\n"
        "  bottle: {cylinder: [5 cm, 20 cm], at: [9 cm, 2 m, 10 cm], mass: 1 kg}\n"
        "  pole: {box: [5 cm, 5 cm, 1 m], at: [0 m, 0 m, 50 cm]}\n"
    )
    words = ["run", "fetch the object", "--ecms", ECMS, "--no-video", "--state", str(tmp_path / "state"),
             "--out", str(tmp_path / "out"), "--scene", write(tmp_path, bodies)]  # fmt: skip
    assert main(words) == Exit.REJECTED
    shown = capsys.readouterr().err
    assert "error[AE140] overlapping-bodies: `crate` and `bottle` overlap by 10.0 mm" in shown
    assert "`pole` and the robot overlap by" in shown
    assert f"{tmp_path}/scene.yaml:4:44" in shown
    assert not (tmp_path / "out").exists()


def test_bodies_that_stand_on_each_other_do_not_overlap_and_stay(tmp_path: Path) -> None:
    stacked = (
        "  crate: {box: [10 cm, 10 cm, 10 cm], at: [0 m, 2 m, 5 cm], mass: 1 kg}\n"
        "  vase: {urdf: vase.urdf, at: [0 m, 2 m, 20 cm], loose: true}\n"
    )
    plant = make_plant("fetch", 0, bodies=read_bodies(write(tmp_path, stacked)))
    assert plant._world.overlaps(0.0015) == []
    plant.close()


def test_every_shipped_file_is_read_by_its_name_and_stands_in_the_room() -> None:
    for name, path in shipped_scenes().items():
        assert read_bodies(name) == read_bodies(str(path))
        make_plant("fetch", 1, bodies=read_bodies(name)).close()
    assert refused("shelf_behynd").help == ("did you mean `shelf_behind`?",)


def test_a_robot_whose_own_model_is_missing_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(panda, "DATA", str(tmp_path))
    with pytest.raises(UserError) as error:
        make_plant("bare", 0)
    (found,) = error.value.diagnostics
    assert found.code == "AE002"
    assert "cannot be read: no such file" in found.headline


@pytest.mark.parametrize("plant", ["kinematic", "symbolic"])
def test_nothing_is_in_the_way_without_physics(
    plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "fetch the object", "--ecms", ECMS, "--plant", plant, "--scene", "shelf_behind",
             "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out")]  # fmt: skip
    assert main(words) == Exit.REJECTED
    assert "`--scene` needs the physics plant" in capsys.readouterr().err
