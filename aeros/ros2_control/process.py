"""The process that drives the controller: `python -m aeros.ros2_control.process`, started by the plant.

It alone has a node of ROS 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.ros2_control.controller import ControllerError
from aeros.ros2_control.trajectory_loop import LoopLimits, TrajectoryLoop
from aeros.wired_arm.link import LinkClosedError, ProcessLink, event
from aeros.wired_arm.process import drive, open_part


def run(order: Mapping[str, Any], link: ProcessLink) -> None:
    """Find the controller, and drive it until the plant closes the link.

    Args:
        order: names and limits, JSON values.
        link: to the plant.
    """
    controller = open_part(link, lambda: _open_controller(order), ControllerError)
    if controller is None:
        return
    try:
        link.send(event("open", has_effort=controller.has_effort))
        limits = LoopLimits(
            tuple(order["acceleration"]),
            tuple(order["jerk"]),
            order["patience"],
            order["start_tolerance"],
            tuple(order["path_tolerance"]),
            order["goal_tolerance"],
        )
        TrajectoryLoop(controller, link, limits).run()
    except LinkClosedError:
        return
    finally:
        controller.close()


def _open_controller(order: Mapping[str, Any]) -> Any:
    """Open the controller.

    Raises:
        ControllerError: there is no rclpy, or the controller cannot be reached.
    """
    try:
        from aeros.ros2_control.ros_controller import RosController
    except ImportError as failure:
        raise ControllerError(
            f"rclpy cannot be imported ({failure}): source a ROS 2 distribution, or install the extra `ros2`"
        ) from failure
    return RosController(order["controller"], tuple(order["joints"]), order["states"])


if __name__ == "__main__":
    drive(run)
