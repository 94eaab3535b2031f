"""franka-sim, which speaks the network protocol of the real robot, in an environment of its own.

It pins NumPy 1.26 and MuJoCo before 3.3, so nothing of it is installed beside AEROS. Its model of the FR3 is
that of the wheel of franky-sim, as franka-sim's own is downloaded at run time. The ports of the protocol are
fixed, so one server runs at a time on a machine.
"""

from __future__ import annotations

import fcntl
import os
import socket
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple

PACKAGES: Final = ("franka-sim==1.1.7", "pylibfranka==0.21.3")
MODEL_PACKAGE: Final = "franky-sim==1.0.4"
_PORTS: Final = (1337, 1338)
_START_S: Final = 60.0

_WRIST_ARMATURE: Final = 0.15
"""Inertia of the motors of joints 5 to 7 of the simulated arm, kg·m²."""

OBJECT_WIDTH: Final = 0.03
"""Width of what the simulated hand finds between its fingers, m."""


class Installation(NamedTuple):
    """Where things are installed.

    Attributes:
        python: the interpreter of franka-sim's environment.
        library: a folder with `pylibfranka` alone, for `PYTHONPATH` of AEROS's own processes.
        model: the model of the robot.
    """

    python: Path
    library: Path
    model: Path


def install(folder: Path) -> Installation:
    """Install everything, unless it is there; processes that do so at once wait for each other."""
    folder.mkdir(parents=True, exist_ok=True)
    found = Installation(
        folder / "venv/bin/python", folder / "library", folder / "model/franky_sim/assets/fr3.xml"
    )
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "done").exists():
            _run(sys.executable, "-m", "venv", str(folder / "venv"))
            _run(str(found.python), "-m", "pip", "install", "-q", *PACKAGES)
            pip = (sys.executable, "-m", "pip")
            _run(*pip, "install", "-q", "--no-deps", "--target", str(found.library), PACKAGES[1])
            _run(*pip, "download", "-q", "--no-deps", "-d", str(folder / "wheels"), MODEL_PACKAGE)
            (wheel,) = (folder / "wheels").glob("*.whl")
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(folder / "model")
            # The wheel has its meshes in another folder than its model says.
            text = found.model.read_text().replace('meshdir="assets"', 'meshdir="meshes"')
            # franka-sim damps by torque, one step late: 200 N·m·s/rad · 1 ms over 0.074 kg·m² is above 2. A
            # wrist that is pushed once swings from step to step at 0.08 rad/s for ever, and never rests.
            text = text.replace('armature="0.074"', f'armature="{_WRIST_ARMATURE}"')
            found.model.write_text(text)
            (folder / "done").touch()
    return found


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@contextmanager
def running(installation: Installation, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a server that is as strict as the robot; wait while another one has its ports."""
    with Path("/tmp/aeros-franka-sim.lock").open("w") as lock:  # noqa: S108  shared by all checkouts
        fcntl.flock(lock, fcntl.LOCK_EX)
        with (folder / "server.log").open("ab") as log:
            server = subprocess.Popen(
                [
                    str(installation.python),
                    "-m",
                    "franka_sim.run_server",
                    "--enforce-motion-limits",
                    "--enforce-comm-constraints",
                    "--gripper-object-width",
                    str(OBJECT_WIDTH),
                ],
                env={**os.environ, "FR3_MJCF": str(installation.model)},
                stdout=log,
                stderr=log,
            )
        try:
            _wait_for_ports(server)
            yield server
        finally:
            server.terminate()
            try:
                server.wait(20.0)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


def _wait_for_ports(server: subprocess.Popen[bytes]) -> None:
    latest = time.monotonic() + _START_S
    for port in _PORTS:
        while True:
            assert server.poll() is None, "franka-sim has ended"
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            assert time.monotonic() < latest, f"franka-sim does not listen on port {port}"
            time.sleep(0.2)
    time.sleep(1.0)  # until it has taken the probes for clients that have left
