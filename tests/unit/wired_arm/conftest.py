from __future__ import annotations

from tests.unit.franka.conftest import ends

__all__ = ["ends"]
