"""bubblewrap: the zygote sees no other process, no network, and of the file system only Python.

Every worker is born into these namespaces, and when the first process in them is killed, the kernel
kills all the others, however they have hidden.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Final

_SYSTEM_FOLDERS: Final = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache")


def find_bubblewrap() -> str | None:
    """The program, if this host has it."""
    return shutil.which("bwrap")


def wrap_command(program: str, command: Iterable[str], readable: Iterable[str], info: int) -> list[str]:
    """`command` in namespaces of its own, with nothing but `readable` of the host, read-only.

    info: the descriptor to which bubblewrap writes which process is the first in the namespaces.

    `--die-with-parent` is not used: it fires when the *thread* that started bubblewrap ends.  The zygote
    ends when the runtime hangs up.
    """
    # A folder before what is in it: a later mount would hide an earlier one below it.
    folders = sorted({str(Path(one)) for one in (*_SYSTEM_FOLDERS, *readable)})
    mounts = [part for one in folders for part in ("--ro-bind-try", one, one)]
    return [
        program,
        "--unshare-all",
        "--cap-drop",
        "ALL",
        "--new-session",
        "--clearenv",
        *mounts,
        "--proc",
        "/proc",
        "--chdir",
        "/",
        "--info-fd",
        str(info),
        "--",
        *command,
    ]
