"""A ROS 2 domain for each test; its environments are made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.runtime.bus.ros2.foreign.environments import Domain, environments


@pytest.fixture
def domain(tmp_path: Path) -> Domain:
    return Domain(environments(), tmp_path)
