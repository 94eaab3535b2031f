"""Control groups, which bound the processor time, memory and number of a process and all its children.

Version 1 has a hierarchy for each controller, version 2 one for all. A group is a folder there, made below
the runtime's own group; in version 2, below the nearest group that passes the controller `cpu` on. AEROS
changes no group that it did not make. The runtime locks its groups: one that nobody locks belonged to a
runtime that was killed, and the next runtime removes it.
Source: Linux, Documentation/admin-guide/cgroup-v1, cgroup-v2.rst, scheduler/sched-bwc.rst
"""

from __future__ import annotations

import fcntl
import os
import signal
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from aeros.runtime.isolation.limits import ProcessLimits

NO_GROUP: Final = 71
"""Exit code of a process that cannot enter its control group."""

_PREFIX: Final = "aeros-"
_RANDOM_BYTES: Final = 8
_PATTERN: Final = _PREFIX + "[0-9a-f]" * (2 * _RANDOM_BYTES)
"""Pattern of the names that groups get here: one such as `aeros-web` is somebody else's."""

_PERIOD_US: Final = 100_000
"""Time over which the kernel bounds processor time, microseconds: its default."""

_EXTRA_MEMORY: Final = 64 * 1024 * 1024
"""Memory of a group beyond the limit, bytes: for the kernel, and for changed pages of the zygote."""

_REMOVAL_TIMEOUT_S: Final = 0.5
"""Time for killed processes to leave their group, s."""


class ControlGroupError(Exception):
    """There is no control group; the message says why."""


@dataclass(frozen=True)
class _Hierarchy:
    """Place for groups of one hierarchy.

    Attributes:
        folder: the group below which groups are made.
        controllers: names of the controllers that are used there.
        version: version of control groups, 1 or 2.
    """

    folder: Path
    controllers: frozenset[str]
    version: int


class ControlGroup:
    """One control group, a folder in each hierarchy; close it after its processes have ended.

    Args:
        hierarchies: places for its folders.

    Raises:
        ControlGroupError: it cannot be made.
    """

    def __init__(self, hierarchies: Iterable[_Hierarchy]) -> None:
        self._folders: list[tuple[_Hierarchy, Path]] = []
        self._open = ExitStack()
        try:
            for hierarchy in hierarchies:
                folder, lock = _make_locked_folder(hierarchy.folder)
                self._open.callback(os.close, lock)
                self._folders.append((hierarchy, folder))
        except OSError as failure:
            self.close()
            raise ControlGroupError(f"no control group can be made: {failure}") from failure

    @contextmanager
    def entrances(self) -> Iterator[list[int]]:
        """Open its files `cgroup.procs`: a process that writes `0` into each of them enters it.

        Yields:
            The descriptors, closed after the block.

        Raises:
            ControlGroupError: the group was removed.
        """
        with ExitStack() as opened:
            descriptors = []
            for _, folder in self._folders:
                try:
                    descriptor = os.open(folder / "cgroup.procs", os.O_WRONLY | os.O_CLOEXEC)
                except OSError as failure:
                    raise ControlGroupError(f"the control group is gone: {failure}") from failure
                opened.callback(os.close, descriptor)
                descriptors.append(descriptor)
            yield descriptors

    def set_limits(self, limits: ProcessLimits, period_us: int = _PERIOD_US) -> None:
        """Bound the processes of the group.

        Args:
            limits: processor time as a share of one core, memory, and number of processes.
            period_us: time over which processor time is bounded, microseconds.

        Raises:
            ControlGroupError: the kernel refuses the limits, or the group was removed.
        """
        try:
            for hierarchy, folder in self._folders:
                for name, value in _settings(hierarchy, limits, period_us).items():
                    _write(folder / name, value)
        except OSError as failure:
            raise ControlGroupError(f"no limits can be set: {failure}") from failure

    @property
    def entrance_paths(self) -> tuple[str, ...]:
        """Paths of its files `cgroup.procs`."""
        return tuple(str(folder / "cgroup.procs") for _, folder in self._folders)

    def throttled_periods(self) -> int:
        """Count the periods in which the kernel held processes of the group back.

        Returns:
            The number since the group was made.

        Raises:
            ControlGroupError: the kernel does not say.
        """
        for hierarchy, folder in self._folders:
            if "cpu" in hierarchy.controllers:
                with suppress(OSError, ValueError):
                    lines = (folder / "cpu.stat").read_text(encoding="ascii").splitlines()
                    return int(dict(line.split() for line in lines)["nr_throttled"])
        raise ControlGroupError("the kernel does not say if it bounds processor time")

    def kill(self) -> None:
        """Kill all processes of the group, until none is left or they do not end in time."""
        deadline = time.monotonic() + _REMOVAL_TIMEOUT_S
        while (found := self._processes()) and time.monotonic() < deadline:
            for process in found:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            time.sleep(0.002)

    def _processes(self) -> frozenset[int]:
        found: set[int] = set()
        for _, folder in self._folders:
            with suppress(OSError):  # somebody removed it
                found |= set(map(int, (folder / "cgroup.procs").read_text(encoding="ascii").split()))
        return frozenset(found)

    def close(self) -> None:
        """Remove the group; safe to call twice.

        A process in it may need a moment to end; after that, its folder is left to the next runtime.
        """
        deadline = time.monotonic() + _REMOVAL_TIMEOUT_S
        for _, folder in self._folders:
            while not _remove(folder) and time.monotonic() < deadline:
                time.sleep(0.002)
        self._folders = []
        self._open.close()


