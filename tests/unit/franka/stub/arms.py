"""Arms, hands and settings for the tests of the plant `franka`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.franka.settings import FrankaSettings
from aeros.wired_arm.arm import CYCLE, ArmError, ArmState, Joints
from aeros.wired_arm.link import ProcessLink

READY: Joints = (0.0, -0.6, 0.0, -2.1, 0.0, 1.5, 0.785)
"""Where the stub's arm stands at the start, rad."""

STUB = Path(__file__).parent

ACCELERATION = (10.0,) * 7
JERK = (5000.0,) * 7

SETTINGS = FrankaSettings("stub", False, True, (30.0,) * 7, (40.0,) * 3 + (30.0,) * 3, 0.5, 0.003)
"""Settings for the stub; the monitor may be late by half a second, as other tests run meanwhile."""

Ends = tuple[ProcessLink, ProcessLink]
"""Both ends of a link."""

JointPath = tuple[tuple[Joints, Joints, Joints, Joints], ...]


def line(start: Joints, way: float) -> JointPath:
    """A path of one piece that moves all joints by `way`, rad."""
    points = [tuple(q + way * share for q in start) for share in (0.0, 1 / 3, 2 / 3, 1.0)]
    return ((points[0], points[1], points[2], points[3]),)


def use_stub(monkeypatch: pytest.MonkeyPatch, **settings: Any) -> None:
    """Let processes import the stub of `pylibfranka` with these settings."""
    monkeypatch.setenv("PYTHONPATH", str(STUB))
    monkeypatch.setenv("STUB_FRANKA", json.dumps(settings))


def import_stub(monkeypatch: pytest.MonkeyPatch, **settings: Any) -> None:
    """Let this process import it."""
    monkeypatch.setenv("STUB_FRANKA", json.dumps({"pace": 0.0, **settings}))
    monkeypatch.syspath_prepend(str(STUB))
    monkeypatch.delitem(sys.modules, "pylibfranka", raising=False)


class ScriptedArm:
    """An arm that follows perfectly, without a clock: each read is the next cycle.

    `at_cycle` is called before each read of a controlled arm, with the number of cycles of control so far.
    """

    def __init__(self, at_cycle: Callable[[int], None] = lambda cycle: None, idle_cycles: int = 3) -> None:
        self.at_cycle = at_cycle
        self.time, self.q, self.mode = 0.0, READY, 1
        self.commands: list[Joints] = []
        self.skipped: dict[int, int] = {}
        self.failures: dict[int, ArmError] = {}
        self.stops = 0
        self.is_gone_when_idle = False
        self._idle_cycles = idle_cycles
        self._cycle = 0

    def read(self) -> ArmState:
        self._idle_cycles -= 1
        if self._idle_cycles < 0:
            raise ArmError("the robot cannot be reached: gone", is_connected=False)
        self.time += CYCLE
        return self._state()

    def start(self) -> ScriptedArm.Control:
        return ScriptedArm.Control(self)

    def stop(self) -> None:
        self.stops += 1

    def recover(self) -> None:
        raise AssertionError("no process clears a reflex")

    def _state(self) -> ArmState:
        still = (0.0,) * 7
        return ArmState(self.time, self.q, still, self.q, still, still, self.mode, 1.0)

    class Control:
        def __init__(self, arm: ScriptedArm) -> None:
            self._arm = arm
            self._cycle = 0

        def read(self) -> ArmState:
            arm = self._arm
            arm.at_cycle(self._cycle)
            if self._cycle in arm.failures:
                raise arm.failures[self._cycle]
            arm.time += CYCLE * (1 + arm.skipped.get(self._cycle, 0))
            self._cycle += 1
            return arm._state()

        def write(self, q: Joints, *, is_last: bool) -> None:
            self._arm.commands.append(q)
            self._arm.q = q
