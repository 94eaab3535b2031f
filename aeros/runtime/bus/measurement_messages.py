"""What is measured, as messages: `sensor_msgs/JointState`, `geometry_msgs/PointStamped`, and stamped values.

Which families speak of joints is told by dimension: those over an index set of which one is in rad.  In
rad it is the position, in rad/s the velocity, in N·m the effort.  Where several are, none is told, unless
the site's motion policy names one as the joints' position.
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
from aeros.spec.expr.units import ANGLE, LENGTH, TIME, Dimension
from aeros.spec.model.model import Site

WORLD: Final = "world"
"""The frame of every vector of the vocabulary."""

_QUANTITIES: Final = {
    ANGLE: "position",
    ANGLE * TIME**-1: "velocity",
    Dimension((2, 1, -2, 0)): "effort",  # N·m
}


class JointFamily:
    """The families over one index set: `names` are the joints', `families` by what they measure."""

    def __init__(self, names: tuple[str, ...], families: dict[str, str]) -> None:
        self.names = names
        self._families = families

    def joint_state_messages(self, readings: Readings) -> Iterator[JointState]:
        """A message for each time at which something of it was measured, from the oldest on."""
        found: defaultdict[float, dict[str, Any]] = defaultdict(dict)
        for quantity, name in self._families.items():
            if (reading := readings.get(name)) is not None:
                found[reading.time][quantity] = tuple(reading.value)
        for time, values in sorted(found.items()):
            yield JointState(Header(stamp(time)), self.names, **values)


def joint_families(site: Site) -> list[JointFamily]:
    """Everything of the vocabulary that measures joints."""
    by_index: dict[tuple[str, ...], defaultdict[str, list[str]]] = {}
    for name, one in site.state.items():
        match one.variable.type:
            case FamilyType(index, RealType(dimension)) if dimension in _QUANTITIES:
                quantities = by_index.setdefault(index.members, defaultdict(list))
                quantities[_QUANTITIES[dimension]].append(name)
    known = site.motion.start_variable if site.motion else None
    found = []
    for members, quantities in by_index.items():
        told = {
            quantity: known if known in names else names[0]
            for quantity, names in quantities.items()
            if known in names or len(names) == 1
        }
        if "position" in quantities:
            found.append(JointFamily(members, told))
    return found


def position_variables(site: Site) -> list[str]:
    """The names of the vocabulary that are places in the world."""
    return [name for name, one in site.state.items() if one.variable.type == VectorType(LENGTH)]


def point_message(reading: Reading) -> PointStamped:
    """Where something was measured to be."""
    return PointStamped(Header(stamp(reading.time), WORLD), Point(*reading.value))


ScalarMessage = BoolStamped | Float64Stamped | StringStamped


def scalar_variables(site: Site) -> dict[str, type[ScalarMessage]]:
    """The names of the vocabulary that are one value each, predicates among them, and what tells each."""
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
    """What was measured, as `kind`."""
    header = Header(stamp(reading.time))
    return (
        Float64Stamped(header, float(reading.value))
        if kind is Float64Stamped
        else kind(header, reading.value)
    )


def motion_joints(site: Site) -> tuple[str, tuple[str, ...]] | None:
    """What measures the joints that the site's whole motions are about, and their names."""
    if site.motion is None:
        return None
    type_ = site.state[site.motion.start_variable].variable.type
    return (site.motion.start_variable, type_.index.members) if isinstance(type_, FamilyType) else None
