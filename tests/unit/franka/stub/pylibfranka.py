"""A stub of the part of `pylibfranka`'s interface that AEROS uses: a robot that follows perfectly.

`STUB_FRANKA` in the environment is JSON:

    pace       seconds on the wall clock for each cycle (0.001)
    refuses    text with which `Robot(…)` raises
    mode       number of the robot's mode at the start (1, idle)
    fault      {after: cycles of control, errors: text}: a reflex in mid-motion
    lose       {after: cycles of control, count: cycles that the client does not see}
    drift      speed of the joints after a motion has ended, rad/s (0)
    closing    time for which fingers close, s (0)
    object     width between the fingers, m (0: nothing is there)
    log        file to which calls are appended
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from enum import IntEnum
from typing import Any

SETTINGS: dict[str, Any] = json.loads(os.environ.get("STUB_FRANKA", "{}"))
PACE: float = SETTINGS.get("pace", 0.001)
READY = [0.0, -0.6, 0.0, -2.1, 0.0, 1.5, 0.785]


class NetworkException(RuntimeError):
    pass


class ControlException(RuntimeError):
    pass


class CommandException(RuntimeError):
    pass


class RealtimeConfig(IntEnum):
    kEnforce = 0  # noqa: N815  the library's name
    kIgnore = 1  # noqa: N815  the library's name


class ControllerMode(IntEnum):
    JointImpedance = 0
    CartesianImpedance = 1


class RobotMode(IntEnum):
    Other = 0
    Idle = 1
    Move = 2
    Guiding = 3
    Reflex = 4
    UserStopped = 5
    AutomaticErrorRecovery = 6


class Duration:
    def __init__(self, cycles: int) -> None:
        self._cycles = cycles

    def to_sec(self) -> float:
        return self._cycles / 1000.0


class JointPositions:
    def __init__(self, q: Sequence[float]) -> None:
        self.q = [*q]
        self.motion_finished = False


class RobotState:
    def __init__(self, robot: Robot) -> None:
        self.time = Duration(robot.cycles)
        self.q = [*robot.q]
        self.q_d = [*robot.q]
        self.dq = [*robot.dq]
        self.tau_J = [0.0] * 7
        self.tau_ext_hat_filtered = [0.0] * 7
        self.robot_mode = robot.mode
        self.control_command_success_rate = 1.0 if robot.mode is RobotMode.Move else 0.0


class Robot:
    def __init__(self, address: str, config: RealtimeConfig) -> None:
        if "refuses" in SETTINGS:
            raise NetworkException(SETTINGS["refuses"])
        log(f"connect {address} {config.name}")
        self.cycles = 0
        self.q = [*READY]
        self.dq = [0.0] * 7
        self.mode = RobotMode(SETTINGS.get("mode", 1))
        self._next = time.monotonic()

    def cycle(self, count: int = 1) -> None:
        self.cycles += count
        self._next = max(self._next + count * PACE, time.monotonic() - 0.1)
        time.sleep(max(0.0, self._next - time.monotonic()))

    def read_once(self) -> RobotState:
        self.cycle()
        return RobotState(self)

    def set_collision_behavior(self, *thresholds: Sequence[float]) -> None:
        log(f"thresholds {json.dumps([[*one] for one in thresholds])}")

    def start_joint_position_control(self, mode: ControllerMode) -> Control:
        if self.mode is not RobotMode.Idle:
            raise CommandException(f"Move command rejected: mode {self.mode.name}")
        log(f"start {mode.name}")
        self.mode = RobotMode.Move
        return Control(self)

    def stop(self) -> None:
        log("stop")
        if self.mode is RobotMode.Move:
            self.mode = RobotMode.Idle

    def automatic_error_recovery(self) -> None:
        log("recover")
        self.mode = RobotMode.Idle


class Control:
    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._count = 0

    def readOnce(self) -> tuple[RobotState, Duration]:  # noqa: N802  the library's name
        self._count += 1
        fault, lost = SETTINGS.get("fault"), SETTINGS.get("lose")
        if fault is not None and self._count > fault["after"]:
            self._robot.mode, self._robot.dq = RobotMode.Reflex, [0.0] * 7
            raise ControlException(f'motion aborted by reflex! ["{fault["errors"]}"]')
        missed = lost["count"] if lost is not None and self._count == lost["after"] else 0
        if missed >= 20:
            self._robot.mode, self._robot.dq = RobotMode.Reflex, [0.0] * 7
            raise ControlException('motion aborted by reflex! ["communication_constraints_violation"]')
        self._robot.cycle(1 + missed)
        return RobotState(self._robot), Duration(1 + missed)

    def writeOnce(self, command: JointPositions) -> None:  # noqa: N802  the library's name
        robot = self._robot
        if max(abs(a - b) for a, b in zip(command.q, robot.q, strict=True)) > 0.06:
            robot.mode = RobotMode.Reflex
            raise ControlException('motion aborted! ["joint_motion_generator_velocity_discontinuity"]')
        robot.dq = [1000.0 * (a - b) for a, b in zip(command.q, robot.q, strict=True)]
        robot.q = [*command.q]
        if command.motion_finished:
            log("finished")
            robot.dq, robot.mode = [SETTINGS.get("drift", 0.0)] * 7, RobotMode.Idle


class GripperState:
    def __init__(self, width: float, *, is_grasped: bool) -> None:
        self.width, self.is_grasped = width, is_grasped


class Gripper:
    def __init__(self, address: str) -> None:
        if "refuses" in SETTINGS:
            raise NetworkException(SETTINGS["refuses"])
        self._state = GripperState(0.08, is_grasped=False)

    def read_once(self) -> GripperState:
        return self._state

    def move(self, width: float, speed: float) -> bool:
        if width > 0.08:
            raise CommandException("width out of range")
        self._state = GripperState(width, is_grasped=False)
        return True

    def grasp(self, width: float, speed: float, force: float, inner: float, outer: float) -> bool:
        time.sleep(SETTINGS.get("closing", 0.0))
        log("closed")
        reached = max(width, SETTINGS.get("object", 0.0))
        self._state = GripperState(reached, is_grasped=width - inner <= reached <= width + outer)
        return self._state.is_grasped


def log(line: str) -> None:
    if "log" in SETTINGS:
        with open(SETTINGS["log"], "a", encoding="utf-8") as file:
            file.write(line + "\n")
