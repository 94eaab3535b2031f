"""Initial values on the symbolic plant: harmless, and inside every declared range."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from math import pi
from typing import Any, Final

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, RealType, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

_REFERENCE_ROBOT: Final = "panda"
"""Robot whose ready posture `_DEFAULT_VALUES` has, so that no NumPy is needed for it."""

_DEFAULT_VALUES: Final[Mapping[str, tuple[float, ...]]] = {
    # Franka's ready posture, and the tool position in it.
    "joint_position": (0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4),
    "tool_position": (0.307, 0.0, 0.487),
    "base_position": (0.0, 0.0, 0.0),
    "finger_gap": (0.08,),
    # The area scanner's reading when nobody is in range, as on the physics plant.
    "human_distance": (20.0,),
}
"""Values by vocabulary name, SI, positions in W; others are 0, false, or an enum's first member."""

_DEFAULT_POSITION: Final = (0.45, 0.0, 0.15)
"""Default position of anything else, in W, m: in front of the arm, clear of its column and of the table.
Modules' own positions have it only where a skill's outcome changes them (`unknown_positions`)."""


def initial_values(site: Site, given: Mapping[str, Any]) -> dict[str, Any]:
    """Compute an initial value for every state variable.

    Args:
        site: whose vocabulary is measured.
        given: values that differ from the default, by vocabulary name, SI.

    Returns:
        `given`, and for the other variables the default, moved into its range.

    Raises:
        MisuseError: a name is not in the vocabulary.
        UserError: the site's robot cannot be used.
    """
    unknown = given.keys() - site.state.keys()
    if unknown:
        raise MisuseError(f"`{min(unknown)}` is not a state variable of the site")
    usual = {**_DEFAULT_VALUES, **_ready_values(site)}
    return {
        name: as_reading(given[name], declared) if name in given else _default_value(name, declared, usual)
        for name, declared in site.state.items()
    }


def _ready_values(site: Site) -> Mapping[str, tuple[float, ...]]:
    """Compute joint and tool positions of the ready posture of a site's robot, in W."""
    if site.robot is None or site.robot == _REFERENCE_ROBOT:
        return {}
    try:
        from aeros.sim.kinematic.tool_kinematics import tool_kinematics
        from aeros.sim.robot.robot_file import robot_of
    except ImportError:  # NumPy, without which no plant has an arm
        return {}
    robot = robot_of(site)
    ready = tuple(robot.postures.ready.tolist())
    return {"joint_position": ready, "tool_position": tool_kinematics(robot, ready).position}


def unknown_positions(modules: Iterable[Ecm], given: Container[str]) -> frozenset[str]:
    """List the positions that modules measure and of which nobody says where they are.

    Args:
        modules: the modules.
        given: names of the variables that have an initial value.

    Returns:
        Full names of the modules' own variables that are positions, have no initial value, and get none from
        an outcome of a skill.
    """
    all_modules = list(modules)
    outcomes = [
        one for ecm in all_modules for skill in ecm.skills.values() for one in skill.outcomes.values()
    ]
    changed = {name for one in outcomes for name in (*one.effects, *(each.variable for each in one.ranges))}
    return frozenset(
        name
        for ecm in all_modules
        for name, declared in ecm.state.items()
        if is_position(declared) and name not in given and name not in changed
    )


def answers_of_tools(site: Site, given: Container[str]) -> frozenset[str]:
    """List the variables that only a service answers, which is not simulated.

    Args:
        site: the site.
        given: names of the variables that have an initial value.

    Returns:
        Names of the variables that tools answer, without those that are given.
    """
    tools = (kind.tool for kind in site.kinds.values() if kind.tool is not None)
    return frozenset(name for tool in tools for name in tool.answers if name not in given)


def is_position(declared: Declared) -> bool:
    """Check if a variable is a vector of lengths.

    Args:
        declared: the variable.

    Returns:
        True if it is.
    """
    type_ = declared.variable.type
    return isinstance(type_, VectorType) and type_.dimension == LENGTH


def as_reading(value: Any, declared: Declared) -> Any:
    """Convert an exact value to what a sensor reads: reals become floats inside their range.

    Args:
        value: exact value as elaborated: a fraction, a word, a boolean, or a tuple of them.
        declared: the state variable.

    Returns:
        The value as the gate accepts it.
    """
    if isinstance(value, tuple):
        return tuple(as_reading(part, declared) for part in value)
    if isinstance(value, Fraction):
        return nearest_double_in_range(value, declared.range)
    return value


def _default_value(name: str, declared: Declared, usual: Mapping[str, tuple[float, ...]]) -> Any:
    match declared.variable.type:
        case BoolType():
            return False
        case EnumType(members=members):
            return members[0]
        case VectorType(dimension=dimension):
            return _default_reals(
                usual.get(name, _DEFAULT_POSITION if dimension == LENGTH else ()), declared, 3
            )
        case FamilyType(index=index, element=RealType()):
            return _default_reals(usual.get(name, ()), declared, len(index.members))
        case FamilyType(index=index):
            return (False,) * len(index.members)
        case RealType():
            return _default_reals(usual.get(name, ()), declared, 1)[0]


def _default_reals(usual: tuple[float, ...], declared: Declared, count: int) -> tuple[float, ...]:
    values = usual if len(usual) == count else (0.0,) * count
    return tuple(_clamp(value, declared.range) for value in values)


@lru_cache(maxsize=1024)  # a vocabulary has few ranges and hundreds of numbers
def _clamp(value: float, range_: tuple[Fraction, Fraction] | None) -> float:
    exact = Fraction(value)
    if range_ is not None:
        lower, upper = range_
        exact = min(max(exact, lower), upper)
    return nearest_double_in_range(exact, range_)
