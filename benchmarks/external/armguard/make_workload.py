"""Ask armguard-mcp for plans near its keep-out box: `python make_workload.py URDF workload.json`.

This runs in an environment of its own (`pip install armguard-mcp==0.1.1 pin`) and imports nothing of AEROS.
Like the *near-zone* workload on the server's page it draws targets 2 to 8 cm outside a keep-out box, each
from the home posture and with the hand's orientation there. The joint positions of a target are found by
Pinocchio, as the server's own solver takes a quarter of a minute where there are none, and then the real
server is asked over MCP for the motion to them (`plan_to_joints`). So the targets are not those of the page,
which counts 201 of 300 accepted, and a link inside a box in 84 of these.
"""

from __future__ import annotations

import asyncio
import json
import random
import sys
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

TARGETS = 300
SEED = 0
NEAREST, FARTHEST = 0.02, 0.08
ZONE = "camera_mount"  # the other box is the robot's own base


class InverseKinematics:
    """Joint positions for a place of the tool, by damped least squares from several starts."""

    def __init__(self, urdf: str, chance: random.Random, home: list[float]) -> None:
        import numpy as np
        import pinocchio as pin

        self._np, self._pin, self._chance = np, pin, chance
        self._model = pin.buildModelFromUrdf(urdf)
        self._data = self._model.createData()
        self._tool = self._model.getFrameId("fr3_hand_tcp")
        self._home = home
        self._turn = self._place(self._full(home)).rotation.copy()

    def solve(self, target: list[float], limits: list[tuple[float, float]]) -> list[float] | None:
        """Return joint positions inside the limits, rad; None if none were found."""
        starts = [self._home, *([self._chance.uniform(*one) for one in limits] for _ in range(8))]
        for start in starts:
            found = self._descend(
                self._full(start), self._pin.SE3(self._turn, self._np.array(target)), limits
            )
            if found is not None:
                return found
        return None

    def _descend(self, q: Any, target: Any, limits: list[tuple[float, float]]) -> list[float] | None:
        low, high = self._np.array(limits).T
        for _ in range(200):
            place = self._place(q)
            error = self._pin.log6(place.actInv(target)).vector
            if self._np.linalg.norm(error) < 1e-5:
                return [float(one) for one in q[:7]]
            jacobian = self._pin.computeFrameJacobian(self._model, self._data, q, self._tool)[:, :7]
            damped = jacobian @ jacobian.T + 1e-4 * self._np.eye(6)
            step = jacobian.T @ self._np.linalg.solve(damped, error)
            q[:7] = self._np.clip(q[:7] + self._np.clip(step, -0.2, 0.2), low, high)
        return None

    def _place(self, q: Any) -> Any:
        self._pin.framesForwardKinematics(self._model, self._data, q)
        return self._data.oMf[self._tool]

    def _full(self, q: list[float]) -> Any:
        return self._np.concatenate([q, self._np.zeros(self._model.nq - len(q))])


def draw_target(chance: random.Random, policy: Any) -> list[float]:
    """Draw a point of the workspace, m: 2 to 8 cm outside a face of the keep-out box, and in no box."""
    zone = next(one for one in policy.workspace.keep_out if one.name == ZONE)
    while True:
        point = [chance.uniform(low, high) for low, high in zip(zone.min, zone.max, strict=True)]
        axis, upwards = chance.randrange(3), chance.random() < 0.5
        off = chance.uniform(NEAREST, FARTHEST)
        point[axis] = zone.max[axis] + off if upwards else zone.min[axis] - off
        is_free = not any(box.contains(point) for box in policy.workspace.keep_out)
        if is_free and policy.workspace.box.contains(point):
            return point


async def ask(policy: Any, urdf: str) -> list[dict[str, Any]]:
    """Let the server plan to each target from its home posture."""
    from armguard_mcp.backends.fake import FakeBackend
    from armguard_mcp.server import build_server
    from mcp.client import Client

    backend = FakeBackend.from_policy(policy)
    chance = random.Random(SEED)  # noqa: S311  targets, not secrets
    home = list(policy.robot.home_joint_positions)
    solver = InverseKinematics(urdf, chance, home)
    limits = [(one.min, one.max) for one in policy.robot.limits_list()]
    found = []
    async with Client(build_server(policy, backend)) as client:
        for _ in range(TARGETS):
            target = draw_target(chance, policy)
            end = solver.solve(target, limits)
            motion = {"target": target, "start": home, "end": end, "accepted": False, "violations": ["NO_IK"]}
            if end is not None:
                answer = await client.call_tool("plan_to_joints", {"joint_positions": end})
                plan = answer.structured_content
                motion["accepted"] = plan["status"] != "rejected"
                motion["violations"] = sorted({one["code"] for one in plan["violations"]})
            found.append(motion)
    return found


def main() -> None:
    """Write the workload as JSON."""
    from armguard_mcp.policy import RateLimitsSection, load_policy

    urdf, out = sys.argv[1:]
    policy = load_policy(str(files("armguard_mcp") / "policies" / "fr3.yaml"))
    limits = RateLimitsSection(global_per_minute=10**6, default_per_minute=10**6, per_tool={})
    policy = policy.model_copy(update={"rate_limits": limits})
    zones = [
        {"name": zone.name, "lower": list(zone.min), "upper": list(zone.max)}
        for zone in policy.workspace.keep_out
    ]
    found = {
        "schema": "aeros/armguard-workload/1",
        "source": f"armguard-mcp {version('armguard-mcp')}, its policy fr3.yaml, seed {SEED}",
        "zones": zones,
        "motions": asyncio.run(ask(policy, urdf)),
    }
    Path(out).write_text(json.dumps(found) + "\n", "utf-8")


if __name__ == "__main__":
    main()
