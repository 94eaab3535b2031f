"""The stub controller in a process of its own, in the environment of a ROS 2 peer without AEROS."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from tests.unit.franka.stub.arms import READY
from tests.unit.runtime.bus.ros2.foreign.environments import Domain

CONTROLLER = Path(__file__).with_name("joint_trajectory_controller.py")
JOINTS = tuple(f"fr3_joint{number}" for number in range(1, 8))
VARIABLES = {
    "AEROS_ROS2_CONTROL": "/joint_trajectory_controller",
    "AEROS_ROS2_CONTROL_JOINTS": ",".join(JOINTS),
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
}


class StubController(NamedTuple):
    """The stub, and the file of its events."""

    process: subprocess.Popen[str]
    log: Path

    def events(self, *names: str) -> list[dict[str, Any]]:
        """Its events of these names."""
        lines = (json.loads(line) for line in self.log.read_text().splitlines())
        return [one for one in lines if one["event"] in names]


@contextmanager
def stub_controller(domain: Domain, **options: Any) -> Iterator[StubController]:
    """Run the stub."""
    log = domain.folder / "controller.jsonl"
    given = {"joints": JOINTS, "start": READY, "log": str(log), **options}
    process = subprocess.Popen(
        [str(domain.found.peer), "-I", str(CONTROLLER), json.dumps(given)],
        env={**domain.variables, **VARIABLES},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield StubController(process, log)
    finally:
        process.terminate()
        process.communicate(timeout=20.0)
