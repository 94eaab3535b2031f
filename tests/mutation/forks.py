"""Work in a fork of this process, with limits of time and memory."""

from __future__ import annotations

import os
import resource
import select
import signal
import tempfile
import time
from collections.abc import Callable
from math import ceil
from typing import Final, TextIO

_MORE_MEMORY: Final = 4 << 30
"""Bytes of address space that a fork may use beyond those of its parent."""


def fork(work: Callable[[TextIO], None], seconds: float) -> tuple[str, str, float]:
    """Run work in a fork.

    Args:
        work: gets a file to write to.
        seconds: of the processor, and four times that of the clock, after which the fork is ended.

    Returns:
        How it ended ("done", "timed out" or "crashed"), all that was written, and seconds of the processor.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _be_the_fork(work, writing, seconds)
    os.close(writing)
    until = time.monotonic() + 4 * seconds + 20
    text, late = b"", False
    while True:
        if not select.select([reading], [], [], max(0.0, until - time.monotonic()))[0]:
            late = True
            break
        part = os.read(reading, 1 << 20)
        if not part:
            break
        text += part
    os.close(reading)
    _end_group(child)
    _, status, usage = os.wait4(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if late or code == -signal.SIGXCPU:
        end = "timed out"
    else:
        end = "done" if text.endswith(b"done\n") else "crashed"
    return end, text.removesuffix(b"done\n").decode(), usage.ru_utime + usage.ru_stime


def _be_the_fork(work: Callable[[TextIO], None], writing: int, seconds: float) -> None:
    try:
        os.setsid()
        limit = ceil(seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        with open("/proc/self/statm", encoding="ascii") as file:
            size = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + _MORE_MEMORY, size + _MORE_MEMORY))
        quiet = os.open(os.devnull, os.O_RDWR)
        for standard in (0, 1, 2):
            os.dup2(quiet, standard)
        with os.fdopen(writing, "w") as pipe:
            try:
                work(pipe)
            except BaseException as error:
                pipe.write(f"\n{error!r}\n".replace("\n", " "))
                raise
            pipe.write("done\n")
    finally:  # a fork never returns into the loop of its parent
        os._exit(0)


def _end_group(child: int) -> None:
    """End the fork, which has written all that it will, and processes that it started."""
    try:
        os.killpg(child, signal.SIGKILL)
    except ProcessLookupError:
        os.kill(child, signal.SIGKILL)


def scratch_folder() -> str:
    """Make a folder for one run."""
    return tempfile.mkdtemp(prefix="aeros-mutation-")
