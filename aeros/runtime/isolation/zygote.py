"""Zygote process: has everything imported that a worker needs, so that forking a worker is quick.

It runs no skill code itself, serves one worker at a time, and adopts the worker's orphans. When a worker has
ended or is to end, the zygote kills all of its own descendants, and reports only when there are none left.
It ends, and everything below it ends, when the runtime hangs up.

Messages come one per packet:  spawn (with the worker's channel, and memory that it shares with the runtime,
                               if any) | kill | probe PID PATH ADDRESS
and the replies are:           ready | gone EXITCODE | JSON of the probes' results
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import select
import signal
import socket
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer, close_all_but
from aeros.runtime.isolation.privileges import become_subreaper
from aeros.runtime.isolation.probe import probe_layer, probe_sandbox
from aeros.runtime.isolation.worker import serve

_MAX_MESSAGE_BYTES: Final = 64 * 1024


def main(control: int, preload: Sequence[str]) -> None:
    """Serve the runtime until it hangs up.

    Args:
        control: descriptor of a socket whose other end the runtime holds.
        preload: names of modules to import before the first worker is forked.
    """
    close_all_but(control)
    become_subreaper()
    for name in preload:
        importlib.import_module(name)
    # These objects live forever: workers need not scan, and so not copy, them.
    gc.freeze()
    with socket.socket(fileno=control) as channel:
        channel.send(b"ready")
        while True:
            message, descriptors, _, _ = socket.recv_fds(channel, _MAX_MESSAGE_BYTES, 2)
            word = message.partition(b" ")[0]
            if word == b"spawn" and descriptors:
                _fork_worker(channel, *descriptors)
            elif word == b"probe":
                channel.send(json.dumps(_probe(message.decode().split(" ", 3)[1:])).encode())
            elif not message:
                return


def _fork_worker(control: socket.socket, channel: int, memory: int | None = None) -> None:
    """Fork a worker that talks over `channel`; wait for its end and end all its descendants."""
    worker = os.fork()
    if worker == 0:
        try:
            control.close()
            serve(channel, memory)
            os._exit(0)
        finally:
            os._exit(70)
    if memory is not None:
        os.close(memory)
    os.close(channel)
    ended = os.pidfd_open(worker)
    try:
        select.select([control.fileno(), ended], [], [])
    finally:
        os.close(ended)
    # Either it ended by itself, or there is a message, which can only be `kill`.
    os.kill(worker, signal.SIGKILL)
    _, status = os.waitpid(worker, 0)
    _end_descendants()
    with suppress(OSError):
        control.send(b"gone %d" % os.waitstatus_to_exitcode(status))


def _end_descendants() -> None:
    """Kill descendants until none is left; orphans of a killed process become children, to be killed next."""
    while True:
        try:
            reaped, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if reaped == 0:
            for child in _children():
                with suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)
            time.sleep(0.0005)


def _children() -> list[int]:
    files = Path("/proc/self/task").glob("*/children")
    return [int(pid) for file in files for pid in file.read_text(encoding="ascii").split()]


def _probe(surroundings: Sequence[str]) -> dict[str, str | None]:
    """Return for each layer why it is missing, or None."""
    reasons = {layer.value: probe_layer(layer) for layer in APPLY_LAYER}
    pid, path, address = surroundings
    reasons[IsolationLayer.BUBBLEWRAP.value] = probe_sandbox(int(pid), path, address)
    return reasons
