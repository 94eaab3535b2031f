from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import pytest

from aeros.franka.link import Link, open_link


@pytest.fixture
def ends() -> Iterator[tuple[Link, Link]]:
    """Both ends of a link."""
    here, there = open_link()
    other = Link(there)
    with closing(here), closing(other):
        yield here, other
