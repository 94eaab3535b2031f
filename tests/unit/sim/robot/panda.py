"""The robot of the reference site, and its numbers."""

from __future__ import annotations

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
