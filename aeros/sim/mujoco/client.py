"""Import MuJoCo, at this one place."""

from __future__ import annotations

from typing import Any

import mujoco as library

mujoco: Any = library
"""The library; its types are not used, as not every version of it ships them."""

__all__ = ["mujoco"]
