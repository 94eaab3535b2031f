"""The control period: in each, a simulated plant sets motors, steps the world and calls the monitor once."""

from __future__ import annotations

from typing import Final

TICK: Final = 1.0 / 240.0
"""Control and simulation period, s.  Measured on a prototype: at a lower rate grasps are lost."""
