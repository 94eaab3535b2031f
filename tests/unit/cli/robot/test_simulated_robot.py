"""`aeros check-plant` holds a simulator to its promises with the robot of any site: sticking joints, too."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.cli.robot.simulated_robot import simulated_robot
from aeros.exit_codes import UsageError
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Trajectory
from aeros.sim.conformance.suite import CHECKS
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path

SITES = reference_site_path().parent
ROBOTS = SITES.parent / "robots"
FOLLOWS = "the_executed_motion_is_the_decided_one"


@pytest.fixture
def changed_site(tmp_path: Path) -> Path:
    """The site of the iiwa beside its robot file, which a test may change."""
    for suffix in (".yaml", "_hulls.json"):
        (tmp_path / f"kuka_iiwa14{suffix}").write_text((ROBOTS / f"kuka_iiwa14{suffix}").read_text())
    site = (SITES / "iiwa_cell.yaml").read_text()
    path = tmp_path / "cell.yaml"
    path.write_text(site.replace("robot: kuka_iiwa14", "robot: ./kuka_iiwa14.yaml", 1))
    return path


def _configuration(path: Path) -> Configuration:
    site = load_site(path, Diagnostics())
    assert site is not None
    return Configuration(site, {}, {}, "")


@pytest.mark.parametrize("site", ["panda_cell", "iiwa_cell", "fr3_cell"])
def test_each_joint_moves_far_enough_for_every_check(site: str) -> None:
    subject = simulated_robot("kinematic", _configuration(SITES / f"{site}.yaml"))
    with subject.plant() as plant:
        start = plant.observe()["joint_position"].value
        plan = plant.plan(subject.motion_action)
    assert isinstance(plan, Trajectory)
    targets = [subject.motion_action.parameters[f"q{number}"] for number in range(1, len(start) + 1)]
    assert min(abs(a - b) for a, b in zip(targets, start, strict=True)) > 0.1
    assert plan.duration >= 1.0
    assert subject.parallel_action.parameters["duration"] >= plan.duration + 0.5


def test_the_reference_robot_keeps_its_promises(capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ("--check", FOLLOWS, "--check", "close_is_idempotent")
    assert main(["check-plant", "kinematic", *chosen]) == 0
    assert "2 of 2 promises kept" in capsys.readouterr().out


@pytest.mark.physics
@pytest.mark.deep
@pytest.mark.parametrize("plant", ["physics", "mujoco"])
@pytest.mark.parametrize("site", ["panda_cell", "iiwa_cell", "fr3_cell"])
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_each_shipped_robot_keeps_each_promise_on_motors(plant: str, site: str, check: object) -> None:
    subject = simulated_robot(plant, _configuration(SITES / f"{site}.yaml"))
    assert callable(check)
    check(subject)


@pytest.mark.physics
def test_joints_that_stick_are_noticed(changed_site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = changed_site.with_name("kuka_iiwa14.yaml")
    sticking = robot.read_text().replace("dry_friction: 0.2", "dry_friction: 100")
    assert sticking != robot.read_text()
    robot.write_text(sticking)
    assert main(["check-plant", "mujoco", "--site", str(changed_site), "--check", FOLLOWS]) == 1
    assert "`motion_action` was not completed: blocked: the arm is held back" in capsys.readouterr().out


def test_an_arm_without_room_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.cli.robot.simulated_robot.find_self_contact", lambda *_: ("link3", "link7"))
    with pytest.raises(UsageError, match="no motion of `kuka_iiwa14`"):
        simulated_robot("kinematic", _configuration(SITES / "iiwa_cell.yaml"))


def test_a_robot_that_cannot_be_read_is_refused_with_its_line(
    changed_site: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed_site.with_name("kuka_iiwa14.yaml").write_text("schema: aeros/robot/1\n")
    assert main(["check-plant", "kinematic", "--site", str(changed_site)]) == 1
    assert "kuka_iiwa14.yaml:1" in capsys.readouterr().err
