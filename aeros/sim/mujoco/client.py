"""Import MuJoCo, at this one place."""

from __future__ import annotations

import mujoco

__all__ = ["mujoco"]
