"""Environments for robots and peers on ROS 2: the wheels of PyPI, kept in the user's cache between runs.

The robot's environment sees the packages of this one behind its own; the peer's has no AEROS.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import secrets
import signal
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from aeros.apps.ros2.message_build import PACKAGES, build_digest, cache_folder
from tests.repo.tree import ROOT

PEER = Path(__file__).with_name("peer.py")
WHEELS = (
    "ros-common-interfaces==5.5.1",
    "ros-lifecycle-msgs==2.3.0",
    "ros-rclpy==9.1.2",
    "ros-rmw-fastrtps-cpp==9.3.3",
    "ros-rosgraph-msgs==2.3.0",
    "ros-std-srvs==5.5.1",
)


class Environments(NamedTuple):
    """Interpreters: of a robot, of a robot without `aeros_msgs`, and of a peer."""

    robot: Path
    plain_robot: Path
    peer: Path


def environments() -> Environments:
    """Make the environments, or find those of an earlier run."""
    key = "\0".join([*WHEELS, *map(build_digest, PACKAGES), sys.version, str(ROOT), sys.prefix, "3"])
    folder = cache_folder().parent / "ros2-tests" / hashlib.sha256(key.encode()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = Environments(*(folder / name / "bin" / "python" for name in Environments._fields))
        if not (folder / "ready").exists():
            for python in found:
                venv.create(python.parents[1], with_pip=True, symlinks=True, clear=True)
                _run([python, "-m", "pip", "install", "-q", *WHEELS])
            for robot in (found.robot, found.plain_robot):
                _see_this_environment(robot)
            _run([found.robot, "-m", "aeros", "ros2-messages", "--out", folder / "wheels"])
            built = sorted((folder / "wheels").glob("*.whl"))
            for python in (found.robot, found.peer):
                _run([python, "-m", "pip", "install", "-q", "--no-deps", *built])
            (folder / "ready").touch()
    return found


def cyclone_environment() -> Path:
    """Make an environment with Cyclone DDS alone, or find that of an earlier run; return its interpreter."""
    folder = cache_folder().parent / "ros2-tests" / f"cyclonedds-11.0.1-{sys.implementation.cache_tag}"
    folder.mkdir(parents=True, exist_ok=True)
    python = folder / "env" / "bin" / "python"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "ready").exists():
            venv.create(folder / "env", with_pip=True, symlinks=True, clear=True)
            _run([python, "-m", "pip", "install", "-q", "cyclonedds==11.0.1"])
            (folder / "ready").touch()
    return python


def _see_this_environment(python: Path) -> None:
    (packages,) = python.parents[1].glob("lib/python*/site-packages")
    here = sysconfig.get_paths()["purelib"]
    lines = f"import site; site.addsitedir({here!r})\n{ROOT}\n"
    (packages / "zz_aeros.pth").write_text(lines)


def _run(command: Sequence[object]) -> str:
    done = subprocess.run([str(one) for one in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


class Domain:
    """A ROS 2 domain of its own on this machine, for one robot and its peers."""

    def __init__(self, found: Environments, folder: Path) -> None:
        self.found = found
        self.folder = folder
        # 0 to 101 are safe: https://docs.ros.org/en/rolling/Concepts/Intermediate/About-Domain-ID.html
        self.variables = {**os.environ, "ROS_DOMAIN_ID": str(1 + secrets.randbelow(100))}
        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
            self.variables.pop(name, None)

    @contextmanager
    def robot(
        self,
        *arguments: str,
        is_plain: bool = False,
        is_on_ros2: bool = True,
        ecms: Path = ROOT / "ecms",
    ) -> Iterator[subprocess.Popen[str]]:
        """Start `aeros` in the folder; it is interrupted if it still runs after the block."""
        python = self.found.plain_robot if is_plain else self.found.robot
        name, *options = arguments
        ros2 = ["--ros2"] if is_on_ros2 else []
        command = [str(python), "-m", "aeros", name, "--ecms", str(ecms), *ros2, *options]
        robot = subprocess.Popen(
            command,
            cwd=self.folder,
            env=self.variables,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        try:
            yield robot
        finally:
            if robot.poll() is None:
                robot.send_signal(signal.SIGINT)
            self.output, _ = robot.communicate(timeout=90.0)

    def start_peer(self, *wanted: Mapping[str, Any]) -> subprocess.Popen[str]:
        """Start a peer, which finds processes of this machine alone."""
        variables = {**self.variables, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        return subprocess.Popen(
            [str(self.found.peer), "-I", str(PEER), *(json.dumps(one) for one in wanted)],
            env=variables,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def ask(self, *wanted: Mapping[str, Any]) -> list[Any]:
        """Let a peer do things, and return each result."""
        peer = self.start_peer(*wanted)
        out, err = peer.communicate(timeout=240.0)
        assert peer.returncode == 0, err
        return [json.loads(line) for line in out.splitlines()]

    def events(self, out: str = "out") -> list[dict[str, Any]]:
        """The records of the robot's audit log, notes as the events that they note."""
        lines = (self.folder / out / "audit.jsonl").read_text().splitlines()
        records = (json.loads(line) for line in lines)
        return [one["details"] if one["event"] == "note" else one for one in records]
