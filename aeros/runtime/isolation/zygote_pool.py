"""Zygotes at the runtime's end: starts them, has them fork workers, and ends every worker."""

from __future__ import annotations

import importlib.util
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import IO, Final

from aeros.files import temporary_folder
from aeros.runtime.isolation.bubblewrap import find_bubblewrap, wrap_command
from aeros.runtime.isolation.control_groups import ControlGroup, ControlGroupError, ControlGroups
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import USUAL_LIMITS, ProcessLimits

_START: Final = 20.0
"""Timeout for the start of a zygote, s; it takes about 0.1."""

_END: Final = 5.0
"""Timeout for the end of a worker, s; it takes about a millisecond."""

_PACKAGES: Final = ("aeros", "msgspec")
"""Packages that a zygote needs beyond Python's own library."""

_GROUP_ATTEMPTS: Final = 10
"""Times that a process computes in a control group before the group counts as without effect.

On a busy machine the process may get so little time that its group need not hold it back: 1 time in 200,
measured with eight processes on two cores.
"""

_THROTTLED_PERIODS: Final = 3
"""Least number of periods in which a group holds back a process that computes for ten milliseconds.

Measured on an idle machine: 8 to 10 of such a process, at most 1 of a process that only enters and ends.
"""

_MAX_MESSAGE_BYTES: Final = 64 * 1024


class ZygoteError(Exception):
    """There is no worker; the message says why."""