class ControlGroups:
    """Maker of control groups on this host; removes those of killed runtimes first.

    Args:
        mounts: text of `/proc/self/mountinfo`; read if absent.
        own: text of `/proc/self/cgroup`; read if absent.

    Raises:
        ControlGroupError: this process can bound no processor time by control groups.
    """

    def __init__(self, mounts: str | None = None, own: str | None = None) -> None:
        try:
            mounts = Path("/proc/self/mountinfo").read_text("utf-8") if mounts is None else mounts
            own = Path("/proc/self/cgroup").read_text("utf-8") if own is None else own
        except OSError as failure:
            raise ControlGroupError(f"the kernel has no control groups: {failure}") from failure
        self._hierarchies = tuple(_usable_hierarchies(mounts, own))
        if not any("cpu" in hierarchy.controllers for hierarchy in self._hierarchies):
            raise ControlGroupError("no control group with the controller `cpu` can be made here")
        for hierarchy in self._hierarchies:
            _remove_abandoned(hierarchy.folder)

    def make(self) -> ControlGroup:
        """Make a control group without limits.

        Returns:
            The group, to be closed.

        Raises:
            ControlGroupError: it cannot be made.
        """
        return ControlGroup(self._hierarchies)


def enter_control_group(entrances: Iterable[int]) -> None:
    """Move this process into a control group.

    Args:
        entrances: descriptors of the group's files `cgroup.procs`; they are closed.

    Raises:
        OSError: the group is gone, or refuses the process.
    """
    for descriptor in entrances:
        os.write(descriptor, b"0")
        os.close(descriptor)


def _settings(hierarchy: _Hierarchy, limits: ProcessLimits, period: int) -> Mapping[str, str]:
    """Return the contents of a group's files."""
    settings: dict[str, str] = {}
    quota, memory = int(limits.processor * period), limits.memory + _EXTRA_MEMORY
    if "pids" in hierarchy.controllers:
        settings["pids.max"] = str(limits.processes)
    if "cpu" in hierarchy.controllers:
        if hierarchy.version == 1:
            settings |= {"cpu.cfs_period_us": str(period), "cpu.cfs_quota_us": str(quota)}
        else:
            settings["cpu.max"] = f"{quota} {period}"
    if "memory" in hierarchy.controllers:
        settings["memory.limit_in_bytes" if hierarchy.version == 1 else "memory.max"] = str(memory)
    return settings


def _usable_hierarchies(mounts: str, own: str) -> Iterator[_Hierarchy]:
    """Yield the places where this process may make groups, each with the controllers to use there."""
    own_paths = [line.split(":", 2)[1:] for line in own.splitlines() if line.count(":") >= 2]
    wanted = {"cpu", "memory", "pids"}
    for line in mounts.splitlines():
        fields, _, rest = line.partition(" - ")
        kind, _, options = rest.partition(" ")
        if kind not in ("cgroup", "cgroup2"):
            continue
        root, mount = fields.split(" ")[3:5]
        offered = wanted & set(options.split(" ")[-1].split(","))
        if kind == "cgroup2":
            path = next((path for names, path in own_paths if not names), "/")
            folder = _own_folder(Path(mount), root, path)
            found = _delegating_group(folder, Path(mount))
            if found is not None:
                offered = wanted & set(_words(found / "cgroup.subtree_control"))
                yield _Hierarchy(found, frozenset(offered), 2)
                wanted -= offered
        elif offered:
            path = next((path for names, path in own_paths if offered & set(names.split(","))), "/")
            folder = _own_folder(Path(mount), root, path)
            if os.access(folder, os.W_OK):
                yield _Hierarchy(folder, frozenset(offered), 1)
                wanted -= offered


def _own_folder(mount: Path, root: str, path: str) -> Path:
    """Return the folder of this process's group; in a container, a part of the hierarchy may be mounted."""
    below = Path(path).relative_to(root) if Path(path).is_relative_to(root) else Path()
    return mount / below


def _delegating_group(folder: Path, mount: Path) -> Path | None:
    """Return the nearest group of version 2 that bounds processor time of its children, and is writable."""
    for group in (folder, *folder.parents):
        if not group.is_relative_to(mount):
            return None
        if "cpu" in _words(group / "cgroup.subtree_control") and os.access(group, os.W_OK):
            return group
    return None


def _words(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="ascii").split()
    except OSError:
        return []


def _make_locked_folder(parent: Path) -> tuple[Path, int]:
    """Make a folder and lock it.

    Returns:
        The folder, and the descriptor that holds its lock.

    Raises:
        OSError: it cannot be made.
    """
    while True:
        folder = parent / f"{_PREFIX}{os.urandom(_RANDOM_BYTES).hex()}"
        folder.mkdir(0o700)
        lock = -1
        with suppress(FileNotFoundError, BlockingIOError):  # another runtime found it unlocked: once more
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            if os.path.samestat(folder.stat(), os.fstat(lock)):
                return folder, lock
        if lock >= 0:
            os.close(lock)


def _remove_abandoned(parent: Path) -> None:
    """Remove the groups of runtimes that were killed, unless processes are still in them."""
    for folder in parent.glob(_PATTERN):
        with suppress(OSError):
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(folder)
            finally:
                os.close(lock)


def _remove(folder: Path) -> bool:
    """Remove a group.

    Returns:
        False if it is still there, such as if a process is in it.
    """
    try:
        folder.rmdir()
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True


def _write(file: Path, value: str) -> None:
    # Without O_CREAT: a file that is not there is a limit that this kernel lacks.
    descriptor = os.open(file, os.O_WRONLY | os.O_CLOEXEC)
    try:
        os.write(descriptor, value.encode("ascii"))
    finally:
        os.close(descriptor)
