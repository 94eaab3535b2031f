"""Check that standard input is a client: a pipe or socket, or a person at a terminal."""

from __future__ import annotations

import os
import stat

_CURE = "a client starts `aeros mcp` and talks to it through a pipe; or serve clients with --http"


def standard_input_problem(descriptor: int = 0) -> str | None:
    """Say why nobody can talk through a file descriptor.

    The server would otherwise open the robot, find no client, and end with success.

    Args:
        descriptor: The descriptor of standard input.

    Returns:
        The reason and what to do; None if a client or a person may be there.
    """
    try:
        mode = os.fstat(descriptor).st_mode
    except OSError:
        return f"standard input is closed: {_CURE}"
    if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode) or os.isatty(descriptor):
        return None
    if stat.S_ISREG(mode):
        return f"standard input is a file, which cannot read answers: {_CURE}"
    if stat.S_ISCHR(mode):
        return f"standard input is /dev/null or another device, where no client is: {_CURE}"
    return f"standard input is a folder or block device, where no client is: {_CURE}"
