"""Launcher of a confined program: a process between the runtime and the program, without the runtime's parts.

The launcher forks a process that confines itself and becomes the program. It waits for the program's end, or
for a signal from the runtime, and then kills every process that the program started: they are its
descendants, also those with a session of their own. It ends with the runtime's thread that waits for it.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from aeros.runtime.isolation.kernel import child_processes, end_descendants, process_control
from aeros.runtime.isolation.landlock import restrict_files
from aeros.runtime.isolation.layers import close_all_but
from aeros.runtime.isolation.privileges import become_subreaper, drop_privileges
from aeros.runtime.isolation.seccomp import restrict_sockets

NOT_CONFINED: Final = 126
"""Exit code of a program that was not started, for the reason in the report."""

_SYSTEM: Final = (
    "/usr",
    "/bin",
    "/sbin",
    "/lib",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/etc/ssl/certs",
    "/dev/zero",
    "/dev/urandom",
    "/proc/self",
    "/proc/cpuinfo",
    "/proc/meminfo",
)
"""Files and folders of the system that every program may read."""

_SYSTEM_NETWORK: Final = ("/etc/hosts", "/etc/resolv.conf", "/etc/nsswitch.conf", "/etc/services")
"""Files that a program may read, too, that may use the network."""

_MAX_FILE: Final = 64 * 1024 * 1024
"""Greatest size of a file that it writes, bytes."""

_MAX_OPEN_FILES: Final = 256

_LOOK_S: Final = 0.02
"""Time between two counts of its processes, s."""

_PR_SET_PDEATHSIG: Final = 1
_ENDING: Final = frozenset((signal.SIGTERM, signal.SIGINT, signal.SIGHUP))


def main(encoded: str) -> None:
    """Run a program, and end with its exit code.

    Args:
        encoded: the plan as JSON; `confinement.launch_plan` makes it.
    """
    plan = json.loads(encoded)
    code, reason = 1, None
    signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING | {signal.SIGCHLD})
    become_subreaper()
    process_control(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != plan["parent"]:
        os._exit(1)  # it had ended before
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            _become(plan, write_end)
        finally:
            os._exit(NOT_CONFINED)
    os.close(write_end)
    null = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):  # the program alone holds its input and output open
        os.dup2(null, descriptor)
    try:
        with os.fdopen(read_end, "rb") as pipe:
            reason = pipe.read().decode("utf-8", "replace") or None  # empty once it is the program
        if reason is None:
            code, reason = _wait(child, plan["processes"])
    finally:
        end_descendants()
        if reason is not None:
            code = NOT_CONFINED
            Path(plan["report"]).write_text(reason, encoding="utf-8")
        os._exit(code)


def _wait(child: int, most: int) -> tuple[int, str | None]:
    """Wait for the end of the program, or for a signal.

    Returns:
        Its exit code; and why it is to be ended, None if it has ended.
    """
    while True:
        received = signal.sigtimedwait(_ENDING | {signal.SIGCHLD}, _LOOK_S)
        if received is not None and received.si_signo in _ENDING:
            return 1, None
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended == child:
            code = os.waitstatus_to_exitcode(status)
            return (code if code >= 0 else 128 - code), None
        if _count_descendants(most) > most:
            return 1, f"it started more than {most} processes (`confinement.processes`) and was killed"


def _count_descendants(most: int) -> int:
    """Count the processes below this one, as far as needed to see if there are more than `most`."""
    unseen, count = child_processes(), 0
    while unseen and count <= most:
        count += 1
        unseen += child_processes(unseen.pop())
    return count


def _become(plan: dict[str, Any], report: int) -> None:
    """Confine this process and execute the program; write into `report` why not."""
    try:
        _confine(plan, report)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING | {signal.SIGCHLD})
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        private = plan["private"]
        environment = {"PATH": os.defpath, "LANG": "C.UTF-8", "HOME": private, "TMPDIR": private}
        os.execve(plan["program"], plan["command"], environment)  # noqa: S606 - the site's operator names it
    except OSError as failure:
        os.write(report, f"it cannot be started: {failure.strerror}".encode())
    except _NotConfinedError as failure:
        os.write(report, f"it cannot be confined: {failure}".encode())


class _NotConfinedError(Exception):
    """A layer that the site requires, or a path of the plan, is missing; the message says why."""


def _confine(plan: dict[str, Any], keep: int) -> None:
    """Give up everything that the program does not need.

    Raises:
        _NotConfinedError: a required layer is missing here, or has no effect; or there is no such path.
    """
    for entrance in plan["entrances"]:
        with _layer("cgroups", plan):
            Path(entrance).write_text("0", encoding="ascii")
    with suppress(OSError):  # the kernel then ends it before its launcher, if memory runs out
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    os.dup2(os.open(plan["errors"], os.O_WRONLY | os.O_CREAT, 0o600), 2)
    close_all_but(keep)
    os.umask(0o077)
    os.chdir("/")
    os.setsid()
    process_control(_PR_SET_PDEATHSIG, signal.SIGKILL)
    with _layer("rlimits", plan):
        _restrict_resources(plan)
    drop_privileges()
    network = plan["network"]
    system = (*_SYSTEM, *(_SYSTEM_NETWORK if network else ()))
    # Opened outside of the layer's block: a path that is missing here is no missing layer.
    reads = _open_places([*filter(os.path.exists, system), plan["program"], *plan["reads"]])
    writes = _open_places(["/dev/null", plan["private"], *plan["writes"]])
    with _layer("landlock", plan):
        restrict_files(reads, writes, allows_network=network)
        _expect_denied(lambda: os.close(os.open(plan["canary"], os.O_RDONLY)))
    if not network:
        with _layer("seccomp", plan):
            restrict_sockets()
            _expect_denied(lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close())


def _open_places(paths: Iterable[str]) -> list[int]:
    """Open files and folders by their places alone; the descriptors end when the program is executed.

    Raises:
        _NotConfinedError: there is no such path.
    """
    opened = []
    for path in paths:
        try:
            opened.append(os.open(path, os.O_PATH | os.O_CLOEXEC))
        except FileNotFoundError as failure:
            raise _NotConfinedError(f"{path} does not exist") from failure
        except OSError as failure:
            raise _NotConfinedError(f"{path} cannot be opened: {failure.strerror}") from failure
    return opened


@contextmanager
def _layer(name: str, plan: dict[str, Any]) -> Iterator[None]:
    """Apply a layer in the block, and do without it if it is missing here and the site does not require it.

    Raises:
        _NotConfinedError: the site requires it.
    """
    try:
        yield
    except OSError as failure:
        if name in plan["required"]:
            raise _NotConfinedError(f"{name}: {failure}") from failure


def _expect_denied(attempt: Callable[[], None]) -> None:
    """Require that an attempt fails.

    Raises:
        OSError: it works, so the layer has no effect.
    """
    try:
        attempt()
    except OSError:
        return
    raise OSError("it was applied and has no effect")


def _restrict_resources(plan: dict[str, Any]) -> None:
    processor = math.ceil(plan["seconds"]) + 1
    for limit, value in (
        # Not its address space: runtimes such as that of JavaScript reserve much more than they use.
        (resource.RLIMIT_DATA, plan["memory"]),
        (resource.RLIMIT_CPU, processor),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, _MAX_FILE),
        (resource.RLIMIT_MEMLOCK, 0),
        (resource.RLIMIT_MSGQUEUE, 0),
        (resource.RLIMIT_NOFILE, _MAX_OPEN_FILES),
        # The limit counts all processes of the user.
        (resource.RLIMIT_NPROC, _threads_of_user() + plan["processes"]),
    ):
        _, hard = resource.getrlimit(limit)
        lowered = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(limit, (lowered, lowered))


def _threads_of_user() -> int:
    count = 0
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if process.stat().st_uid == os.getuid():
                count += len(os.listdir(process / "task"))
    return count
