"""Scene files: everything they say is in the scene, and every fault is reported at its place."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import (
    GREY,
    Basin,
    BodyPart,
    BodyVariation,
    Box,
    Compound,
    Cylinder,
    ForceInstrument,
    Grip,
    Joint,
    JointInstrument,
    LoadInstrument,
    PositionInstrument,
    Region,
    RobotMount,
    Scene,
    SceneVariation,
    Sphere,
    UrdfModel,
)
from aeros.spec.scenes import load as load_module
from aeros.spec.scenes.load import (
    add_scene,
    known_scenes,
    load_scene,
    provided_scenes,
    require_robot,
    shipped_scenes,
)
from tests.shipped_scenes import FOLDERS, SHIPPED, shipped_scene

MODEL = """<robot name="vase"><link name="a">
<inertial><mass value="0.8"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry>
<cylinder radius="0.05" length="0.2"/>
</geometry></collision></link>
<link name="lid"/><joint name="hinge" type="revolute"><parent link="a"/><child link="lid"/></joint></robot>
"""

BODIES = """bodies:
  crate: {box: [10 cm, 0.2 m, 300 mm], at: [1 m, -1 m, 15 cm], yaw: 1 rad, colour: [1, 1, 0]}
  bottle: {cylinder: [3 cm, 20 cm], at: [1 m, 1 m, 0.1 m], mass: 500 g, friction: 0.3,
    rolling_resistance: 1 mm}
  ball: {sphere: 3 cm, at: [0 m, 0 m, 5 cm], from: crate, mass: 100 g,
    spread: [1 cm, 0 m, 0 m], stream: any_name}
  pot: {basin: [10 cm, 8 cm, 5 cm], at: [0 m, 0 m, 0 m]}
  hammer:
    compound:
    - {cylinder: [1 cm, 20 cm], at: [0 m, 0 m, 0 m]}
    - {box: [8 cm, 3 cm, 3 cm], at: [0 m, 0 m, 10 cm]}
    at: [0 m, 0 m, 1 m]
    mass: 300 g
    grip: {low: [-1 cm, -1 cm, -9 cm], high: [1 cm, 1 cm, 5 cm]}
  vase:
    urdf: vase.urdf
    at: [0 m, 1 m, 0 m]
    links: {lid: 0.9}
    joints: {hinge: {friction: 5 mN*m, range: [0 rad, 1 rad]}}
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., str]:
    """Writes a scene file, with a model beside it."""

    def made(text: str, name: str = "scene.yaml", model: str = MODEL) -> str:
        (tmp_path / "vase.urdf").write_text(model)
        path = tmp_path / name
        path.write_text(f"schema: aeros/scene/2\ndescription: Things.\n{text}")
        return str(path)

    return made


Write = Callable[..., str]


def refused(name_or_path: str) -> Diagnostic:
    with pytest.raises(UserError) as error:
        load_scene(name_or_path)
    (found,) = error.value.diagnostics
    return found


def test_a_file_says_all_of_a_body(write: Write, tmp_path: Path) -> None:
    scene = load_scene(write(BODIES))
    crate, bottle, ball, pot, hammer, vase = scene.bodies.values()
    assert (crate.shape, crate.placement.position, crate.placement.yaw) == (
        Box((0.1, 0.2, 0.3)),
        (1.0, -1.0, 0.15),
        1.0,
    )
    assert (crate.mass, crate.colour, crate.grip) == (0.0, (1.0, 1.0, 0.0), None)
    assert (bottle.shape, bottle.mass, bottle.friction) == (Cylinder(0.03, 0.2), 0.5, 0.3)
    assert (bottle.rolling_resistance, bottle.spinning) == (0.001, 0.02)
    assert bottle.grip == Grip((-0.03, -0.03, -0.1), (0.03, 0.03, 0.1))
    assert (ball.shape, ball.placement.frame, ball.placement.spread) == (Sphere(0.03), "crate", (0.01, 0, 0))
    assert (ball.placement.stream, bottle.placement.stream) == ("any_name", "bottle")
    assert pot.shape == Basin((0.1, 0.08, 0.05))
    assert isinstance(hammer.shape, Compound)
    assert [part.position[2] for part in hammer.shape.parts] == [0.0, 0.1]
    assert hammer.grip == Grip((-0.01, -0.01, -0.09), (0.01, 0.01, 0.05))
    assert isinstance(vase.shape, UrdfModel)
    assert (vase.shape.path, vase.shape.links) == (str(tmp_path / "vase.urdf"), ("a", "lid"))
    assert (vase.shape.joints, vase.shape.link_friction) == ({"hinge": "revolute"}, {"lid": 0.9})
    assert vase.shape.joint_settings == {"hinge": Joint(0.005, (0.0, 1.0))}
    assert (vase.colour, vase.is_movable) == (GREY, False)
    assert scene.movable == ("bottle", "ball", "hammer")


