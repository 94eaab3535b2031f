"""Cases that each push tries, of tests that have many or long ones; the others are `deep`."""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import pytest

_HERE: Final = Path(__file__).parent
_COUNTS: Final[dict[str, int]] = tomllib.loads((_HERE / "sampled_cases.toml").read_text(encoding="utf-8"))


def leave_cases_to_deep(items: Iterable[pytest.Item], *, is_whole: bool) -> None:
    """Mark cases of the listed tests as `deep`, but for as many as are listed, which are spread over all.

    Args:
        items: collected tests, in order.
        is_whole: True if all tests were collected.

    Raises:
        UsageError: a listed test is not there, or has no more cases than are to be tried.
    """
    cases = defaultdict(list)
    for item in items:
        name = f"{item.path.relative_to(_HERE).as_posix()}::{getattr(item, 'originalname', item.name)}"
        if name in _COUNTS and item.get_closest_marker("deep") is None:
            cases[name].append(item)
    for name, count in _COUNTS.items():
        found = cases[name]
        if is_whole and len(found) <= count:
            raise pytest.UsageError(f"tests/sampled_cases.toml: `{name}` has {len(found)} cases")
        kept = {place * len(found) // count for place in range(count)}
        for place, item in enumerate(found):
            if place not in kept:
                item.add_marker("deep")
