"""bubblewrap: the zygote sees no other process, no network, and only Python in the file system.

Every worker is created inside these namespaces. When the first process in them is killed, the kernel kills
all the others, however they hide.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Final

_SYSTEM_FOLDERS: Final = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache")


def find_bubblewrap() -> str | None:
    """Find the program on this host.

    Returns:
        Its path; None if it is not installed.
    """
    return shutil.which("bwrap")


def wrap_command(program: str, command: Iterable[str], readable: Iterable[str], info: int) -> list[str]:
    """Build a command line that runs `command` in new namespaces, with parts of the host read-only.

    `--die-with-parent` is not used: it fires when the *thread* that started bubblewrap ends. The zygote ends
    when the runtime hangs up.

    Args:
        program: path of bubblewrap.
        command: program and arguments to run.
        readable: folders and files of the host to mount read-only, in addition to the system's libraries.
        info: descriptor to which bubblewrap writes which process is the first in the namespaces.

    Returns:
        The command line.
    """
    # Sorted, so that a folder comes before its contents: a later mount hides earlier ones below it.
    folders = sorted({str(Path(folder)) for folder in (*_SYSTEM_FOLDERS, *readable)})
    mounts = [part for folder in folders for part in ("--ro-bind-try", folder, folder)]
    return [
        program,
        "--unshare-all",
        "--cap-drop",
        "ALL",
        "--new-session",
        "--clearenv",
        # Libraries of linear algebra must start no threads: a worker forked from them could not.
        "--setenv",
        "OPENBLAS_NUM_THREADS",
        "1",
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