def test_instruments_regions_and_conditions_name_bodies_links_and_joints(write: Write) -> None:
    scene = load_scene(
        write(
            BODIES
            + "places:\n  goal: {at: [1 m, 2 m, 3 m]}\n"
            + "instruments:\n"
            + "  push: {force: [crate, vase.lid]}\n  rests: {load: vase}\n"
            + "  lid: {position: vase.lid}\n  turn: {joint: vase.hinge}\n"
            + "regions:\n  near: {of: goal, low: [-1 m, -1 m, -1 m], high: [1 m, 1 m, 1 m]}\n"
            + "conditions:\n  open: vase.hinge > 20 deg\n"
            + "timers:\n  drying: {while: open}\n"
            + "truth:\n"
            + "  done: drying.longest > 2 s and ball.position in near and bottle.position not in pot\n"
            + "  again: done and push > 1 N and distance(ball.position, goal) < 1 m and not ball.held\n"
        )
    )
    assert scene.instruments == {
        "push": ForceInstrument(BodyPart("crate"), BodyPart("vase", "lid")),
        "rests": LoadInstrument(BodyPart("vase")),
        "lid": PositionInstrument(BodyPart("vase", "lid")),
        "turn": JointInstrument(BodyPart("vase", "hinge")),
    }
    assert {name for name, _ in scene.measured()} == {
        "goal",
        "rests",
        "lid",
        "turn",
    }  # nothing measures `push`
    assert scene.regions == {"near": Region("goal", (-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))}
    assert scene.truth["again"].text.startswith("done and")


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
        ("{urdf: vase.urdf, at: [1 m, 1 m, 1 m], links: {cap: 1}}", "AE122", "the model has no link `cap`"),
        ("{urdf: vase.urdf, at: [1 m, 1 m, 1 m], joints: {lid: {}}}", "AE122", "no movable joint `lid`"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 m], from: crate}", "AE122", "no place or body `crate`"),
        ("{box: [1 m, 1 m, 1 m], at: [1 m, 1 m, 1 m], weight: 1 kg}", "AE101", "unknown field `weight`"),
    ],
)
def test_an_invalid_body_is_reported_at_its_place(body: str, code: str, message: str, write: Write) -> None:
    found = refused(write(f"bodies:\n  it: {body}\n"))
    assert found.code == code
    assert message in found.headline
    assert found.primary is not None
    assert found.primary.span.line == 4


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("truth: {done: bal.position in pot}", "AE202", "is no position of this scene"),
        ("truth: {done: ball.colour == 1}", "AE202", "`ball` has no `colour`"),
        ("truth: {done: ball.position in pit}", "AE202", "`pit` is no region of this scene"),
        ("truth: {done: ball.yaw > 1 m}", "AE204", ""),
        ("truth: {done: ball.yaw}", "AE203", ""),
        ("truth: {done: ball.position in pot, done2: cooking > 1 s}", "AE202", "`cooking` is not declared"),
        ("instruments: {f: {force: [ball, vase.hinge]}}", "AE122", "`vase.hinge` is no link of this scene"),
        ("instruments: {f: {joint: vase.lid}}", "AE122", "`vase.lid` is no joint of this scene"),
        ("instruments: {f: {joint: vase.hinge, position: ball}}", "AE208", "exactly one of"),
        ("instruments: {ball: {position: ball}}", "AE121", "`ball` is already a body"),
        ("regions: {pot: {low: [0 m, 0 m, 0 m], high: [1 m, 1 m, 1 m]}}", "AE121", "already a body"),
        ("regions: {r: {low: [0 m, 0 m, 0 m], high: [1 m, 0 m, 1 m]}}", "AE208", "is below"),
        (
            "cameras: {eye: {eye: [0 m, 0 m, 0 m], target: [1 m, 0 m, 0 m], field_of_view: 180 deg}}",
            "AE208",
            "",
        ),
        ("cameras: {eye: {eye: [0 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}}", "AE208", "another way than `up`"),
        ("cameras: {eye: {eye: [0 m, 0 m, 1 m], target: [0 m, 0 m, 1 m]}}", "AE208", "away from its `eye`"),
        ("robot: {mount: wheels}", "AE110", "`wheels` is not one of the allowed words"),
    ],
)
def test_an_invalid_thing_is_reported_at_its_place(text: str, code: str, message: str, write: Write) -> None:
    found = refused(write(f"{BODIES}{text}\n"))
    assert (found.code, message in found.headline) == (code, True), found.headline
    assert found.primary is not None
    assert found.primary.span.line == 3 + BODIES.count("\n")


