"""An arm with one vertical joint: decides one of its motions, and says the codes of the reasons."""

import sys
from math import cos, sin

from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.merged import ConcurrentMotion
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Ball, Hull, Obstacle, Reading, RobotBody, Trajectory
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site

START, END = 0.0, 0.5
DURATION = 2.0
MEASURED = 0.0
ASKED = 0.5
ANOTHER_MOVES = False
POST = (0.0, -0.5, 0.5)
BOX = None

corners = [START + (END - START) * third / 3.0 for third in range(4)]
path = (tuple((corner,) for corner in corners),)
balls = tuple(Ball("arm", 1, (0.1 * number, 0.0, 0.5), 0.06) for number in range(6))
hulls = (Hull("arm", 1, ((0.0, 0.0, 0.5), (0.5, 0.0, 0.5)), 0.06), Hull("post", 0, (POST,), 0.05))
body = RobotBody(dh_rows=((0.0, 0.0, 0.0),), tool_offset=(0.5, 0.0, 0.5), balls=balls, hulls=hulls)
motion = Trajectory(body, (path,), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), DURATION)

target = (0.5 * cos(ASKED), 0.5 * sin(ASKED), 0.5)
allowed = Decision(DecisionKind.ALLOW, act("move", target=target, speed=0.25), ())
decider = MotionDecider(load_site("site.yaml", Diagnostics()).motion)
others = [ConcurrentMotion(allowed.action, motion, elapsed_s=0.5)] if ANOTHER_MOVES else []
seen = [Obstacle("unknown-object-1", *BOX, 9.0, "overhead", "bench")] if BOX else []
decided = decider.decide(allowed, motion, {"joint_angle": Reading((MEASURED,), 10.0)}, others, seen)
sys.stdout.write(" ".join(reason.code for reason in decided.reasons))
