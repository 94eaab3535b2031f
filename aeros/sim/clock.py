"""Control period of the simulators: in each, they set motors, step the world and call the monitor once."""

from __future__ import annotations

from typing import Final

TICK: Final = 1.0 / 240.0
"""Control and simulation period, s.  Measured on a prototype: at a lower rate grasps are lost."""
