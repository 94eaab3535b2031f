"""An agent reaches for points on a robot that a controller in a foreign process moves."""

from __future__ import annotations

import shutil
import signal
import time
from itertools import pairwise

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT
from tests.unit.ros2_control.foreign.stub import VARIABLES, stub_controller
from tests.unit.ros2_control.test_settings import CELL
from tests.unit.runtime.bus.ros2.foreign.environments import Domain

START = (0.0, -0.25, 0.0, -2.0, 0.0, 1.75, 0.785)
"""Where the arm stands at the start, rad: the tool points down."""


@pytest.fixture
def task(domain: Domain) -> list[str]:
    """The example of the documentation, and the command that runs it."""
    shutil.copytree(ROOT / "docs/examples/visit_points", domain.folder / "modules/visit_points")
    text = CELL.read_text().replace("missing: refuse", "missing: warn")
    (domain.folder / "cell.yaml").write_text(text, encoding="utf-8")
    domain.variables.update(VARIABLES)
    verify = ["verify", str(domain.folder / "modules"), "--site", str(domain.folder / "cell.yaml"), "-q"]
    assert main(verify) == Exit.SUCCESS
    plant = ["--plant", "ros2-control", "--site", "cell.yaml"]
    return ["run", "visit the points", *plant, "--out", "out", "--state", "state"]


@pytest.mark.deep
def test_the_agent_reaches_its_goal(domain: Domain, task: list[str]) -> None:
    with stub_controller(domain, start=START) as stub:
        with domain.robot(*task, is_on_ros2=False, ecms=domain.folder / "modules") as robot:
            assert robot.wait(timeout=240.0) == 0, robot.communicate()[0]
        accepted, ended = stub.events("accepted"), stub.events("ended")
    decided = [one["details"] for one in domain.events() if one["event"] == "decision"]
    assert [one["asked"]["kind"] for one in decided] == ["move_tool"] * 4
    # One goal for each decided motion, and no other; each begins where the one before has ended.
    assert len(accepted) == len(ended) == 4
    assert {one["code"] for one in ended} == {0}
    for before, one in pairwise(accepted):
        assert one["first"] == pytest.approx(before["last"], abs=1e-3)
    assert "goal reached" in domain.output


@pytest.mark.deep
def test_ctrl_c_brakes_the_arm(domain: Domain, task: list[str]) -> None:
    with (
        stub_controller(domain, start=START) as stub,
        domain.robot(*task, is_on_ros2=False, ecms=domain.folder / "modules") as robot,
    ):
        latest = time.monotonic() + 120.0
        while not stub.log.exists() or not stub.events("accepted"):
            assert time.monotonic() < latest
            time.sleep(0.05)
        time.sleep(1.0)
        robot.send_signal(signal.SIGINT)
        robot.wait(timeout=60.0)
        time.sleep(0.5)
        assert len(stub.events("accepted")) == 2
        assert [one["code"] for one in stub.events("ended")] == [0]
