from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import pytest

from aeros.wired_arm.link import ProcessLink, open_link


@pytest.fixture
def ends() -> Iterator[tuple[ProcessLink, ProcessLink]]:
    """Both ends of a link."""
    here, there = open_link()
    other = ProcessLink(there)
    with closing(here), closing(other):
        yield here, other