class Zygote:
    """One zygote process. Serves one worker at a time.

    Args:
        preload: names of modules that it imports.
        program: path of bubblewrap; None to do without it.

    Raises:
        ZygoteError: it did not start; the message ends with the last line of its error output.
    """

    def __init__(self, preload: Sequence[str], program: str | None) -> None:
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._process: subprocess.Popen[bytes] | None = None
        self._group: ControlGroup | None = None
        # Handle of the first process in the namespaces, if there are any.
        self._first: int | None = None
        with theirs, tempfile.TemporaryFile() as stderr:
            try:
                self._start(theirs.fileno(), preload, program, stderr)
                theirs.close()
                self._expect_word(b"ready", _START)
            except (OSError, ZygoteError) as failure:
                self.kill()
                stderr.seek(0)
                lines = stderr.read(2000).decode("utf-8", "replace").strip().splitlines()
                raise ZygoteError(f"{failure}" + (f": {lines[-1]}" if lines else "")) from failure

    def probe(self) -> dict[IsolationLayer, str | None]:
        """Probe the isolation layers by their effects.

        Returns:
            For each layer why it is missing, or None if it is in place.
        """
        address = f"aeros-{os.getpid()}-{os.urandom(8).hex()}"
        with socket.socket(socket.AF_UNIX) as listening, temporary_folder() as folder:
            file = folder / "file"
            file.touch()
            listening.bind(f"\0{address}")
            listening.listen()
            self._channel.send(f"probe {os.getpid()} {file} {address}".encode())
            reasons = json.loads(self._receive(_START))
        return {IsolationLayer(name): missing for name, missing in reasons.items()}

    def probe_group(self, groups: ControlGroups) -> str | None:
        """Probe control groups by their effect on a process that computes, and by the usual limits.

        The kernel refuses a group more processor time than the groups around it have. So a runtime
        that has less than a core for itself cannot set every limit that a site may choose.

        Args:
            groups: makes a group.

        Returns:
            Why they are missing; None if they bound its processor time, and take the usual limits.
        """
        try:
            with closing(groups.make()) as group:
                group.set_limits(ProcessLimits(processor=0.5), period_us=2000)
                for _ in range(_GROUP_ATTEMPTS):
                    before = group.throttled_periods()
                    with group.entrances() as entrances:
                        socket.send_fds(self._channel, [b"compute"], entrances)
                    code = int(self._expect_word(b"computed", _START))
                    if code != 0:
                        return f"a process that was to enter a control group ended with {code}"
                    if group.throttled_periods() - before >= _THROTTLED_PERIODS:
                        group.set_limits(USUAL_LIMITS)
                        return None
                return "they were applied and have no effect"
        except (ControlGroupError, OSError) as failure:
            return str(failure)

    def spawn_worker(
        self,
        memory: int | None = None,
        limits: ProcessLimits = USUAL_LIMITS,
        groups: ControlGroups | None = None,
    ) -> socket.socket:
        """Fork a worker. The previous one must have ended.

        Args:
            memory: descriptor of memory that the worker shares, open for reading alone; None for none.
            limits: limits on the worker.
            groups: makes the control group that sets the limits; None if the zygote sees to its share.

        Returns:
            The channel to the worker.

        Raises:
            ZygoteError: the zygote has ended, or there is no control group.
        """
        ours, theirs = socket.socketpair()
        with theirs:
            try:
                shared = () if memory is None else (memory,)
                share = limits.processor if groups is None else 1.0
                with self._entrances(limits, groups) as entrances:
                    message = f"spawn {len(shared)} {share}".encode()
                    socket.send_fds(self._channel, [message], [theirs.fileno(), *shared, *entrances])
            except ControlGroupError as failure:
                ours.close()
                raise ZygoteError(f"the worker has no control group: {failure}") from failure
            except OSError as failure:
                ours.close()
                raise ZygoteError(f"the zygote is gone: {failure}") from failure
        return ours

    def worker_memory(self) -> int | None:
        """Return the most memory that the worker has mapped beyond this zygote's, bytes.

        Returns:
            The size; None if there is no worker, or the system does not say.
        """
        if self._process is None:
            return None
        try:
            *_, zygote, worker = _line_of_descent(self._process.pid)
            # A worker is forked, so it has the command line of its zygote.
            if _process_file(zygote, "cmdline") != _process_file(worker, "cmdline"):
                return None
            return max(_memory_field(worker, "VmPeak") - _memory_field(zygote, "VmSize"), 0)
        except (OSError, ValueError):
            return None

    def end_worker(self) -> int:
        """Kill the worker and every process that it started.

        Returns:
            The exit code of the worker, negative for a signal.

        Raises:
            ZygoteError: the end cannot be confirmed; the zygote was killed with everything below it.
        """
        try:
            self._channel.send(b"kill")
            return int(self._expect_word(b"gone", _END))
        except (OSError, ZygoteError, ValueError) as failure:
            self.kill()
            raise ZygoteError(f"the zygote was killed, as it did not end its worker: {failure}") from failure

    def close(self) -> None:
        """End the zygote and every process below it; safe to call twice."""
        self._channel.close()
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_END)
        self.kill()

    def kill(self) -> None:
        """Kill everything at once; safe to call twice."""
        self._channel.close()
        if self._first is not None:
            # In a process namespace, the kernel then kills everything else in it.
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._first, signal.SIGKILL)
            os.close(self._first)
            self._first = None
        if self._process is not None and self._process.returncode is None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        if self._group is not None:
            self._group.close()
            self._group = None

    @contextmanager
    def _entrances(self, limits: ProcessLimits, groups: ControlGroups | None) -> Iterator[list[int]]:
        """Set the limits of this zygote's control group, and open its entrances; it serves every worker."""
        if groups is None:
            yield []
            return
        if self._group is None:
            self._group = groups.make()
        self._group.set_limits(limits)
        with self._group.entrances() as entrances:
            yield entrances

    def _start(self, control: int, preload: Sequence[str], program: str | None, stderr: IO[bytes]) -> None:
        roots = {name.partition(".")[0] for name in preload} - sys.stdlib_module_names
        packages = [_folder_of(name) for name in sorted(roots.union(_PACKAGES))]
        places = sorted({str(folder.parent) for folder in packages})
        # -S: no installed start-up code (`.pth` files, `sitecustomize`) runs.
        code = (
            f"import sys; sys.path += {places!r}; import {_ZYGOTE} as z; z.main({control}, {list(preload)!r})"
        )
        executable = str(Path(sys.executable).resolve())
        command = [executable, "-I", "-S", "-B", "-c", code]
        if program is None:
            self._popen(command, (control,), stderr)
            return
        readable = [
            sys.base_prefix,
            *(str(folder) for folder in packages),
            *_bundled_library_folders(packages),
        ]
        read_end, write_end = os.pipe()
        try:
            self._popen(wrap_command(program, command, readable, write_end), (control, write_end), stderr)
            os.close(write_end)
            write_end = -1
            self._first = _first_process_handle(read_end)
        finally:
            for end in (read_end, write_end):
                if end >= 0:
                    os.close(end)

    def _popen(self, command: Sequence[str], keep: tuple[int, ...], stderr: IO[bytes]) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - the interpreter itself, and bubblewrap
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            env={"OPENBLAS_NUM_THREADS": "1"},
            cwd="/",
            pass_fds=keep,
            # A new session, so that Ctrl-C at the terminal reaches the runtime alone.
            start_new_session=True,
        )

    def _expect_word(self, word: bytes, seconds: float) -> bytes:
        message = self._receive(seconds)
        reply, _, rest = message.partition(b" ")
        if reply != word:
            raise ZygoteError(f"the zygote says {message[:40]!r} for {word.decode()!r}")
        return rest

    def _receive(self, seconds: float) -> bytes:
        self._channel.settimeout(seconds)
        try:
            message = self._channel.recv(_MAX_MESSAGE_BYTES)
        except OSError as failure:
            raise ZygoteError(f"the zygote does not answer: {failure}") from failure
        if not message:
            raise ZygoteError("the zygote ended")
        return message


