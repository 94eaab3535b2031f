"""A robot file is read as it is written, and every fault of it has a place, a cause and a cure."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.sim.robot import robot_file
from aeros.sim.robot.robot_file import known_robots, read_robot, reference_robot, robot_of
from aeros.sim.shipped_files import shipped_files
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site

PANDA_FILE = shipped_files("robots")["panda"]
TEXT = PANDA_FILE.read_text(encoding="utf-8")

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write the Panda's file with a change, beside its hulls with a change."""

    def changed(old: str = "", new: str = "", *, hulls: Callable[[Any], Any] | None = None) -> Path:
        assert old in TEXT
        data = json.loads(PANDA_FILE.with_name("panda_hulls.json").read_text(encoding="utf-8"))
        text = json.dumps(data if hulls is None else hulls(data))
        (tmp_path / "panda_hulls.json").write_text(text, encoding="utf-8")
        path = tmp_path / "arm.yaml"
        path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
        return path

    return changed


def faults_of(path: Path) -> list[Diagnostic]:
    with pytest.raises(UserError) as error:
        read_robot(str(path))
    return list(error.value.diagnostics)


def place_of(found: Diagnostic) -> tuple[str, int, str]:
    """The file, the line, and the text from the place on."""
    assert found.primary is not None
    span = found.primary.span
    return Path(span.source.path).name, span.line, span.source.text[span.start : span.end]


def test_the_shipped_robots_are_read_once() -> None:
    assert reference_robot() is reference_robot() is read_robot("panda")
    for name in shipped_files("robots"):
        assert read_robot(name).name == name


def test_a_copy_elsewhere_is_the_same_robot_with_another_identity(write: Write) -> None:
    copied = read_robot(str(write()))
    assert copied is not reference_robot()
    assert copied.body == reference_robot().body
    assert copied.servos == reference_robot().servos


def test_integers_are_numbers(write: Write) -> None:
    robot = read_robot(
        str(write("values: [15, 7.5, 10, 12.5, 15, 20, 20]", "values: [15, 7, 10, 12, 15, 20, 20]"))
    )
    assert robot.limits.acceleration.tolist() == [15.0, 7.0, 10.0, 12.0, 15.0, 20.0, 20.0]
    assert robot.limits.acceleration.dtype == np.float64


def test_units_are_converted(write: Write) -> None:
    degrees = read_robot(str(write("unit: rad/s\n    values: [2.175,", "unit: deg/s\n    values: [180,")))
    assert degrees.limits.speed[0] == pytest.approx(np.pi)
    assert read_robot(str(write("flange: 107 mm", "flange: 0.107 m"))).hand.flange == 0.107


@pytest.mark.parametrize(
    ("old", "new", "code", "cause", "text"),
    [
        (
            "2.61, 2.61, 2.61]",
            "2.61, 2.61]",
            "AE208",
            "this column has 6 values; the chain has 7 joints",
            "unit",
        ),
        ("2.61, 2.61, 2.61]", "2.61, 2.61, fast]", "AE108", "expected a number, found `fast`", "fast"),
        ("2.61, 2.61, 2.61]", "2.61, 2.61, -2.61]", "AE208", "`-2.61` is not above 0", "-2.61"),
        ("unit: rad/s\n", "unit: m/s\n", "AE208", "expected a unit of rad/s, found `m/s`", "m/s"),
        ("unit: rad/s\n", "unit: furlong\n", "AE207", "", "furlong"),
        ("[-2.8973, -1.7628", "[2.8973, -1.7628", "AE208", "of joint 1, 2.8973 rad, is not below", "unit"),
        ("speed: 1.7 m/s", "speed: 1.7", "AE204", "expected a value in m/s", "1.7"),
        ("speed: 1.7 m/s", "speed: 0 m/s", "AE208", "`0 m/s` is not above 0", "0 m/s"),
        (
            "link: link3, joint: 3",
            "link: elbow, joint: 3",
            "AE208",
            "there is no link `elbow`",
            "{link: elbow",
        ),
        ("link: link3, joint: 3", "link: link3, joint: 4", "AE208", "moved by 3 joints, not by 4", "4"),
        ("radius: 0.0755", "radius: 0", "AE208", "the radius of `link6` is not above 0 m", "0"),
        ("mass: 4.970684", "mass: 0", "AE208", "a link without mass", "mass"),
        ("lean: [0, 1,", "lean: [0, -1,", "AE208", "`-1` is below 0", "-1"),
        ("armature: 0.1", "armature: -0.1", "AE208", "`-0.1` is below 0", "-0.1"),
        ("lean: [0, 1,", "lean: [1,", "AE208", "`lean` has 6 values", "ready"),
        ("- [0, 0.6, 0,", "- [0.6, 0,", "AE208", "a row of `search` has 6 values", "ready"),
        ("joints: [panda_joint1, ", "joints: [", "AE208", "`joints` has 6 values", "path"),
        ("model: franka_hand", "model: suction", "AE110", "", "suction"),
        ("tool: 103.4 mm", "tool: 150 mm", "AE208", "the tool point is 150 mm from the flange", "150 mm"),
        ("tool: 103.4 mm", "tool: 20 mm", "AE208", "the fingers reach from 54.9 mm to 115.8 mm", "20 mm"),
        ("flange: 107 mm", "flange: 200 mm", "AE208", "the tool point is 103.4 mm from the flange", "103.4"),
        ("widest_gap: 80 mm", "widest_gap: 90 mm", "AE208", "the `franka_hand` opens to 80 mm", "90 mm"),
        ("hulls: panda_hulls.json", "hulls: none.json", "AE208", "cannot be read", "none.json"),
        ("turn: -0.785", "turn: 0.785", "AE208", "the tool does not point down", "unit"),
    ],
)
def test_a_fault_has_its_place_and_its_cause(
    old: str, new: str, code: str, cause: str, text: str, write: Write
) -> None:
    found = faults_of(write(old, new))[0]
    assert found.code == code
    assert cause in found.headline
    assert found.help or code != "AE208"
    name, line, there = place_of(found)
    assert name == "arm.yaml"
    assert there.startswith(text)
    assert line > 1


