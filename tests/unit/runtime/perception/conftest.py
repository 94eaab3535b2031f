"""Zygotes of this host whose workers run perceivers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.runtime.isolation.layers import APPLY_LAYER
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.perception.open_perceiver import PRELOADED
from tests.host_layers import require_layers


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark the tests that need layers of the host."""
    if "pool" in getattr(item, "fixturenames", ()):
        item.add_marker("layers")


@pytest.fixture(scope="session")
def zygotes() -> Iterator[ZygotePool]:
    """Zygotes, whatever layers this host has."""
    pool = ZygotePool(PRELOADED)
    yield pool
    pool.close()


@pytest.fixture
def pool(zygotes: ZygotePool) -> ZygotePool:
    """Zygotes whose workers can put on every layer that a process puts on itself."""
    require_layers(*(layer.value for layer in APPLY_LAYER))
    return zygotes
