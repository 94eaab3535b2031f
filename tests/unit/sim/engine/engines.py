"""Every physics engine, for tests of what holds on each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import pytest

from aeros.sim.engine.engine import Engine
from aeros.sim.physics import make_bullet_engine, make_mujoco_engine

ENGINES: Final[dict[str, Callable[[], Engine]]] = {"bullet": make_bullet_engine, "mujoco": make_mujoco_engine}

GREY: Final = (0.5, 0.5, 0.5, 1.0)


@pytest.fixture(params=list(ENGINES))
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    """Make one engine after the other, with an empty world."""
    made = ENGINES[request.param]()
    yield made
    made.world.close()
