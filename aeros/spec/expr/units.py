"""Units and dimensions: every quantity is held exactly, in SI, with its dimension.

Angle is a dimension of its own, so degrees and radians differ from bare numbers. The degree is irrational in
radians; by definition, π is the 36-digit decimal below.

The position of a joint is one, too, for arms whose joints do not all have the same: `jpos` stands for rad of
a revolute joint and for m of a prismatic joint. A variable for all joints then has one dimension, which
compares with neither an angle nor a length.

Source of factors: BIPM, The International System of Units, 9th edition, tables 4 and 8; the bar, section 5.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

BASES = ("m", "kg", "s", "rad", "K", "A", "jpos")
_PI = Fraction("3.14159265358979323846264338327950288")


@dataclass(frozen=True, slots=True)
class Dimension:
    """Dimension as a product of powers of base dimensions.

    Attributes:
        exponents: exponents of `BASES`, in order; all 0 for a dimensionless number.
    """

    exponents: tuple[int, ...] = (0,) * len(BASES)

    def __mul__(self, other: Dimension) -> Dimension:
        """The dimension of a product."""
        return Dimension(tuple([a + b for a, b in zip(self.exponents, other.exponents, strict=True)]))

    def __pow__(self, power: int) -> Dimension:
        """The dimension of an integer power."""
        return Dimension(tuple([one * power for one in self.exponents]))

    def __str__(self) -> str:
        """The dimension in SI units: `m/s`, `kg*m/s^2` is shown as `N`; `1` for a bare number."""
        named = _NAMES.get(self)
        if named is not None:
            return named
        powers = list(zip(BASES, self.exponents, strict=True))
        over = [_power(base, exponent) for base, exponent in powers if exponent > 0]
        under = [_power(base, -exponent) for base, exponent in powers if exponent < 0]
        return "/".join(["*".join(over) or "1", *under])


def _power(base: str, exponent: int) -> str:
    return base if exponent == 1 else f"{base}^{exponent}"


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a number.

    Attributes:
        text: the unit as written.
        factor: length of 1 unit in SI.
        dimension: its dimension.
        offset: value of 0 units in SI; other than 0 for `°C` alone, which no difference can have.
    """

    text: str
    factor: Fraction
    dimension: Dimension
    offset: Fraction = Fraction(0)

    def to_si(self, number: Fraction) -> Fraction:
        """Convert a number of this unit to SI.

        Args:
            number: the number of units.

        Returns:
            The value in SI.
        """
        return number * self.factor + self.offset


NUMBER = Dimension()
LENGTH, MASS, TIME, ANGLE, TEMPERATURE, CURRENT, JOINT = (
    Dimension(tuple([int(one == base) for one in BASES])) for base in BASES
)
FORCE = MASS * LENGTH * TIME**-2
PRESSURE = FORCE * LENGTH**-2
POWER = FORCE * LENGTH * TIME**-1
VOLTAGE = POWER * CURRENT**-1
_NAMES = {
    NUMBER: "1",
    FORCE: "N",
    FORCE * LENGTH: "N*m",
    PRESSURE: "Pa",
    POWER: "N*m/s",
    VOLTAGE: "V",
}
"""Names of dimensions. Torque has that of energy, and its rate that of power: robots have the torques."""

_ATOMS: dict[str, tuple[Fraction, Dimension]] = {
    "1": (Fraction(1), NUMBER),
    "%": (Fraction(1, 100), NUMBER),
    "m": (Fraction(1), LENGTH),
    "km": (Fraction(1000), LENGTH),
    "cm": (Fraction(1, 100), LENGTH),
    "mm": (Fraction(1, 1000), LENGTH),
    "um": (Fraction(1, 10**6), LENGTH),
    "s": (Fraction(1), TIME),
    "ms": (Fraction(1, 1000), TIME),
    "us": (Fraction(1, 10**6), TIME),
    "min": (Fraction(60), TIME),
    "h": (Fraction(3600), TIME),
    "Hz": (Fraction(1), TIME**-1),
    "kHz": (Fraction(1000), TIME**-1),
    "MHz": (Fraction(10**6), TIME**-1),
    "kg": (Fraction(1), MASS),
    "g": (Fraction(1, 1000), MASS),
    "N": (Fraction(1), FORCE),
    "kN": (Fraction(1000), FORCE),
    "mN": (Fraction(1, 1000), FORCE),
    "Nm": (Fraction(1), FORCE * LENGTH),
    "Pa": (Fraction(1), PRESSURE),
    "hPa": (Fraction(100), PRESSURE),
    "kPa": (Fraction(1000), PRESSURE),
    "MPa": (Fraction(10**6), PRESSURE),
    "mbar": (Fraction(100), PRESSURE),
    "bar": (Fraction(10**5), PRESSURE),
    "J": (Fraction(1), FORCE * LENGTH),
    "kJ": (Fraction(1000), FORCE * LENGTH),
    "W": (Fraction(1), POWER),
    "kW": (Fraction(1000), POWER),
    "L": (Fraction(1, 1000), LENGTH**3),
    "mL": (Fraction(1, 10**6), LENGTH**3),
    "K": (Fraction(1), TEMPERATURE),
    "A": (Fraction(1), CURRENT),
    "mA": (Fraction(1, 1000), CURRENT),
    "V": (Fraction(1), VOLTAGE),
    "mV": (Fraction(1, 1000), VOLTAGE),
    "rad": (Fraction(1), ANGLE),
    "mrad": (Fraction(1, 1000), ANGLE),
    "deg": (_PI / 180, ANGLE),
    "rpm": (2 * _PI / 60, ANGLE * TIME**-1),
    "jpos": (Fraction(1), JOINT),
}
_WITH_OFFSET: dict[str, Unit] = {
    name: Unit(name, Fraction(1), TEMPERATURE, offset=Fraction("273.15")) for name in ("°C", "degC")
}
"""Units whose zero is not that of SI. They stand alone: a product or a difference of them has no meaning."""

