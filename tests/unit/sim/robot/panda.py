"""The robot of the reference site, and its numbers."""

from __future__ import annotations

from dataclasses import replace

from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot_file import reference_robot

PANDA = reference_robot()
CAPSULES = PANDA.capsules
PANDA_BODY = PANDA.body
READY_POSTURE = PANDA.postures.ready
Q_MIN, Q_MAX = PANDA.limits.lowest, PANDA.limits.highest
QD_MAX, QDD_MAX = PANDA.limits.speed, PANDA.limits.acceleration
TAU_MAX = PANDA.limits.torque
FLANGE = PANDA.hand.flange
FLANGE_TO_TOOL = PANDA.hand.tool
FINGER_GAP_MAX, FINGER_SPEED = PANDA.hand.widest_gap, PANDA.hand.finger_speed
TORQUE_THRESHOLDS = PANDA.servos.felt_torque
ZEROS = (0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7)


def with_zeros(model: RobotModel) -> RobotModel:
    """Return the same arm, whose joints count from elsewhere: position q there is q + `ZEROS` here, rad."""
    rows = tuple(
        (a, alpha, d, zero) for (a, alpha, d, *_), zero in zip(model.body.dh_rows, ZEROS, strict=True)
    )
    limits = replace(model.limits, lowest=model.limits.lowest - ZEROS, highest=model.limits.highest - ZEROS)
    postures = replace(model.postures, ready=model.postures.ready - ZEROS)
    return replace(
        model, body=replace(model.body, dh_rows=rows), limits=limits, postures=postures, stock_urdf=None
    )
