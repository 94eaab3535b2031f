"""The layers by name, and how a worker puts them on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from enum import Enum
from typing import Final

from aeros.runtime.isolation.landlock import restrict_files
from aeros.runtime.isolation.limits import restrict_resources
from aeros.runtime.isolation.privileges import drop_privileges
from aeros.runtime.isolation.seccomp import restrict_system_calls


class IsolationLayer(Enum):
    """One layer of isolation, by the name it has in site files and records."""

    LANDLOCK = "landlock"
    SECCOMP = "seccomp"
    RLIMITS = "rlimits"
    BUBBLEWRAP = "bubblewrap"  # around the zygote, so every worker has it from birth


APPLY_LAYER: Final[dict[IsolationLayer, Callable[[], None]]] = {
    # In this order: each needs what the next takes away.
    IsolationLayer.RLIMITS: restrict_resources,
    IsolationLayer.LANDLOCK: restrict_files,
    IsolationLayer.SECCOMP: restrict_system_calls,
}
"""The layers that a worker puts on by itself."""


def apply_layers(layers: Iterable[IsolationLayer], keep: int) -> None:
    """Keep only descriptor `keep` (and 0 to 2, which lead nowhere), then put on `layers`.

    Raises OSError where one cannot be put on; the caller must then run nothing.
    """
    wanted = frozenset(layers)
    for descriptor in (1, 2):
        os.dup2(0, descriptor)
    close_all_but(keep)
    drop_privileges()
    for layer, put_on in APPLY_LAYER.items():
        if layer in wanted:
            put_on()


def close_all_but(keep: int) -> None:
    """Close every descriptor except 0 to 2 and `keep`."""
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        if descriptor > 2 and descriptor != keep:
            with suppress(OSError):  # the one that listed them is closed already
                os.close(descriptor)
