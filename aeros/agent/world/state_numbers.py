"""The measured state as a row of numbers, with a flag for each that is known.

Vectors and families have a number for each part, enums one for each member, 1 for the value.  An unknown
value has the flag 0, and the number 0 or, if 0 is outside its range, the bound nearest to 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model.variables import Declared


class NumberSlot(NamedTuple):
    """One number of a row.

    Attributes:
        name: `VARIABLE`, `VARIABLE.x`, `VARIABLE[MEMBER]`, or `VARIABLE=MEMBER` of an enum.
        variable: name of the variable.
        part: place in its value, of a vector or a family; None for a scalar.
        member: member that the number is 1 for; None unless the variable is of an enum.
        low: least number, SI.
        high: greatest number, SI.
    """

    name: str
    variable: str
    part: int | None
    member: str | None
    low: float
    high: float


class StateNumbers:
    """Encoder of values as rows of numbers.

    Args:
        declared: variables by name.

    Attributes:
        slots: the numbers of a row, in the order of the variables' names.
        names: their names.
    """

    def __init__(self, declared: Mapping[str, Declared]) -> None:
        self.slots = tuple(slot for name in sorted(declared) for slot in _slots(name, declared[name]))
        self.names = tuple(slot.name for slot in self.slots)
        self._unknown = tuple(min(max(0.0, slot.low), slot.high) for slot in self.slots)

    def encode(self, known: Mapping[str, Value]) -> tuple[list[float], list[int]]:
        """Encode the known values.

        Args:
            known: exact values (SI) by name, within their declared ranges.

        Returns:
            The numbers, and 1 for each that is known, else 0.
        """
        numbers, flags = list(self._unknown), [0] * len(self.slots)
        for place, slot in enumerate(self.slots):
            value: Any = known.get(slot.variable)
            if value is None:
                continue
            flags[place] = 1
            if slot.member is not None:
                numbers[place] = float(value == slot.member)
            else:
                # Rounding of a bound's exact value may leave the range by one unit in the last place.
                number = float(value if slot.part is None else value[slot.part])
                numbers[place] = min(max(number, slot.low), slot.high)
        return numbers, flags


def _slots(name: str, declared: Declared) -> Iterator[NumberSlot]:
    variable = declared.variable
    if isinstance(variable.type, EnumType):
        for member in variable.type.members:
            yield NumberSlot(f"{name}={member}", name, None, member, 0.0, 1.0)
        return
    parts = scalar_variables(variable)
    is_scalar = parts == (variable,)
    for place, part in enumerate(parts):
        low, high = _bounds(part, declared)
        suffix = part.name.removeprefix(variable.name)
        yield NumberSlot(f"{name}{suffix}", name, None if is_scalar else place, None, low, high)


def _bounds(part: t.Variable, declared: Declared) -> tuple[float, float]:
    return (0.0, 1.0) if isinstance(part.type, BoolType) else declared.double_range