def test_a_cell_is_put_together_from_files_and_may_use_their_names(write: Write) -> None:
    write(
        "bodies:\n  can: {cylinder: [2 cm, 5 cm], at: [1 m, 0 m, 25 mm], mass: 80 g}\n"
        "  bin: {basin: [10 cm, 10 cm, 5 cm], at: [0 m, 0 m, 0 m]}\n"
        "places: {goal: {at: [1 m, 1 m, 0 m]}}\n"
        "conditions: {tidy: can.position in bin}\n"
        "truth: {sorted: tidy}\n",
        "part.yaml",
    )
    scene = load_scene(
        write(
            "robot: {mount: bench}\nview: {eye: [1 m, 1 m, 1 m], target: [0 m, 0 m, 0 m]}\n"
            "include:\n  - {scene: part.yaml, prefix: left_, at: [0 m, 2 m, 0 m]}\n  - {scene: part.yaml}\n"
            "truth: {both: sorted and left_sorted and left_can.position in bin}\n",
            "cell.yaml",
        )
    )
    assert list(scene.bodies) == ["left_can", "left_bin", "can", "bin"]
    assert scene.bodies["left_can"].placement.position == (1.0, 2.0, 0.025)
    assert scene.bodies["left_can"].placement.stream == "left_can"
    assert list(scene.truth) == ["left_sorted", "sorted", "both"]
    assert [(part.name, part.prefix) for part in scene.parts] == [
        ("cell", ""),
        ("part", "left_"),
        ("part", ""),
    ]
    assert len({part.digest for part in scene.parts}) == 2
    assert require_robot(scene) is scene
    assert scene.robot == RobotMount(False, (0.0, 0.0, 0.0))


def test_files_that_are_included_share_what_is_equal_and_keep_their_other_things_apart(write: Write) -> None:
    floor = "  floor: {box: [4 m, 4 m, 5 cm], at: [0 m, 0 m, -40 cm]}\n"
    for module, y in (("bolts", 0), ("wipes", 1)):
        write(
            f"module: {module}\nrobot: {{mount: carriage, at: [0 m, {y} m, 0 m]}}\n"
            f"view: {{eye: [1 m, {y} m, 1 m], target: [0 m, {y} m, 0 m]}}\n"
            f"places: {{dock: {{at: [0 m, {y} m, 0 m]}}}}\n"
            f"bodies:\n{floor}  can: {{sphere: 2 cm, at: [1 m, {y} m, 25 mm]}}\n"
            f"truth: {{done: can.position.z > 0 m}}\n",
            f"{module}.yaml",
        )
    cell = "include: [{scene: bolts.yaml}, {scene: wipes.yaml}]\n"
    scene = require_robot(load_scene(write(cell + "conditions: {up: bolts_can.position.z > 1 m}\n")))
    assert list(scene.bodies) == ["floor", "bolts_can", "wipes_can"]
    assert dict(scene.measured()) == {"bolts.dock": "bolts_dock", "wipes.dock": "wipes_dock"}
    assert list(scene.truth) == ["bolts.done", "wipes.done"]
    assert scene.robot == RobotMount(True, (0.0, 0.0, 0.0))
    apart = "include: [{scene: bolts.yaml}, {scene: bolts.yaml, at: [0 m, 3 m, 0 m]}]\n"
    with pytest.raises(UserError) as error:
        load_scene(write(apart))
    assert [one.headline for one in error.value.diagnostics] == [
        "`bolts.dock` is measured in the scene `bolts` and in `bolts`",
        "`bolts.done` of the scene `bolts` is already the truth of a state variable of `bolts`",
    ]
    assert all("include one of them with a `prefix`" in one.help[0] for one in error.value.diagnostics)


CAMERA = "{eye: [1 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}"


