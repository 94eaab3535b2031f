"""The plant `franka` against franka-sim, over the network protocol of the real robot, on loopback.

The server enforces motion limits and communication constraints as the robot does. It has neither contacts nor
a stop button: contact reflexes and the robot's own stop are tested with a stub in `tests/unit/franka`. The
monitor may be late by half a second here, as other work keeps the machine busy; its cell allows 20 ms.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import read_settings
from aeros.runtime.ports import MotionCompletion, Trajectory
from aeros.sim.conformance.suite import CHECKS
from aeros.sim.robot.robot_file import robot_of
from aeros.skill import Action
from aeros.spec.model.site import Site
from tests.franka_sim.server import OBJECT_WIDTH, Installation, install, running
from tests.repo.tree import ROOT
from tests.unit.franka.test_settings import site_of
from tests.unit.franka.test_subject import patient_cell

pytestmark = pytest.mark.deep

AEROS = Path(sys.executable).parent / "aeros"
ENVIRONMENT = {"AEROS_FRANKA": "127.0.0.1", "AEROS_FRANKA_REALTIME": "ignore"}
START = (0.0, -0.6, 0.0, -2.1, 0.0, 1.5, 0.785)


@pytest.fixture(scope="session")
def installation(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return install(shared / "franka_sim")


@pytest.fixture
def server(
    installation: Installation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[subprocess.Popen[bytes]]:
    monkeypatch.setenv("PYTHONPATH", str(installation.library))
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with running(installation, tmp_path) as process:
        yield process


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    return patient_cell(tmp_path)


@pytest.fixture
def site(cell: Path) -> Site:
    return site_of(cell.read_text(), cell.parent)


@contextmanager
def connected(site: Site, patience: float | None = None) -> Iterator[FrankaPlant]:
    """A plant whose arm stands at the start."""
    settings = read_settings(os.environ, site)
    if patience is not None:
        settings = replace(settings, patience=patience)
    with closing(FrankaPlant(settings, robot_of(site), (0.0, 0.0, 0.0), site.state)) as plant:
        assert run(plant, move(0.0)).completed
        yield plant


def move(by: float) -> Action:
    joints = {f"q{number}": q + by for number, q in enumerate(START, 1)}
    return Action("move_joints", {**joints, "speed": 0.15})


def run(
    plant: FrankaPlant, action: Action, do: Callable[[], None] = lambda: None, after: float = 0.5
) -> MotionCompletion:
    """Do an action; `do` is called once, `after` seconds later."""
    since: list[float] = []

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        since.append(now)
        if now - since[0] >= after and since[-2] - since[0] < after:
            do()

    motion = plant.begin(action)
    assert not isinstance(motion, MotionCompletion), motion
    return plant.advance(monitor, plant.now() + 60.0)[motion]


def aeros(*arguments: str, folder: Path, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(AEROS), *arguments], cwd=folder, capture_output=True, text=True, timeout=timeout, check=False
    )


@pytest.fixture
def modules(tmp_path: Path, cell: Path) -> Path:
    """The example of the documentation, proved for the cell."""
    folder = tmp_path / "modules"
    shutil.copytree(ROOT / "docs/examples/visit_points", folder / "visit_points")
    done = aeros("verify", str(folder), "--site", str(cell), folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def task(cell: Path, modules: Path) -> list[str]:
    plant = ["--plant", "franka", "--site", str(cell)]
    return ["run", "visit the points", *plant, "--ecms", str(modules), "--out", "run", "--state", "state"]


def wait_until_it_moves(folder: Path) -> None:
    latest = time.monotonic() + 120.0
    record = folder / "run/audit.jsonl"
    while not (record.exists() and '"step-began"' in record.read_text()):
        assert time.monotonic() < latest
        time.sleep(0.05)
    time.sleep(1.5)


def test_the_plant_keeps_every_promise_of_its_port(
    server: subprocess.Popen[bytes], cell: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AEROS_FRANKA_SITE", str(cell))
    # On a busy machine the simulator shows a state twice, or 20 commands in a row are late: tried again.
    failing, failures = [check.__name__ for check in CHECKS], {}
    for _ in range(3):
        chosen = [word for name in failing for word in ("--check", name)]
        done = aeros("check-plant", "franka", "--format", "json", *chosen, folder=tmp_path, timeout=1200.0)
        assert done.stdout, done.stderr
        checks = json.loads(done.stdout)["checks"]
        assert len(checks) == len(failing)
        failures = {one["check"]: one["failure"] for one in checks if one["failure"]}
        failing = list(failures)
        if not failing:
            return
    assert failures == {}


def test_the_agent_reaches_its_goal(
    server: subprocess.Popen[bytes], cell: Path, modules: Path, tmp_path: Path
) -> None:
    done = aeros(*task(cell, modules), folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "goal reached" in done.stdout
    # Where the machine is busy, the simulated arm lags and catches up; it is stopped, and the agent retries.
    assert " 0 denied" in done.stdout
    assert "chain sound" in done.stdout


def test_a_person_stops_the_agent_in_mid_motion(
    server: subprocess.Popen[bytes], cell: Path, modules: Path, tmp_path: Path
) -> None:
    agent = subprocess.Popen(
        [str(AEROS), *task(cell, modules)],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait_until_it_moves(tmp_path)
    assert aeros("stop", "--state", "state", folder=tmp_path).returncode == 0
    output, _ = agent.communicate(timeout=120.0)
    assert agent.returncode not in (0, 4), output
    assert "Traceback" not in output
    assert "stopped" in output


def test_a_server_that_dies_in_mid_motion_ends_the_run_with_the_reason(
    server: subprocess.Popen[bytes], cell: Path, modules: Path, tmp_path: Path
) -> None:
    agent = subprocess.Popen(
        [str(AEROS), *task(cell, modules)],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait_until_it_moves(tmp_path)
    server.kill()
    output, _ = agent.communicate(timeout=120.0)
    assert agent.returncode == 4, output
    assert "aeros: the plant is lost: the robot cannot be reached: libfranka: UDP receive: Timeout" in output
    assert "Traceback" not in output


def test_twenty_lost_cycles_are_a_reflex_which_only_a_person_clears(
    server: subprocess.Popen[bytes], site: Site
) -> None:
    with connected(site) as plant:

        def pause() -> None:
            os.kill(plant.arm_process, signal.SIGSTOP)
            time.sleep(0.3)
            os.kill(plant.arm_process, signal.SIGCONT)

        end = run(plant, move(0.3), pause)
        assert "`communication_constraints_violation`, 20 commands in a row did not reach" in str(end.reason)
        plant.advance(lambda now, values: None, plant.now() + 0.1)
        refusal = plant.plan(move(0.0))
        assert isinstance(refusal, MotionCompletion)
        assert str(refusal.reason).startswith("reflex: ")
    cleared = subprocess.run(
        [sys.executable, "-m", "aeros.franka.recover"],
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    # The simulator, unlike the robot, forgets a reflex when its client leaves.
    assert cleared.returncode == 0, cleared.stdout
    assert cleared.stdout.endswith("and is idle\n")
    with connected(site) as plant:
        assert run(plant, move(0.1)).completed


def test_a_motion_beyond_the_limits_is_a_reflex(server: subprocess.Popen[bytes], site: Site) -> None:
    with connected(site) as plant:
        plan = plant.plan(move(0.3))
        assert isinstance(plan, Trajectory)
        # As no gate would allow it.
        hasty = replace(plan, duration=0.1)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(plant, "plan", lambda action: hasty)
            plant._planned = hasty
            end = run(plant, move(0.3))
        assert "the robot stopped by itself" in str(end.reason)
        assert "a commanded joint" in str(end.reason)


def test_a_monitor_that_hangs_makes_the_streaming_process_brake(
    server: subprocess.Popen[bytes], site: Site
) -> None:
    with connected(site, patience=0.1) as plant:
        end = run(plant, move(0.3), lambda: time.sleep(1.0))
        assert str(end.reason).startswith("late: the monitor has judged nothing for 10")
        # It stood still long before the monitor came back, and not in a reflex.
        assert plant.observe()["joint_position"].value[0] < 0.3
        assert run(plant, move(0.0)).completed


def test_an_agent_that_is_killed_leaves_an_arm_that_has_braked(
    server: subprocess.Popen[bytes], cell: Path, modules: Path, tmp_path: Path, site: Site
) -> None:
    agent = subprocess.Popen([str(AEROS), *task(cell, modules)], cwd=tmp_path, stdout=subprocess.DEVNULL)
    wait_until_it_moves(tmp_path)
    agent.kill()
    agent.wait()
    time.sleep(1.0)
    # Without commands the robot would stand in a reflex: it got its set points until it rested.
    settings = replace(read_settings(os.environ, site), has_hand=False)
    with closing(FrankaPlant(settings, robot_of(site), (0.0, 0.0, 0.0), site.state)) as plant:
        stood = plant.observe()["joint_position"].value
        time.sleep(0.5)
        assert plant.observe()["joint_position"].value == pytest.approx(stood, abs=1e-3)
    log = (tmp_path / "server.log").read_text(errors="replace")
    assert "Control session ended (motion finished)" in log
    assert "communication_constraints" not in log


def test_the_hand_grips_what_is_there(server: subprocess.Popen[bytes], site: Site) -> None:
    with connected(site) as plant:
        assert run(plant, Action("grip", {"width": 0.0, "force": 20.0})).completed
        readings = plant.observe()
        assert readings["holding"].value is True
        assert readings["finger_gap"].value == pytest.approx(OBJECT_WIDTH, abs=0.002)
        assert run(plant, Action("grip", {"width": 0.08, "force": 20.0})).completed
        assert plant.observe()["holding"].value is False
