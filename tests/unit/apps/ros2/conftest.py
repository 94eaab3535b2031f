"""A ROS 2 domain for each test that asks for one."""

from __future__ import annotations

from tests.unit.runtime.bus.ros2.conftest import domain

__all__ = ["domain"]
