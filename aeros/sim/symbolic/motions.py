"""Duration and effects of each action kind on the symbolic plant.

Positions in W, SI. A move takes as long as a minimum-jerk profile that peaks at its speed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import dist, isfinite
from typing import Any, Final, NamedTuple

from aeros.sim.clock import TICK
from aeros.sim.geometry import add
from aeros.sim.robot.errors import ActionRejectedError
from aeros.skill import Action
from aeros.spec.expr.types import BoolType, EnumType, RealType, VectorType
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site

_PEAK_TO_MEAN: Final = 1.875
"""Peak over mean speed of the minimum-jerk profile; as in `profile`, which needs NumPy."""

_MIN_SPEED: Final = 1e-3
"""Least speed of a move, m/s; as on the physics plant."""

_CAMERA_TIME: Final = 0.1
"""Exposure and read-out of a camera, s; as on the physics plant."""

_GRIP_TIME: Final = 0.5
"""Time the fingers take to come to rest, s; measured on the physics plant: 0.3 to 0.7."""


class SymbolicMotion(NamedTuple):
    """Effect of an action.

    Attributes:
        duration: s.
        values_during: values by vocabulary name while it is under way, SI.
        values_after: values by vocabulary name once it has ended, SI.
    """

    duration: float
    values_during: Mapping[str, Any]
    values_after: Mapping[str, Any]


def plan_motion(action: Action, values: Mapping[str, Any], site: Site | None = None) -> SymbolicMotion:
    """Compute duration and effects of an action.

    A kind that this plant does not know takes one tick and changes nothing.

    Args:
        action: its kind and parameters, SI.
        values: measured values by vocabulary name, SI.
        site: the site, which names the robot; None for the reference site.

    Returns:
        The motion.

    Raises:
        ActionRejectedError: a parameter is missing, mistyped or out of range.
    """
    if action.kind == "move_joints":
        return _move_joints(action.parameters, values, site)
    planner = _PLANNERS.get(action.kind)
    return SymbolicMotion(TICK, {}, {}) if planner is None else planner(action.parameters, values)


def check_parameters(kind: ActionKind, parameters: Mapping[str, Any]) -> None:
    """Check that parameters are those that an action kind declares, each of its type.

    Args:
        kind: the declared action kind.
        parameters: values by name.

    Raises:
        ActionRejectedError: one is missing, unknown or mistyped.
    """
    for name in kind.parameters:
        if name not in parameters:
            raise ActionRejectedError(f"missing parameter: `{name}`")
    for name, value in parameters.items():
        declared = kind.parameters.get(name)
        if declared is None:
            raise ActionRejectedError(f"unknown parameter: `{name}`")
        match declared.variable.type:
            case RealType():
                _finite(name, value)
            case VectorType():
                _triple(parameters, name)
            case EnumType(members=members):
                if value not in members:
                    raise ActionRejectedError(f"bad parameter: `{name}` is none of {', '.join(members)}")
            case BoolType():
                if not isinstance(value, bool):
                    raise ActionRejectedError(f"bad parameter: `{name}` is not true or false")


def _move_tool(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> SymbolicMotion:
    target, speed = _triple(parameters, "target"), _speed(parameters)
    duration = TICK + _PEAK_TO_MEAN * dist(values.get("tool_position", target), target) / speed
    return SymbolicMotion(duration, {"tool_speed": speed}, {"tool_position": target, "tool_speed": 0.0})


def _move_joints(
    parameters: Mapping[str, Any], values: Mapping[str, Any], site: Site | None
) -> SymbolicMotion:
    """Move the tool straight to where the kinematic chain has it at the target; joints are not modelled."""
    # Imported here: the kinematic chain imports NumPy, which the symbolic plant otherwise avoids.
    from aeros.sim.kinematic.tool_kinematics import tool_kinematics
    from aeros.sim.robot.robot_file import reference_robot, robot_of

    robot, speed = reference_robot() if site is None else robot_of(site), _speed(parameters)
    q = tuple(_number(parameters, f"q{joint}") for joint in range(1, robot.joint_count + 1))

    target = add(tool_kinematics(robot, q).position, values.get("base_position", (0.0, 0.0, 0.0)))
    duration = TICK + _PEAK_TO_MEAN * dist(values.get("tool_position", target), target) / speed
    return SymbolicMotion(duration, {"tool_speed": speed}, {"tool_position": target, "tool_speed": 0.0})


def _move_base(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> SymbolicMotion:
    x, y, speed = _number(parameters, "x"), _number(parameters, "y"), _speed(parameters)
    before = values.get("base_position", (x, y, 0.0))
    way = (x - before[0], y - before[1])
    duration = TICK + _PEAK_TO_MEAN * dist((0.0, 0.0), way) / speed
    changed: dict[str, Any] = {"base_position": (x, y, before[2])}
    if "tool_position" in values:
        # The arm moves with the base.
        tool = values["tool_position"]
        changed["tool_position"] = (tool[0] + way[0], tool[1] + way[1], tool[2])
    return SymbolicMotion(duration, {}, changed)


def _grip(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> SymbolicMotion:
    width, _ = _number(parameters, "width"), _number(parameters, "force")
    return SymbolicMotion(_GRIP_TIME, {}, {"finger_gap": width})


def _wait(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> SymbolicMotion:
    return SymbolicMotion(max(TICK, _number(parameters, "duration")), {}, {})


def _look(parameters: Mapping[str, Any], values: Mapping[str, Any]) -> SymbolicMotion:
    return SymbolicMotion(_CAMERA_TIME, {}, {})


_PLANNERS: Final[dict[str, Callable[[Mapping[str, Any], Mapping[str, Any]], SymbolicMotion]]] = {
    "move_tool": _move_tool,
    "slide": _move_tool,
    "move_base": _move_base,
    "grip": _grip,
    "wait": _wait,
    "look": _look,
}


def _number(parameters: Mapping[str, Any], name: str) -> float:
    return _finite(name, parameters.get(name))


def _triple(parameters: Mapping[str, Any], name: str) -> tuple[float, float, float]:
    value = parameters.get(name)
    if not isinstance(value, tuple) or len(value) != 3:
        raise ActionRejectedError(f"bad parameter: `{name}` is not a 3-tuple")
    x, y, z = value
    if type(x) is type(y) is type(z) is float and isfinite(x) and isfinite(y) and isfinite(z):
        return x, y, z
    return (_finite(name, x), _finite(name, y), _finite(name, z))


def _speed(parameters: Mapping[str, Any]) -> float:
    speed = _number(parameters, "speed")
    if speed < _MIN_SPEED:
        raise ActionRejectedError(f"out of range: `speed` = {speed:g} is below {_MIN_SPEED:g}")
    return speed


def _finite(name: str, value: object) -> float:
    try:
        if type(value) is float:
            if isfinite(value):
                return value
        elif isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value):
            return float(value)
    except OverflowError:
        pass  # an integer too large for a double
    raise ActionRejectedError(f"bad parameter: `{name}` is not a finite number")