_FACTOR = re.compile(r"([*/]?)(1|%|°C|[A-Za-z]+)(?:\^(-?[1-9]))?(?![A-Za-z0-9_])")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_MAX_LENGTH = 200  # characters of a written quantity; Python converts no longer numeral than 4300
DIMENSIONLESS = Unit("1", Fraction(1), NUMBER)


def unit_names() -> tuple[str, ...]:
    """List every unit that can be written on its own.

    Returns:
        Symbols, as `mm`, `kg` and `deg`.
    """
    return (*_ATOMS, *_WITH_OFFSET)


def units_of(dimension: Dimension) -> tuple[str, ...]:
    """List the units of a dimension that can be written on their own.

    Args:
        dimension: the dimension.

    Returns:
        Symbols, the largest unit first; none for a dimension that needs a product, as `m/s`.
    """
    factors = {name: factor for name, (factor, one) in _ATOMS.items() if one == dimension}
    return tuple(sorted(factors, key=lambda name: -factors[name]))


def match_unit(text: str, start: int) -> tuple[Unit, int] | None:
    """Match the longest unit at a position of a text.

    unit := atom ['^' int] (('*' | '/') atom ['^' int])*   without spaces, as in `mm/s` or `kg*m/s^2`

    Args:
        text: text that holds the unit.
        start: offset of its first character.

    Returns:
        The unit and the offset of its end; None if no unit starts there.
    """
    factor, dimension, end = Fraction(1), NUMBER, start
    alone = _FACTOR.match(text, start)
    if alone is not None and alone.group() in _WITH_OFFSET:
        return _WITH_OFFSET[alone.group()], alone.end()
    while (match := _FACTOR.match(text, end)) is not None:
        sign, name, power = match.groups()
        if name not in _ATOMS or bool(sign) != (end > start):
            break
        exponent = int(power or 1) * (-1 if sign == "/" else 1)
        atom_factor, atom_dimension = _ATOMS[name]
        factor *= atom_factor**exponent
        dimension *= atom_dimension**exponent
        end = match.end()
    if end == start:
        return None
    return Unit(text[start:end], factor, dimension), end


def parse_unit(text: str) -> Unit | None:
    """Parse a text that is a unit.

    Args:
        text: a unit and nothing else, as `mm/s`.

    Returns:
        The unit; None if the text is none.
    """
    matched = match_unit(text, 0)
    return matched[0] if matched is not None and matched[1] == len(text) else None


def parse_quantity(text: str) -> tuple[Fraction, Unit] | None:
    """Parse a number with its unit.

    Args:
        text: as `250 mm/s` or `-0.5`, at most 200 characters.

    Returns:
        The number in the unit as written, and the unit, which converts it to SI; None if the text is no
        quantity.
    """
    number = _NUMBER.match(text) if len(text) <= _MAX_LENGTH else None
    if number is None:
        return None
    rest = text[number.end() :].strip(" ")
    unit = parse_unit(rest) if rest else DIMENSIONLESS
    return None if unit is None else (Fraction(number.group()), unit)


def to_unit(value: Fraction, unit: Unit) -> Fraction:
    """Convert a value from SI to a unit.

    Args:
        value: value in SI.
        unit: target unit, of the dimension of `value`.

    Returns:
        The number of units.
    """
    return (value - unit.offset) / unit.factor


def cure_of_bare_number(number: str, dimension: Dimension) -> str:
    """Say how to write a number that lacks its unit.

    Args:
        number: the number as it was written.
        dimension: dimension that it must have.

    Returns:
        Text for the help of an error.
    """
    return f"write the number with its unit, as in `{number} {dimension}`{other_units(dimension)}"


def other_units(dimension: Dimension) -> str:
    """List the units of a dimension beside that of SI, for the help of an error.

    Args:
        dimension: the dimension.

    Returns:
        A clause; empty if there are none.
    """
    others = [name for name in units_of(dimension) if name != str(dimension)]
    return f"; other units are {', '.join(f'`{name}`' for name in others)}" if others else ""


def format_quantity(value: Fraction, unit: Unit) -> str:
    """Format a value as a person would write it.

    Args:
        value: value in SI.
        unit: unit to show it in.

    Returns:
        Number and unit, with `≈` in front if digits were dropped.
    """
    number = format_number(to_unit(value, unit))
    return number if unit.text == "1" else f"{number} {unit.text}"


@lru_cache(4096)  # witnesses repeat a few values
def format_number(value: Fraction) -> str:
    """Format a rational as a decimal.

    Args:
        value: any rational.

    Returns:
        The exact decimal if it is short, else one rounded to nine digits, marked with `≈`.
    """
    if value.denominator == 1 and abs(value) < 10**12:
        return str(value.numerator)
    try:
        shown = f"{float(value):.9g}"
    except OverflowError:
        return f"≈{'-' if value < 0 else ''}10^{math.log10(abs(value.numerator) // value.denominator):.0f}"
    return shown if Fraction(shown) == value else f"≈{shown}"


def exact_decimal(value: Fraction) -> str | None:
    """Format a rational as an exact decimal.

    Args:
        value: any rational.

    Returns:
        The decimal, without trailing zeros; None if it needs more than twelve decimals.
    """
    scaled = value * 10**12
    if scaled.denominator != 1:
        return None
    digits = f"{abs(scaled.numerator):013d}"
    shown = f"{digits[:-12]}.{digits[-12:]}".rstrip("0").rstrip(".")
    return f"-{shown}" if value < 0 else shown
