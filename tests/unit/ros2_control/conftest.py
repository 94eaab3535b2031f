from __future__ import annotations

from tests.unit.franka.conftest import ends
from tests.unit.runtime.bus.ros2.conftest import domain

__all__ = ["domain", "ends"]
