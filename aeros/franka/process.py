"""Processes that drive the robot: `python -m aeros.franka.process`, started by the plant.

They alone import `pylibfranka`: it may block for a millisecond at a time, and the plant must not.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Mapping
from typing import Any, Final

from aeros.franka.hand_loop import run_hand
from aeros.franka.libfranka import LibfrankaArm, LibfrankaHand
from aeros.franka.streamer import Streamer
from aeros.wired_arm.arm import ArmError
from aeros.wired_arm.link import LinkClosedError, ProcessLink, event
from aeros.wired_arm.process import drive, open_part

_PRIORITY: Final = 80
"""Real-time priority of the process that drives the arm, as libfranka gives its own threads at most 99."""


def run(order: Mapping[str, Any], link: ProcessLink) -> None:
    """Open a part of the robot, and drive it until the plant closes the link.

    Args:
        order: the part and its settings.
        link: to the plant.
    """
    part = open_part(link, lambda: _open_part(order), ArmError)
    if part is None:
        return
    try:
        link.send(event("open"))
    except LinkClosedError:
        return
    if order["part"] == "hand":
        run_hand(part, link)
        return
    # A collection takes milliseconds, and this loop has one.
    gc.collect()
    gc.disable()
    Streamer(
        part, link, order["acceleration"], order["jerk"], order["patience"], order["start_tolerance"]
    ).run()


def _open_part(order: Mapping[str, Any]) -> Any:
    """Open the arm or the hand.

    Raises:
        ArmError: the robot cannot be reached.
    """
    if order["part"] == "hand":
        return LibfrankaHand(order["address"])
    if order["real_time"]:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        except OSError as failure:
            raise ArmError(
                f"this process may not have real-time priority {_PRIORITY}: {failure.strerror}; give the "
                "user `rtprio` in /etc/security/limits.conf (docs/how-to/real-franka.md)"
            ) from failure
    arm = LibfrankaArm(order["address"], real_time=order["real_time"])
    arm.set_thresholds(tuple(order["torques"]), tuple(order["forces"]))
    return arm


if __name__ == "__main__":
    drive(run)