def test_every_fault_is_reported_at_once(write: Write) -> None:
    path = write("speed: 1.7 m/s", "speed: 0 m/s")
    path.write_text(path.read_text().replace("flange: 107 mm", "flange: 107"), encoding="utf-8")
    assert len(faults_of(path)) == 2


def test_a_posture_outside_the_limits_is_refused(write: Write) -> None:
    # Joint 4 of the ready posture is at -2.356 rad.
    found = faults_of(write("2.8973, -0.0698, 2.8973, 3.7525", "2.8973, -2.3562, 2.8973, 3.7525"))[0]
    assert found.headline == "in the ready posture joint 4 is less than 0.02 rad inside its limits"
    assert found.help


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda data: {**data, "hulls": data["hulls"][:-1]}, "lack `fingers`"),
        (lambda data: {**data, "hulls": [*data["hulls"], data["hulls"][0]]}, "has 2 hulls in"),
        (lambda data: {"hulls": data["hulls"]}, "exempt_pairs"),
        (lambda data: {**data, "hulls": [{**data["hulls"][0], "corners": [[0, 0, 0]]}]}, "fewer than 4"),
        (lambda data: {**data, "hulls": [{**data["hulls"][0], "joint": 3}]}, "not moved by 3 joints"),
        (lambda data: {**data, "hulls": [{**data["hulls"][0], "radius": "wide"}]}, "could not convert"),
        (lambda data: [], "cannot be read"),
    ],
)
def test_hulls_that_are_none_are_refused(change: Callable[[Any], Any], cause: str, write: Write) -> None:
    found = faults_of(write(hulls=change))[0]
    assert cause in found.headline
    assert place_of(found)[2] == "panda_hulls.json"


def test_a_name_that_nobody_knows_is_refused_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(UserError) as error:
        read_robot("pandas")
    (found,) = error.value.diagnostics
    assert (found.code, found.help) == ("AE002", ("did you mean `panda`?",))


# Robots of other distributions.


def entries(*values: EntryPoint) -> Callable[..., tuple[EntryPoint, ...]]:
    return lambda group: values if group == "aeros.robots" else ()


