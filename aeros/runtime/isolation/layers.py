"""Isolation layers by name, and how a worker applies them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from enum import Enum
from typing import Final

from aeros.runtime.isolation.landlock import restrict_files
from aeros.runtime.isolation.limits import MEMORY, restrict_resources
from aeros.runtime.isolation.privileges import drop_privileges
from aeros.runtime.isolation.seccomp import restrict_system_calls


class IsolationLayer(Enum):
    """A layer of isolation, by its name in site files and records."""

    LANDLOCK = "landlock"
    SECCOMP = "seccomp"
    RLIMITS = "rlimits"
    BUBBLEWRAP = "bubblewrap"  # around the zygote, so every worker starts inside it
    CGROUPS = "cgroups"  # around each worker, which enters its control group before anything else


APPLY_LAYER: Final[dict[IsolationLayer, Callable[..., None]]] = {
    # In this order: each needs something that the next one takes away.
    IsolationLayer.RLIMITS: restrict_resources,
    IsolationLayer.LANDLOCK: restrict_files,
    IsolationLayer.SECCOMP: restrict_system_calls,
}
"""Layers that a worker applies to itself; `rlimits` takes the memory that it may map."""


def apply_layers(layers: Iterable[IsolationLayer], keep: int, memory: int = MEMORY) -> None:
    """Close all inherited descriptors and apply isolation layers to this process.

    Descriptors 0 to 2 stay open but lead nowhere.

    Args:
        layers: layers to apply; those that a process cannot apply to itself are skipped.
        keep: descriptor to keep open.
        memory: bytes that the process may map beyond those that are mapped now, by the layer `rlimits`.

    Raises:
        OSError: a layer cannot be applied; the caller must then run no code.
    """
    requested = frozenset(layers)
    for descriptor in (1, 2):
        os.dup2(0, descriptor)
    close_all_but(keep)
    drop_privileges()
    arguments = {IsolationLayer.RLIMITS: (memory,)}
    for layer, apply in APPLY_LAYER.items():
        if layer in requested:
            apply(*arguments.get(layer, ()))


def close_all_but(keep: int) -> None:
    """Close every descriptor except 0 to 2 and one more.

    Args:
        keep: descriptor to keep open.
    """
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        if descriptor > 2 and descriptor != keep:
            with suppress(OSError):  # the descriptor of the listing is closed already
                os.close(descriptor)
