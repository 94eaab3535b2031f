"""The bag of a run, where one is asked for.  What writes bags is imported only then."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aeros.runtime.bus.feed import Feed
from aeros.spec.model import Site


class BagRefusedError(Exception):
    """There can be no bag; the message says why and what to do."""


@contextmanager
def bagged(folder: Path | None, site: Site) -> Iterator[Feed | None]:
    """A feed into a new bag in `folder`, complete when the block ends; None where no bag is asked for."""
    if folder is None:
        yield None
        return
    try:
        from aeros.runtime.bus.bag import Bag, BagError
    except ImportError as error:
        raise BagRefusedError(f"--bag needs `pip install 'aeros[ros]'` ({error.name} is missing)") from error
    try:
        bag = Bag(folder)
    except BagError as refusal:
        raise BagRefusedError(f"{refusal}; give a new folder with --bag") from refusal
    try:
        with bag, Feed(bag, site) as feed:
            yield feed
    except BagError as failure:
        raise BagRefusedError(str(failure)) from failure