def test_a_scene_of_a_module_uses_the_modules_names_of_cameras(write: Write) -> None:
    write(f"module: kettle\ncameras: {{top: {CAMERA}, side: {CAMERA}}}\n", "part.yaml")
    whole = write(f"include: [{{scene: part.yaml}}]\ncameras: {{front: {CAMERA}}}\n", "cell.yaml")
    assert list(load_scene(whole).cameras) == ["top", "side", "front"]
    bound = {"kettle": {"top": "overhead", "front": "mast"}, "toaster": {"side": "hand"}}
    assert list(load_scene(whole, (), bound).cameras) == ["overhead", "side", "front"]
    added = add_scene(load_scene("bare"), whole, (), bound)
    assert added.cameras["overhead"] == load_scene(whole).cameras["top"]


def test_two_cameras_of_a_scene_cannot_be_bound_to_one(write: Write) -> None:
    path = write(f"module: kettle\ncameras: {{top: {CAMERA}, side: {CAMERA}}}\n")
    with pytest.raises(UserError) as error:
        load_scene(path, (), {"kettle": {"side": "top"}})
    (found,) = error.value.diagnostics
    assert (found.code, "`top` is already the camera" in found.headline) == ("AE121", True), found.headline
    assert found.primary is not None
    assert found.primary.span.text == "side"


@pytest.mark.parametrize(
    ("include", "code", "message"),
    [
        ("[{scene: part.yaml}, {scene: part.yaml}]", "AE208", "`part` is included twice at one place"),
        ("[{scene: cell.yaml}]", "AE208", "includes itself"),
        ("[{scene: absent.yaml}]", "AE002", "absent.yaml`, and no scene file"),
    ],
)
def test_an_include_that_cannot_be_is_reported_at_its_place(
    include: str, code: str, message: str, write: Write
) -> None:
    write("bodies:\n  can: {sphere: 2 cm, at: [1 m, 0 m, 25 mm]}\n", "part.yaml")
    found = refused(write(f"include: {include}\n", "cell.yaml"))
    assert (found.code, message in found.headline) == (code, True), found.headline
    assert found.primary is not None
    assert found.primary.span.line == 3


def test_two_robots_are_refused_unless_the_file_has_its_own(write: Write) -> None:
    write("robot: {mount: bench}\n", "one.yaml")
    write("robot: {mount: carriage}\n", "other.yaml")
    both = "include: [{scene: one.yaml}, {scene: other.yaml}]\n"
    assert (
        "the robot of the scene `other` is not put up as that of `one`"
        in refused(write(both, "cell.yaml")).headline
    )
    own = "robot: {mount: carriage, at: [0 m, 0 m, 1 m]}\n"
    assert load_scene(write(own + both, "cell.yaml")).robot == RobotMount(True, (0.0, 0.0, 1.0))


def test_a_scene_without_a_robot_only_adds_to_others() -> None:
    with pytest.raises(UserError, match="the scene `shelf_behind` has no `robot`"):
        require_robot(load_scene("shelf_behind"))
    whole = add_scene(shipped_scene("fetch"), "shelf_behind")
    assert list(whole.bodies) == [*shipped_scene("fetch").bodies, "shelf", "crate", "bottle"]
    with pytest.raises(UserError, match="`can` of the scene `table` is already a body of `fetch`"):
        add_scene(shipped_scene("fetch"), "table", FOLDERS)


def test_a_modules_scene_goes_before_one_of_aeros_and_that_before_other_modules(tmp_path: Path) -> None:
    for module, names in (("own", ("bare", "mine")), ("other", ("mine", "shelf_behind", "theirs"))):
        (tmp_path / module / "scenes").mkdir(parents=True)
        for name in names:
            (tmp_path / module / "scenes" / f"{name}.yaml").touch()
    known = known_scenes([str(tmp_path / "own"), str(tmp_path / "other")])
    assert {name: path.parent.parent.name for name, path in known.items()} == {
        "bare": "own",
        "box_on_the_bench": "aeros",
        "mine": "own",
        "shelf_behind": "aeros",
        "theirs": "other",
    }


def test_every_shipped_file_is_read_by_its_name() -> None:
    for name, path in shipped_scenes().items():
        assert load_scene(name) == load_scene(str(path))
    for name in SHIPPED:
        scene: Scene = shipped_scene(name)
        assert scene.robot is not None
        assert scene.name == name
    assert refused("shelf_behynd").help == ("did you mean `shelf_behind`?",)


def test_a_file_of_the_first_version_is_refused_with_its_migration(tmp_path: Path) -> None:
    path = tmp_path / "old.yaml"
    path.write_text("schema: aeros/scene/1\ndescription: Old.\nbodies: {}\n")
    found = refused(str(path))
    assert found.code == "AE114"
    assert found.help[0] == f"run `aeros migrate {path}`"


