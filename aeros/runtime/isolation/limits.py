"""Resource limits of a worker: memory, processes, open files, processor time and share."""

from __future__ import annotations

import resource
from dataclasses import dataclass
from pathlib import Path
from typing import Final

MEMORY: Final = 256 * 1024 * 1024
"""Bytes that a worker may map beyond those of the zygote; a skill holds a few thousand numbers."""

FILES: Final = 16
"""Limit on open files; a worker needs four, and one to apply Landlock."""

CPU: Final = 3600
"""Limit on processor time, s: the longest timeout a site may grant.  Ends orphaned processes too."""


@dataclass(frozen=True)
class ProcessLimits:
    """Limits on a worker that its module and the site choose.

    Attributes:
        memory: bytes that it may map beyond those of the zygote.
        processor: greatest share of one core, above 0 and at most 1.
        processes: most processes and threads of a control group.
    """

    memory: int = MEMORY
    processor: float = 1.0
    processes: int = 32


USUAL_LIMITS: Final = ProcessLimits()
"""Limits of a worker for which nobody chooses others."""


def restrict_resources(memory: int = MEMORY) -> None:
    """Lower this process's limits, permanently.

    Root is exempt from `RLIMIT_NPROC`; `seccomp` covers that.

    Args:
        memory: bytes that it may map beyond those that are mapped now.
    """
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    mapped = pages * resource.getpagesize()
    for limit, value in (
        (resource.RLIMIT_AS, mapped + memory),
        (resource.RLIMIT_CPU, CPU),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_MEMLOCK, 0),
        (resource.RLIMIT_MSGQUEUE, 0),
        (resource.RLIMIT_NPROC, 0),
        (resource.RLIMIT_NOFILE, FILES),
    ):
        resource.setrlimit(limit, (value, value))
