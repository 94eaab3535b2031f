"""The options `--ros2` and `--ros-args` of commands whose robot is on the bus."""

from __future__ import annotations

import argparse
from contextlib import AbstractContextManager, nullcontext

from aeros import __version__
from aeros.apps.ros2.robot_bus import RobotBus, open_robot_bus
from aeros.exit_codes import UsageError
from aeros.runtime.gate.configuration import Configuration


def add_ros2_options(parser: argparse.ArgumentParser) -> None:
    """Add the options.

    Args:
        parser: Parser of the command.
    """
    parser.add_argument(
        "--ros2",
        action="store_true",
        help="publish on ROS 2 and offer pause, resume and stop there; this machine only by default",
    )
    parser.add_argument(
        "--ros-args",
        nargs=argparse.REMAINDER,
        default=[],
        metavar="...",
        help="all further arguments are for ROS 2, as in --ros-args -r __ns:=/robot1",
    )


def open_peers(
    arguments: argparse.Namespace, configuration: Configuration
) -> AbstractContextManager[RobotBus | None]:
    """Open the node if the options ask for it.

    Args:
        arguments: Parsed options.
        configuration: Site and modules in force.

    Returns:
        A context manager of the robot's bus, or of None.

    Raises:
        UsageError: `--ros-args` is given without `--ros2`.
    """
    if not arguments.ros2:
        if arguments.ros_args:
            raise UsageError("--ros-args needs --ros2")
        return nullcontext()
    site = configuration.site
    facts = {
        "aeros_version": __version__,
        "site": site.id,
        "site_digest": site.digest,
        "modules": sorted(configuration.modules),
        "plant": arguments.plant,
    }
    return open_robot_bus(arguments.state, site, facts, arguments.ros_args)
