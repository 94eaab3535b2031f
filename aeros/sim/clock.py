"""The control period: the simulated plants set motors, step and check the monitor once in each."""

from __future__ import annotations

from typing import Final

TICK: Final = 1.0 / 240.0
"""Control and simulation period, s.  Measured on a prototype: at a lower rate grasps are lost."""
