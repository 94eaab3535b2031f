"""Zygote process: has everything imported that a worker needs, so that forking a worker is quick.

It runs no skill code itself, serves one worker at a time, and adopts the worker's orphans. When a worker has
ended or is to end, the zygote kills all of its own descendants, and reports only when there are none left.
It ends, and everything below it ends, when the runtime hangs up.

Messages come one per packet:
    spawn MEMORY SHARE         with descriptors: the worker's channel; memory that it shares with the runtime,
                               if MEMORY is 1; the entrances of its control group, if it has one; SHARE is the
                               share of a core that the zygote sees to, and 1 in a control group
    kill
    probe PID PATH ADDRESS
    compute                    with descriptors: the entrances of a control group
and the replies are:
    ready | gone EXITCODE | JSON of the probes' results | computed EXITCODE
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
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from aeros.runtime.isolation.control_groups import NO_GROUP, enter_control_group
from aeros.runtime.isolation.kernel import end_descendants
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer, close_all_but
from aeros.runtime.isolation.privileges import become_subreaper
from aeros.runtime.isolation.probe import probe_layer, probe_sandbox
from aeros.runtime.isolation.processor_share import WatchedWorker
from aeros.runtime.isolation.worker import serve

_MAX_MESSAGE_BYTES: Final = 64 * 1024

_MAX_DESCRIPTORS: Final = 8

_COMPUTE_S: Final = 0.01
"""Processor time of a probe of a control group, s; the kernel looks at its account every few milliseconds."""


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
            message, descriptors, _, _ = socket.recv_fds(channel, _MAX_MESSAGE_BYTES, _MAX_DESCRIPTORS)
            word, *arguments = message.split(b" ", 3)
            if word == b"spawn" and descriptors:
                has_memory, share = int(arguments[0]), float(arguments[1])
                worker_channel, memory = descriptors[0], descriptors[1] if has_memory else None
                _fork_worker(channel, worker_channel, memory, descriptors[1 + has_memory :], share)
            elif word == b"probe":
                channel.send(json.dumps(_probe([one.decode() for one in arguments])).encode())
            elif word == b"compute":
                _, status = os.waitpid(_fork(_compute, descriptors), 0)
                channel.send(b"computed %d" % os.waitstatus_to_exitcode(status))
            elif not message:
                return


def _fork(run: Callable[[], None], entrances: Sequence[int]) -> int:
    """Fork a process that enters a control group, if there is one, and then calls `run`.

    Returns:
        Its process id.
    """
    child = os.fork()
    if child == 0:
        code = NO_GROUP
        try:
            enter_control_group(entrances)
            code = 70
            run()
            code = 0
        finally:
            os._exit(code)
    for descriptor in entrances:
        os.close(descriptor)
    return child


def _fork_worker(
    control: socket.socket, channel: int, memory: int | None, entrances: Sequence[int], share: float
) -> None:
    """Fork a worker that talks over `channel`; wait for its end and end all its descendants."""

    def run() -> None:
        control.close()
        serve(channel, memory)

    worker = _fork(run, entrances)
    if memory is not None:
        os.close(memory)
    os.close(channel)
    ended = os.pidfd_open(worker)
    watched = WatchedWorker(worker, share) if share < 1 else None
    try:
        while not any(
            select.select([control.fileno(), ended], [], [], None if watched is None else watched.watch())
        ):
            pass
    finally:
        os.close(ended)
    # Either it ended by itself, or there is a message, which can only be `kill`.
    os.kill(worker, signal.SIGKILL)
    _, status = os.waitpid(worker, 0)
    end_descendants()
    with suppress(OSError):
        control.send(b"gone %d" % os.waitstatus_to_exitcode(status))


def _compute() -> None:
    """Use more processor time than the control group of a probe has in one period."""
    while time.process_time() < _COMPUTE_S:
        pass


def _probe(surroundings: Sequence[str]) -> dict[str, str | None]:
    """Return for each layer why it is missing, or None."""
    reasons = {layer.value: probe_layer(layer) for layer in APPLY_LAYER}
    pid, path, address = surroundings
    reasons[IsolationLayer.BUBBLEWRAP.value] = probe_sandbox(int(pid), path, address)
    return reasons
