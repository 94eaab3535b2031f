"""Server of the commands that pages show: each runs in a fork of one process that has AEROS imported.

To import AEROS takes a third of a second, and a page has a dozen commands. A command has a process, a
working folder, an environment and streams of its own, as if a shell had started `aeros`, and its film has
fewer pictures: one in ten simulated seconds. `python FILE` is served likewise; all else that `python` is
asked for runs in a new interpreter.

    python -m tests.commands.server FOLDER     serves until its standard input is closed
"""

from __future__ import annotations

import atexit
import gc
import importlib
import marshal
import os
import runpy
import selectors
import socket
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Final, NoReturn

from tests.repo.tree import ROOT

_PRELOADED: Final = (
    "aeros.cli.author.new.command",
    "aeros.cli.author.predict",
    "aeros.cli.author.verify",
    "aeros.cli.records.audit",
    "aeros.cli.records.report",
    "aeros.cli.run.decide",
    "aeros.cli.run.run",
    "aeros.cli.top.top",
    "rich.console",
    "rich.table",
    "z3",
)
"""Modules that most commands import."""

_SOCKET: Final = "socket"

_CLIENT: Final = """#!{python} -IS
import _socket, marshal, os, sys
name = os.path.basename(sys.argv[0])
if name == "python" and not (len(sys.argv) > 1 and sys.argv[1].endswith(".py")):
    os.execv({python!r}, sys.argv)
server = _socket.socket(_socket.AF_UNIX, _socket.SOCK_STREAM)
server.connect({address!r})
request = marshal.dumps((sys.argv, os.getcwd(), dict(os.environ)))
rights = (_socket.SOL_SOCKET, _socket.SCM_RIGHTS, b"".join(fd.to_bytes(4, sys.byteorder) for fd in range(3)))
server.sendmsg([len(request).to_bytes(8, "big")], [rights])
server.send(request, _socket.MSG_WAITALL) == len(request) or sys.exit("the request was cut off")
status = server.recv(1)
os._exit(status[0] if status else 255)
"""
"""Program in place of `aeros` and of `python`: it passes its request on, and ends as the command ends."""


@cache
def commands_folder() -> Path:
    """Return a folder with `aeros` and `python`, for the front of PATH; starts the server if it does not run.

    Returns:
        The folder, which lives as long as this process.
    """
    folder = Path(mkdtemp(prefix="aeros-commands-"))
    command = [sys.executable, "-m", "tests.commands.server", str(folder)]
    server = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert server.stdout is not None
    atexit.register(server.communicate)
    assert server.stdout.readline() == b"ready\n"
    return folder


def serve(folder: Path) -> None:
    """Answer requests until standard input is closed, then remove the folder.

    Args:
        folder: Place of the socket and of the programs that ask.
    """
    address = str(folder / _SOCKET)
    names = ("aeros", "python")
    with socket.socket(socket.AF_UNIX) as listener, selectors.DefaultSelector() as selector:
        listener.bind(address)
        listener.listen()
        for name in names:
            (folder / name).write_text(_CLIENT.format(python=sys.executable, address=address))
            (folder / name).chmod(0o755)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        gc.freeze()
        selector.register(listener, selectors.EVENT_READ)
        selector.register(sys.stdin, selectors.EVENT_READ)
        while all(key.fileobj is listener for key, _ in selector.select()):
            connection, _ = listener.accept()
            if os.fork() == 0:
                selector.close()
                listener.close()
                _answer(connection)
            connection.close()
    with suppress(ChildProcessError):
        while True:  # their time is counted as ours
            os.waitpid(-1, 0)
    for name in (*names, _SOCKET):
        (folder / name).unlink()
    folder.rmdir()


def _answer(connection: socket.socket) -> NoReturn:
    """Run one command in another fork, and send its exit code.

    Raises:
        SystemExit: in the fork that ran the command.
    """
    size, streams, _, _ = socket.recv_fds(connection, 8, 3)
    request = connection.recv(int.from_bytes(size, "big"), socket.MSG_WAITALL)
    arguments, folder, environment = marshal.loads(request)  # noqa: S302 - of our own client
    child = os.fork()
    if child == 0:
        connection.close()
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        sys.stdin, sys.stdout = os.fdopen(0, closefd=False), os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, errors="backslashreplace", closefd=False)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        _run(arguments)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    connection.send(bytes([code if code >= 0 else 128 - code]))
    os._exit(0)


def _run(arguments: list[str]) -> NoReturn:
    """Run `aeros …` or `python FILE …`, as a new interpreter does.

    Raises:
        SystemExit: with the exit code.
    """
    program, *rest = arguments
    if Path(program).name == "python":
        sys.argv = rest
        sys.path[0] = str(Path(rest[0]).resolve().parent)
        runpy.run_path(rest[0], run_name="__main__")
        sys.exit(0)
    from aeros.__main__ import start

    sys.argv = arguments
    sys.path[0] = str(Path(program).parent)
    sys.exit(start())


def _preload() -> None:
    for name in _PRELOADED:
        importlib.import_module(name)
    try:
        import aeros.sim.physics  # noqa: F401
    except ImportError:  # PyBullet has wheels for Python 3.11 only
        return


if __name__ == "__main__":
    _preload()
    serve(Path(sys.argv[1]))
