"""`aeros ros2-messages`: build the ROS 2 message packages of AEROS from PyPI's tools, and install them."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.apps.ros2.message_build import MessageBuildError, build_messages, cache_folder
from aeros.cli.arguments import add_command
from aeros.cli.terminal.streams import print_line
from aeros.exit_codes import Exit

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
For ROS 2 from PyPI (`pip install '.[ros2]'` in the clone of AEROS).  With a sourced ROS 2 distribution, build
the folder aeros_msgs of this package with colcon instead; the distribution has the others.
Without them, `aeros run --ros2` offers what standard message packages can carry.
Wheels are kept in the user's cache, by the digest of the definitions.  A build takes some minutes.

examples:
  aeros ros2-messages
  aeros ros2-messages --out wheels
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "ros2-messages", __doc__, _EXAMPLES)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="copy the wheels there, for another environment (default: install them in this one)",
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    try:
        wheels = build_messages(cache_folder(), print_line)
        if arguments.out is not None:
            arguments.out.mkdir(parents=True, exist_ok=True)
            for wheel in wheels:
                print_line(str(shutil.copy(wheel, arguments.out)))
            return Exit.SUCCESS
    except BrokenPipeError:
        raise
    except OSError as error:
        place = error.filename or arguments.out
        print(f"aeros: cannot write to `{place}`: {error.strerror}; choose another folder", file=sys.stderr)
        return Exit.REJECTED
    except MessageBuildError as error:
        print(f"aeros: {error}", file=sys.stderr)
        return Exit.REJECTED
    install = [sys.executable, "-m", "pip", "install", "--no-deps", "--force-reinstall", "-q"]
    done = subprocess.run([*install, *map(str, wheels)], check=False)  # noqa: S603
    if done.returncode != 0:
        return Exit.REJECTED
    print_line(f"installed {', '.join(wheel.name for wheel in wheels)}")
    return Exit.SUCCESS