class ZygotePool:
    """Pool of zygotes, as many as there are workers at a time; the host is probed once.

    Attributes:
        missing: for each layer why it is missing on this host, or None.

    Args:
        preload: names of modules that skill code may import.
        bubblewrap: its path; by default that of this host's program, if it has one.
    """

    def __init__(self, preload: Sequence[str], bubblewrap: str | None = None) -> None:
        self._preload = tuple(preload)
        self._program = bubblewrap or find_bubblewrap()
        self._idle: list[Zygote] = []
        self._lock = threading.Lock()
        why = "there is no program `bwrap`"
        if self._program is not None:
            try:
                self._idle.append(Zygote(self._preload, self._program))
            except ZygoteError as failure:
                self._program, why = None, f"`{self._program}` does not work here: {failure}"
        if not self._idle:
            self._idle.append(Zygote(self._preload, None))
        self.missing = self._idle[0].probe()
        if self._program is None:
            self.missing[IsolationLayer.BUBBLEWRAP] = why
        self._groups: ControlGroups | None = None
        try:
            self._groups = ControlGroups()
            self.missing[IsolationLayer.CGROUPS] = self._idle[0].probe_group(self._groups)
        except ControlGroupError as failure:
            self.missing[IsolationLayer.CGROUPS] = str(failure)

    def spawn_worker(
        self, memory: int | None = None, limits: ProcessLimits = USUAL_LIMITS
    ) -> tuple[Zygote, socket.socket]:
        """Fork a worker.

        Args:
            memory: descriptor of memory that the worker shares, open for reading alone; None for none.
            limits: limits on the worker; `rlimits` sets that of memory, too, which the worker does itself.

        Returns:
            The zygote that is lent for it, to be given to `release`; and the channel to the worker.

        Raises:
            ZygoteError: there is no worker.
        """
        groups = self._groups if self.missing[IsolationLayer.CGROUPS] is None else None
        while (zygote := self._pop()) is not None:
            try:
                return zygote, zygote.spawn_worker(memory, limits, groups)
            except ZygoteError:
                zygote.kill()  # something else ended it, or removed its control group
        zygote = Zygote(self._preload, self._program)
        try:
            return zygote, zygote.spawn_worker(memory, limits, groups)
        except ZygoteError:
            zygote.kill()
            raise

    def release(self, zygote: Zygote) -> None:
        """Return a zygote to the pool after its worker has ended.

        Args:
            zygote: one that `spawn_worker` lent.
        """
        with self._lock:
            self._idle.append(zygote)

    def _pop(self) -> Zygote | None:
        with self._lock:
            return self._idle.pop() if self._idle else None

    def close(self) -> None:
        """End every zygote that is not lent; safe to call twice."""
        with self._lock:
            idle, self._idle = self._idle, []
        for zygote in idle:
            zygote.close()


_ZYGOTE: Final = "aeros.runtime.isolation.zygote"


def _folder_of(package: str) -> Path:
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ZygoteError(f"`{package}` is not installed")
    return Path(next(iter(spec.submodule_search_locations))).resolve()


def _bundled_library_folders(packages: Sequence[Path]) -> list[str]:
    """Return the folders in which wheels put their shared libraries."""
    return [str(folder.parent / f"{folder.name}.libs") for folder in packages]


def _process_file(process: int, name: str) -> str:
    return Path(f"/proc/{process}/{name}").read_text("utf-8", "replace")


def _line_of_descent(process: int) -> list[int]:
    """Return a process, its first child, the first child of that, and so on."""
    line = [process]
    while children := _process_file(line[-1], f"task/{line[-1]}/children").split():
        line.append(int(children[0]))
    return line


def _memory_field(process: int, name: str) -> int:
    """Read a size of a process from its status, bytes.

    Raises:
        ValueError: the status lacks it, as that of a process that has ended.
    """
    for line in _process_file(process, "status").splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024
    raise ValueError(f"process {process} has no {name}")


def _first_process_handle(info: int) -> int:
    """Open a handle of the first process in the namespaces, from the JSON that bubblewrap writes about it.

    Raises:
        ZygoteError: bubblewrap wrote nothing about it.
    """
    output = b""
    while not output.rstrip().endswith(b"}"):
        readable, _, _ = select.select([info], [], [], _START)
        part = os.read(info, 4096) if readable else b""
        if not part:
            raise ZygoteError("bubblewrap did not report the process that it started")
        output += part
    return os.pidfd_open(json.loads(output)["child-pid"])
