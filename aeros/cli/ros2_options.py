"""The options `--ros2` and `--ros-args` of commands whose robot is on the bus."""

from __future__ import annotations

import argparse
import time
from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec

from aeros import __version__
from aeros.apps.ros2.robot_bus import RobotBus, open_robot_bus
from aeros.cli.terminal.rendering import print_labelled
from aeros.distribution import install_command
from aeros.exit_codes import UsageError
from aeros.runtime.bus.names import check_ros_name
from aeros.runtime.bus.ros2.topic_sensors import SAMPLERS, TopicSensor
from aeros.runtime.gate.configuration import Configuration
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.expr.types import RealType
from aeros.spec.model.site import Site


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
        "--topic-sensor",
        action="append",
        default=[],
        metavar="NAME=TOPIC[:TYPE]",
        help="measure this state variable by a ROS 2 topic in place of the plant; "
        f"TYPE is {', '.join(SAMPLERS)} (default: the first)",
    )
    parser.add_argument(
        "--ros-args",
        nargs=argparse.REMAINDER,
        default=[],
        metavar="...",
        help="all further arguments are for ROS 2, as in --ros-args -r __ns:=/robot1",
    )


def require_ros2_options(arguments: argparse.Namespace) -> None:
    """Check the options before anything begins.

    Args:
        arguments: Parsed options.

    Raises:
        UsageError: `--ros-args` or `--topic-sensor` is given without `--ros2`, or there is no rclpy.
    """
    if not arguments.ros2:
        for option in ("ros_args", "topic_sensor"):
            if getattr(arguments, option):
                raise UsageError(f"--{option.replace('_', '-')} needs --ros2")
    elif find_spec("rclpy") is None:
        raise UsageError(
            "--ros2 needs rclpy: source your ROS 2 distribution, or, to try it, " + install_command("ros2")
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
        UsageError: a sensor on a topic is malformed.
    """
    require_ros2_options(arguments)
    if not arguments.ros2:
        return nullcontext()
    site = configuration.site
    facts = {
        "aeros_version": __version__,
        "site": site.id,
        "site_digest": site.digest,
        "modules": sorted(configuration.modules),
        "plant": arguments.plant,
    }
    sensors = [read_topic_sensor(text, site) for text in arguments.topic_sensor]
    return open_robot_bus(arguments.state, site, facts, arguments.ros_args, sensors)


def read_topic_sensor(text: str, site: Site) -> TopicSensor:
    """Read the value of `--topic-sensor`.

    Args:
        text: As in `human_distance=/scanner/nearest:sensor_msgs/msg/Range`.
        site: Declares the variable.

    Returns:
        The sensor.

    Raises:
        UsageError: It is malformed, the variable is no number of the site, or the type is none of a sensor.
    """
    name, _, source = text.partition("=")
    topic, _, ros = source.partition(":")
    ros = ros or next(iter(SAMPLERS))
    numbers = sorted(key for key, one in site.state.items() if type(one.variable.type) is RealType)
    if name not in numbers:
        near = did_you_mean(name, numbers)
        hint = f"; did you mean `{near}`?" if near else f": one of {', '.join(numbers)}"
        raise UsageError(f"--topic-sensor {text}: `{name}` is no number of the site{hint}")
    if ros not in SAMPLERS:
        raise UsageError(f"--topic-sensor {text}: `{ros}` is none of {', '.join(SAMPLERS)}")
    try:
        check_ros_name(topic)
    except ValueError as error:
        raise UsageError(f"--topic-sensor {text}: {error}") from error
    return TopicSensor(name, topic, ros, time.monotonic)


def print_bus(peers: RobotBus, task: str = "") -> None:
    """Print the node of a run, and what its listeners do not get.

    Args:
        peers: The bus of the run.
        task: What the node does now, for its line.
    """
    print_labelled("ros2", f"{peers.summary()}; {task}" if task else peers.summary())
    for remark in peers.remarks():
        print_labelled("", remark)