@pytest.mark.parametrize(
    ("old", "new", "code", "line"),
    [
        ('value="0.8"', 'value="nan"', "AE108", 2),
        ('radius="0.05"', 'radius="-1"', "AE111", 4),
        ("<cylinder", '<mesh filename="vase.stl"/><cylinder', "AE002", 4),
        ("<robot", "<!DOCTYPE robot><robot", "AE141", 1),
    ],
)
def test_a_model_that_is_none_is_refused_at_its_place(
    old: str, new: str, code: str, line: int, write: Write, tmp_path: Path
) -> None:
    found = refused(
        write("bodies: {it: {urdf: vase.urdf, at: [1 m, 1 m, 1 m]}}\n", model=MODEL.replace(old, new))
    )
    assert found.code == code
    assert found.primary is not None
    assert (found.primary.span.source.path, found.primary.span.line) == (str(tmp_path / "vase.urdf"), line)


# Scenes of other distributions.


def _provide(monkeypatch: pytest.MonkeyPatch, name: str, load: Callable[[EntryPoint], object]) -> None:
    entry = EntryPoint(name, "my_package:SCENE", "aeros.scenes")
    monkeypatch.setattr(EntryPoint, "load", load)
    monkeypatch.setattr(
        load_module, "entry_points", lambda group: (entry,) if group == "aeros.scenes" else ()
    )
    monkeypatch.setattr(load_module, "provided_scenes", provided_scenes.__wrapped__)


def test_an_installed_distribution_provides_a_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "crate.yaml"
    path.write_text("schema: aeros/scene/2\ndescription: a crate\n", encoding="utf-8")
    _provide(monkeypatch, "my_crate", lambda _: str(path))
    assert load_scene("my_crate").description == "a crate"


def test_a_distribution_cannot_replace_a_shipped_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _provide(monkeypatch, "bare", lambda _: str(tmp_path))
    assert known_scenes()["bare"] == shipped_scenes()["bare"]


def test_a_scene_that_a_distribution_names_and_lacks_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: EntryPoint) -> object:
        raise ModuleNotFoundError("No module named 'my_package'")

    _provide(monkeypatch, "my_crate", fail)
    with pytest.raises(UserError) as error:
        load_scene("my_crate")
    (found,) = error.value.diagnostics
    assert "`my_crate`" in found.headline
    assert "my_package" in found.headline


# Ranges.


_CRATE = """schema: aeros/scene/2
description: a crate
randomise: {light: [0.5, 2]}
bodies:
  crate: {box: [10 cm, 10 cm, 10 cm], at: [1 m, 0 m, 5 cm]MASS, randomise: RANGES}
"""


@pytest.mark.parametrize(
    ("mass", "ranges", "text"),
    [
        (", mass: 1 kg", "{mass: [2, 0.5]}", "the first factor is at most the second"),
        ("", "{mass: [0.5, 2]}", "a body that is fixed to W has no mass to vary"),
        (", mass: 1 kg", "{mass: [0, 2]}", "0"),
        (", mass: 1 kg", "{weight: [1, 2]}", "weight"),
    ],
)
def test_a_range_that_is_none_is_reported(tmp_path: Path, mass: str, ranges: str, text: str) -> None:
    path = tmp_path / "crate.yaml"
    path.write_text(_CRATE.replace("MASS", mass).replace("RANGES", ranges), encoding="utf-8")
    with pytest.raises(UserError) as error:
        load_scene(str(path))
    assert any(text in one.headline for one in error.value.diagnostics)


def test_ranges_stay_with_their_bodies_when_scenes_are_put_together(tmp_path: Path) -> None:
    path = tmp_path / "crate.yaml"
    path.write_text(
        _CRATE.replace("MASS", ", mass: 1 kg").replace("RANGES", "{mass: [0.5, 2]}"), encoding="utf-8"
    )
    outer = tmp_path / "outer.yaml"
    outer.write_text(
        "schema: aeros/scene/2\ndescription: two\ninclude:\n"
        "  - {scene: crate.yaml, prefix: left_}\n"
        "  - {scene: crate.yaml, prefix: right_, at: [0 m, 1 m, 0 m]}\n",
        encoding="utf-8",
    )
    found = load_scene(str(outer))
    assert found.variation == SceneVariation(light=(0.5, 2.0))
    assert {name: one.variation for name, one in found.bodies.items()} == {
        "left_crate": BodyVariation(mass=(0.5, 2.0)),
        "right_crate": BodyVariation(mass=(0.5, 2.0)),
    }
