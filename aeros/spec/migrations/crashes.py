"""Migration steps of `crashes.json`, which the watchdog keeps."""

from __future__ import annotations

import json

from aeros.spec.migrations.format import UnmigratableError


def to_2(text: str) -> str:
    """Put the list of crashes into an object, which has room for `schema`.

    Args:
        text: file of version 1.

    Returns:
        The file in version 2.

    Raises:
        UnmigratableError: it is not a list.
        ValueError: it is not JSON.
    """
    crashes = json.loads(text)
    if not isinstance(crashes, list):
        raise UnmigratableError("it is damaged: version 1 is a list of crashes")
    return json.dumps({"schema": "aeros/crashes/2", "crashes": crashes})
