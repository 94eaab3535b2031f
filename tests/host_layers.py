"""Isolation layers that this host offers, asked of its kernel by system calls of the tests' own.

Nothing of `aeros` is asked or imported: a layer that is switched off in the code must fail tests, not skip
them.  `AEROS_EXPECT_LAYERS` names the layers that a machine is known to have, such as `landlock,seccomp`.
There, a test that needs one of them fails where it would be skipped elsewhere.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import struct
import subprocess
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest

VARIABLE: Final = "AEROS_EXPECT_LAYERS"

_LIBC: Final = ctypes.CDLL(None, use_errno=True)
_CREATE_RULESET, _RESTRICT_SELF = 444, 446  # the same on every architecture
_LANDLOCK_READ_FILE = 4
_PR_SET_NO_NEW_PRIVS, _PR_SET_SECCOMP, _MODE_FILTER = 38, 22, 2
_GETPPID: Final = {"x86_64": 110, "aarch64": 173}
"""Machines for which AEROS lists system calls; on others there is no filter."""


def landlock_version() -> int:
    """Ask for the version of the host's Landlock.

    Returns:
        The version, from 1; -1 if the kernel has none.
    """
    arguments = (ctypes.c_long(_CREATE_RULESET), None, ctypes.c_long(0), ctypes.c_long(1))
    return int(_LIBC.syscall(*arguments))


def _shut_a_file() -> bool:
    """Restrict this process by a ruleset of our own; return True if a file cannot be opened then."""
    handled = ctypes.c_uint64(_LANDLOCK_READ_FILE)
    ruleset = _LIBC.syscall(
        ctypes.c_long(_CREATE_RULESET), ctypes.byref(handled), ctypes.c_long(8), ctypes.c_long(0)
    )
    _LIBC.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    if ruleset < 0 or _LIBC.syscall(ctypes.c_long(_RESTRICT_SELF), ruleset, ctypes.c_long(0)) != 0:
        return False
    return _fails_with(lambda: os.open("/proc/self/statm", os.O_RDONLY), errno.EACCES)


def _deny_a_call() -> bool:
    """Install a filter of our own, which denies `getppid`; return True if it is denied then."""
    number = _GETPPID.get(os.uname().machine)
    if number is None:
        return False
    program = b"".join(
        struct.pack("HBBI", *one)
        for one in (
            (0x20, 0, 0, 0),  # load the number of the call
            (0x15, 0, 1, number),
            (0x06, 0, 0, 0x00050000 | errno.EXDEV),  # fail with an error that getppid never has
            (0x06, 0, 0, 0x7FFF0000),
        )
    )
    buffer = ctypes.create_string_buffer(program)
    header = struct.pack("HxxxxxxQ", 4, ctypes.addressof(buffer))
    _LIBC.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    if _LIBC.prctl(_PR_SET_SECCOMP, _MODE_FILTER, ctypes.create_string_buffer(header), 0, 0) != 0:
        return False
    return bool(_LIBC.syscall(ctypes.c_long(number)) == -1 and ctypes.get_errno() == errno.EXDEV)


def _fails_with(attempt: Callable[[], object], number: int) -> bool:
    try:
        attempt()
    except OSError as failure:
        return failure.errno == number
    return False


def _works_in_child(attempt: Callable[[], bool]) -> bool:
    with warnings.catch_warnings():
        # Of other threads, whose locks a child might wait for: it calls nothing that needs them.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        worked = False
        try:
            worked = attempt()
        finally:
            os._exit(0 if worked else 1)
    return os.waitpid(child, 0)[1] == 0


def _landlock_reason() -> str | None:
    if landlock_version() < 1:
        return "the kernel has no Landlock"
    return None if _works_in_child(_shut_a_file) else "the kernel has Landlock and lets nobody use it"


def _seccomp_reason() -> str | None:
    return None if _works_in_child(_deny_a_call) else "no filter of system calls can be installed"


def _bubblewrap_reason() -> str | None:
    program = shutil.which("bwrap")
    if program is None:
        return "there is no program `bwrap`"
    ran = subprocess.run(
        [program, "--unshare-all", "--ro-bind", "/", "/", "true"], capture_output=True, text=True, check=False
    )
    return None if ran.returncode == 0 else f"`{program}` cannot make namespaces: {ran.stderr.strip()}"


def _cgroups_reason() -> str | None:
    """Make a group of our own in which nobody gets more than a millisecond, and see if it is held back."""
    mounts = [line.split() for line in Path("/proc/self/mounts").read_text("ascii").splitlines()]
    places = [Path(one[1]) for one in mounts if one[2] == "cgroup" and "cpu" in one[3].split(",")]
    if not places:
        return "no hierarchy of version 1 has the controller `cpu`"
    own = Path("/proc/self/cgroup").read_text("utf-8").splitlines()
    path = next(line.split(":", 2)[2] for line in own if "cpu" in line.split(":")[1].split(","))
    group = places[0] / path.lstrip("/") / f"tests-{os.getpid()}-{os.urandom(4).hex()}"
    try:
        group.mkdir()
    except OSError as failure:
        return f"no control group can be made: {failure}"
    try:
        (group / "cpu.cfs_quota_us").write_text("1000")

        def compute() -> bool:
            (group / "cgroup.procs").write_text("0")
            while time.process_time() < 0.01:
                pass
            return True

        if _works_in_child(compute) and "nr_throttled 0" not in (group / "cpu.stat").read_text():
            return None
    except OSError as failure:
        return f"a control group cannot be limited: {failure}"
    finally:
        group.rmdir()
    return "control groups hold no process back"


_REASONS: Final[Mapping[str, Callable[[], str | None]]] = {
    "landlock": _landlock_reason,
    "seccomp": _seccomp_reason,
    "rlimits": lambda: None,  # every Linux has them
    "bubblewrap": _bubblewrap_reason,
    "cgroups": _cgroups_reason,
}
LAYERS: Final = tuple(_REASONS)
"""Names of all layers, as site files have them."""


@cache
def missing_reason(layer: str) -> str | None:
    """Say why this host does not offer a layer.

    Returns:
        The reason; None if the host offers it.
    """
    return _REASONS[layer]()


def expected_layers(text: str) -> frozenset[str]:
    """Read the names in `AEROS_EXPECT_LAYERS`."""
    names = frozenset(name.strip() for name in text.split(",") if name.strip())
    if unknown := sorted(names - _REASONS.keys()):
        raise pytest.UsageError(f"{VARIABLE} names {unknown}; there are {', '.join(LAYERS)}")
    return names


def require_layers(*layers: str) -> None:
    """Skip a test where the host does not offer one of `layers`; fail it where that is expected."""
    lacking = {layer: why for layer in layers if (why := missing_reason(layer)) is not None}
    if expected := lacking.keys() & expected_layers(os.environ.get(VARIABLE, "")):
        pytest.fail(f"{VARIABLE} names {sorted(expected)}, which this host lacks: {lacking}")
    if lacking:
        pytest.skip(f"this host lacks {lacking}")


def summary_lines(ran: int, skipped: Sequence[str]) -> Iterable[str]:
    """Say how many tests of the layers ran, and why others did not.

    Args:
        ran: number of tests of the layers that ran.
        skipped: reason of each that was skipped.
    """
    offered = [layer for layer in LAYERS if missing_reason(layer) is None]
    yield f"isolation layers: {ran} tests ran, {len(skipped)} skipped; this host offers {', '.join(offered)}"
    for why in sorted(set(skipped)):
        yield f"  {skipped.count(why)} skipped: {why}"


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Print how many tests of isolation layers ran."""
    found: dict[str, list[Any]] = {
        outcome: [
            one for one in terminalreporter.stats.get(outcome, ()) if "layers" in getattr(one, "keywords", ())
        ]
        for outcome in ("passed", "failed", "error", "skipped")
    }
    skipped = [str(one.longrepr[2]) for one in found.pop("skipped")]
    ran = sum(map(len, found.values()))
    if ran or skipped:
        for line in summary_lines(ran, skipped):
            terminalreporter.write_line(line)
