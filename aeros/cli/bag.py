"""What is kept of a run as ROS 2 messages, where that is asked for.  What writes it is imported only then."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aeros.runtime.bus.feed import Feed
from aeros.spec.model import Site


class BagRefusedError(Exception):
    """There can be no bag or file; the message says why and what to do."""


@contextmanager
def bagged(folder: Path | None, file: Path | None, site: Site) -> Iterator[Feed | None]:
    """A feed into a new bag in `folder`, or into one new MCAP `file`, complete when the block ends.

    None where neither is asked for.
    """
    option, path = ("--bag", folder) if file is None else ("--mcap", file)
    if path is None:
        yield None
        return
    try:
        from aeros.runtime.bus.bag import Bag, BagError, McapFile
    except ImportError as error:
        raise BagRefusedError(
            f"{option} needs `pip install 'aeros[ros]'` ({error.name} is missing)"
        ) from error
    try:
        bag = Bag(path) if file is None else McapFile(file)
    except BagError as refusal:
        raise BagRefusedError(f"{refusal}; give a new {_NOUN[option]} with {option}") from refusal
    try:
        with bag, Feed(bag, site, is_whole=True) as feed:
            yield feed
    except BagError as failure:
        raise BagRefusedError(str(failure)) from failure


_NOUN = {"--bag": "folder", "--mcap": "file"}
