"""Standard input where no client can be is refused in words."""

from __future__ import annotations

import os
import pty
import socket
from pathlib import Path

from aeros.apps.mcp.transports.standard_input import standard_input_problem


def test_a_pipe_a_socket_and_a_terminal_may_be_a_client() -> None:
    descriptors = [*os.pipe(), *pty.openpty(), *(one.detach() for one in socket.socketpair())]
    try:
        assert [standard_input_problem(one) for one in descriptors] == [None] * 6
    finally:
        for descriptor in descriptors:
            os.close(descriptor)


def test_a_device_a_file_a_folder_and_nothing_are_refused(tmp_path: Path) -> None:
    (tmp_path / "messages").write_text("{}\n")
    found = []
    for path in (Path(os.devnull), tmp_path / "messages", tmp_path):
        descriptor = os.open(path, os.O_RDONLY)
        found.append(standard_input_problem(descriptor))
        os.close(descriptor)
    found.append(standard_input_problem(descriptor))
    cure = "a client starts `aeros mcp` and talks to it through a pipe; or serve clients with --http"
    assert found == [
        f"standard input is /dev/null or another device, where no client is: {cure}",
        f"standard input is a file, which cannot read answers: {cure}",
        f"standard input is a folder or block device, where no client is: {cure}",
        f"standard input is closed: {cure}",
    ]
