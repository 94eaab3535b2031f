"""Messages with measurements: `sensor_msgs/JointState`, `geometry_msgs/PointStamped`, and stamped values.

Variables over an index set are joint variables if one of them is measured in rad. Then rad is the position,
rad/s the velocity and N·m the effort. If several variables could be the same quantity, that field stays
empty, unless the site's motion policy names one of them as the joints' position.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Any, Final

from aeros.runtime.bus.messages import (
    BoolStamped,
    Float64Stamped,
    Header,
    JointState,
    Point,
    PointStamped,
    StringStamped,
    stamp,
)
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, RealType, VectorType
from aeros.spec.expr.units import ANGLE, FORCE, JOINT, LENGTH, TIME
from aeros.spec.model.site import Site

WORLD: Final = "world"
"""The frame of every vector of the vocabulary."""

_QUANTITIES: Final = {
    ANGLE: "position",
    ANGLE * TIME**-1: "velocity",
    FORCE * LENGTH: "effort",
    JOINT: "position",
    JOINT * TIME**-1: "velocity",
    FORCE * LENGTH * JOINT**-1: "effort",
}


class JointFamily:
    """Joint variables over one index set.

    Attributes:
        names: names of the joints.

    Args:
        names: names of the joints.
        families: variable by field of `JointState`.
    """

    def __init__(self, names: tuple[str, ...], families: dict[str, str]) -> None:
        self.names = names
        self._families = families

    def joint_state_messages(self, readings: Readings) -> Iterator[JointState]:
        """Make a message for each time at which some of the joint variables were measured.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.

        Yields:
            Messages, the oldest first.
        """
        found: defaultdict[float, dict[str, Any]] = defaultdict(dict)
        for quantity, name in self._families.items():
            if (reading := readings.get(name)) is not None:
                found[reading.time][quantity] = tuple(reading.value)
        for time, values in sorted(found.items()):
            yield JointState(Header(stamp(time)), self.names, **values)


def joint_families(site: Site) -> list[JointFamily]:
    """Find the joint variables of a site.

    Args:
        site: declares the state variables.

    Returns:
        One family for each index set with a variable in rad, or in jpos.
    """
    by_index: dict[tuple[str, ...], defaultdict[str, list[str]]] = {}
    for name, one in site.state.items():
        match one.variable.type:
            case FamilyType(index, RealType(dimension)) if dimension in _QUANTITIES:
                quantities = by_index.setdefault(index.members, defaultdict(list))
                quantities[_QUANTITIES[dimension]].append(name)
    known = site.motion.start_variable if site.motion else None
    found = []
    for members, quantities in by_index.items():
        fields = {
            quantity: known if known in names else names[0]
            for quantity, names in quantities.items()
            if known in names or len(names) == 1
        }
        if "position" in quantities:
            found.append(JointFamily(members, fields))
    return found


def position_variables(site: Site) -> list[str]:
    """Find the state variables that are positions in the world.

    Args:
        site: declares the state variables.

    Returns:
        Names of the vectors measured in m.
    """
    return [name for name, one in site.state.items() if one.variable.type == VectorType(LENGTH)]


def point_message(reading: Reading) -> PointStamped:
    """Make a message with a measured position.

    Args:
        reading: position in the world frame, m.

    Returns:
        The message.

    Raises:
        ValueError: the position has not three coordinates.
    """
    x, y, z = reading.value
    return PointStamped(Header(stamp(reading.time), WORLD), Point(x, y, z))


ScalarMessage = BoolStamped | Float64Stamped | StringStamped


def scalar_variables(site: Site) -> dict[str, type[ScalarMessage]]:
    """Find the state variables that have a single value, predicates included.

    Args:
        site: declares the state variables.

    Returns:
        Message type by variable name.
    """
    found: dict[str, type[ScalarMessage]] = {}
    for name, one in site.state.items():
        match one.variable.type:
            case BoolType():
                found[name] = BoolStamped
            case RealType():
                found[name] = Float64Stamped
            case EnumType():
                found[name] = StringStamped
    return found


def scalar_message(reading: Reading, kind: type[ScalarMessage]) -> ScalarMessage:
    """Make a message with a measured scalar.

    Args:
        reading: value, SI.
        kind: message type of the variable.

    Returns:
        The message.
    """
    header = Header(stamp(reading.time))
    return (
        Float64Stamped(header, float(reading.value))
        if kind is Float64Stamped
        else kind(header, reading.value)
    )


def motion_joints(site: Site) -> tuple[str, tuple[str, ...]] | None:
    """Find the joints of the site's motion policy.

    Args:
        site: may have a motion policy.

    Returns:
        The variable of their positions, and their names; None without policy or joints.
    """
    if site.motion is None:
        return None
    type_ = site.state[site.motion.start_variable].variable.type
    return (site.motion.start_variable, type_.index.members) if isinstance(type_, FamilyType) else None