def test_an_installed_distribution_provides_a_robot(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("id: panda", "id: my_arm")
    entry = EntryPoint("my_arm", "my_package:ROBOT", "aeros.robots")
    monkeypatch.setattr(EntryPoint, "load", lambda self: str(path))
    monkeypatch.setattr(robot_file, "entry_points", entries(entry))
    assert known_robots()["my_arm"] == path
    assert read_robot("my_arm").name == "my_arm"


def test_a_distribution_cannot_replace_a_shipped_robot(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("panda", "my_package:ROBOT", "aeros.robots")
    monkeypatch.setattr(EntryPoint, "load", lambda self: str(write("id: panda", "id: other")))
    monkeypatch.setattr(robot_file, "entry_points", entries(entry))
    assert known_robots()["panda"] == PANDA_FILE
    assert read_robot("panda").name == "panda"


def test_an_entry_point_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("my_arm", "no_such_package_of_robots:ROBOT", "aeros.robots")
    monkeypatch.setattr(robot_file, "entry_points", entries(entry))
    with pytest.raises(UserError) as error:
        read_robot("my_arm")
    (found,) = error.value.diagnostics
    assert "`my_arm`" in found.headline
    assert "no_such_package_of_robots" in found.headline


# Sites.

SITE = (Path(__file__).parents[4] / "aeros" / "sites" / "panda_cell.yaml").read_text(encoding="utf-8")


def site_with(folder: Path, old: str = "", new: str = "") -> Site:
    path = folder / "cell.yaml"
    path.write_text(SITE.replace(old, new, 1), encoding="utf-8")
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    assert site is not None, list(diagnostics)
    return site


def test_a_site_names_its_robot_or_gets_that_of_the_reference_site(tmp_path: Path) -> None:
    assert robot_of(site_with(tmp_path)) is reference_robot()
    assert robot_of(site_with(tmp_path, "robot: panda\n")) is reference_robot()


def test_a_site_names_a_file_beside_it(tmp_path: Path, write: Write) -> None:
    write("id: panda", "id: my_arm")
    assert robot_of(site_with(tmp_path, "robot: panda\n", "robot: arm.yaml\n")).name == "my_arm"


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        (
            "[-2.8973, -1.7628,",
            "[-2.8974, -1.7628,",
            "position of joint 1, rad, of -2.8974; the robot's limit is",
        ),
        (
            "2.61, 2.61, 2.61]",
            "2.61, 2.61, 2.62]",
            "speed of joint 7, rad/s, of 2.62; the robot's limit is 2.61",
        ),
        ("[15, 7.5,", "[15, 7.6,", "acceleration of joint 2"),
        ("[7500, 3750,", "[7501, 3750,", "jerk of joint 1"),
        (
            "[0.99, 0.99, 0.745,",
            "[0.99, 0.99, 0.5,",
            "lever of joint 3 is 0.5; in the ready posture a link is 0.544 m from its axis",
        ),
        ("[link5, link6, link7,", "[link5, link6, link8,", "names `link8`; the robot has no such link"),
        (
            "finger_gap: {type: real, unit: m, range: [0, 0.1]",
            "finger_gap: {type: real, unit: m, range: [0, 0.07]",
            "`finger_gap` of the site ends at 0.07 m; the hand opens to 0.08 m",
        ),
    ],
)
def test_a_site_that_allows_more_than_its_robot_is_refused(
    old: str, new: str, cause: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError) as error:
        robot_of(site_with(tmp_path, old, new))
    (found,) = error.value.diagnostics
    assert cause in found.headline
    assert found.primary is not None
    assert found.primary.span.text == "robot: panda"
    assert found.help


def test_a_misfit_of_a_site_has_its_own_cure(tmp_path: Path) -> None:
    with pytest.raises(UserError) as error:
        robot_of(site_with(tmp_path, "[link5, link6, link7,", "[thumb, link9, elbow, link8,"))
    (found,) = error.value.diagnostics
    assert "names `elbow`, `link8`, `link9`, `thumb`; the robot has" in found.headline
    assert found.help[0].startswith("write `links` of `foot`, `link1`,")
    old = "finger_gap: {type: real, unit: m, range: [0, 0.1]"
    with pytest.raises(UserError) as error:
        robot_of(site_with(tmp_path, old, old.replace("0.1", "0.07")))
    (found,) = error.value.diagnostics
    assert found.help == ("let its `range` end at 0.08 or more",)


@pytest.mark.parametrize("site", ["panda_cell", "fr3_cell", "iiwa_cell"])
def test_no_posture_has_a_longer_lever_than_the_site_says(site: str) -> None:
    """Else links could be farther from their commands than the site's bound on tracking says."""
    loaded = load_site(Path(__file__).parents[4] / "aeros" / "sites" / f"{site}.yaml", Diagnostics())
    assert loaded is not None
    assert loaded.motion is not None
    assert loaded.motion.tracking is not None
    robot, random = robot_of(loaded), np.random.default_rng(5)
    stretched = np.zeros(robot.joint_count)  # with the elbow and the wrist straight, as far as they go
    postures = [random.uniform(robot.limits.lowest, robot.limits.highest) for _ in range(150)]
    for posture in (*postures, np.clip(stretched, robot.limits.lowest, robot.limits.highest)):
        levers = robot.levers_at(posture.tolist())
        assert all(np.array(loaded.motion.tracking.levers, float) >= levers)


def test_a_site_may_allow_less(tmp_path: Path) -> None:
    assert robot_of(site_with(tmp_path, "2.61, 2.61, 2.61]", "1, 1, 1]")) is reference_robot()
