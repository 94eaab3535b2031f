"""Motion policies are values: `aeros diff` compares them, and nothing changes one."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from fractions import Fraction

import pytest

from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.motion import Barrier, MotionKind

_ZERO, _ONE = (Fraction(0),) * 3, (Fraction(1),) * 3


def barrier(*, keep_inside: bool = False) -> Barrier:
    return Barrier("fence", "cell", AxisAlignedBox(_ZERO, _ONE), keep_inside, False, None, "people")


def test_equal_content_is_equal() -> None:
    assert barrier() == barrier()
    assert barrier() != barrier(keep_inside=True)
    assert MotionKind("target", None, "speed") == MotionKind("target", None, "speed", None)


def test_a_barrier_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        barrier().keep_inside = True  # type: ignore[misc]
