"""Resource limits: how much memory, how many processes and files, for how long."""

from __future__ import annotations

import resource
from pathlib import Path
from typing import Final

MEMORY: Final = 256 * 1024 * 1024
"""Bytes that a worker may map beyond what the zygote had mapped; a skill holds a few thousand numbers."""

FILES: Final = 16
"""Open files at most; a worker needs four, and one to put on Landlock."""

CPU: Final = 3600
"""Seconds of processor time, the longest time-out a site may grant; ends what nobody is left to end."""


def restrict_resources() -> None:
    """Lower this process's limits, for good.

    Not held by them: processes of root (`RLIMIT_NPROC` is ignored), for which there is `seccomp`.
    """
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    memory = pages * resource.getpagesize() + MEMORY
    for limit, value in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, CPU),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_MEMLOCK, 0),
        (resource.RLIMIT_MSGQUEUE, 0),
        (resource.RLIMIT_NPROC, 0),
        (resource.RLIMIT_NOFILE, FILES),
    ):
        resource.setrlimit(limit, (value, value))
