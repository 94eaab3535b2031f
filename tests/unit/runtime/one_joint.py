"""A site whose actions are decided as whole motions of one joint, and such motions: one moves nothing."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.runtime.ports import Ball, RobotBody, Trajectory
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, FamilyType, RealType
from aeros.spec.expr.units import ANGLE
from aeros.spec.model.motion import MotionKind, MotionPolicy, ToolLimits
from aeros.spec.model.site import Site
from tests.unit.runtime.conftest import declare

PLAN = Trajectory(
    RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.5), (Ball("arm", 1, (0.0, 0.0, 0.0), 0.1),)),
    ((((0.0,),) * 4,),),
    (0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0),
    1.0,
)
TURNS = replace(PLAN, joint_paths=((((0.0,), (0.003,), (0.006,), (0.009,)),),))
DRIVES = replace(PLAN, base_path=(0.01, 0.0, 0.0))


def governed(site: Site, *kinds: str) -> Site:
    """The site, with actions of these kinds decided as whole motions of one joint, between -2 and 2 rad."""
    one, rates = (Fraction(1),), (Fraction(1), Fraction(1), Fraction(1))
    policy = MotionPolicy(
        kinds={kind: MotionKind(None, None, None) for kind in kinds},
        start_variable="joint_angle",
        start_tolerance=Fraction(1, 100),
        end_tolerance=Fraction(1, 100),
        lowest=(Fraction(-2),),
        highest=(Fraction(2),),
        joint_limits=(one, one, one),
        tool_limits=ToolLimits(rates, rates),
        clearance=Fraction(0),
        barriers=(),
    )
    joints = EnumType("joints", ("shoulder",))
    angle = declare(
        "joint_angle", FamilyType(joints, RealType(ANGLE)), t.VariableRole.STATE, max_age=Fraction(1)
    )
    return replace(site, motion=policy, state={**site.state, "joint_angle": angle})
