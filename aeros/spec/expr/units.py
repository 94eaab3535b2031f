"""Units and dimensions: every quantity is held exactly, in SI, with its dimension.

Angle is a dimension of its own, so degrees and radians differ from bare numbers. The degree is irrational in
radians; by definition, π is the 36-digit decimal below.

Source of factors: BIPM, The International System of Units, 9th edition, tables 4 and 8.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

BASES = ("m", "kg", "s", "rad")
_PI = Fraction("3.14159265358979323846264338327950288")


@dataclass(frozen=True, slots=True)
class Dimension:
    """Dimension as a product of powers of base dimensions.

    Attributes:
        exponents: exponents of `BASES`, in order; all 0 for a dimensionless number.
    """

    exponents: tuple[int, int, int, int] = (0, 0, 0, 0)

    def __mul__(self, other: Dimension) -> Dimension:
        """The dimension of a product."""
        m, kg, s, rad = (a + b for a, b in zip(self.exponents, other.exponents, strict=True))
        return Dimension((m, kg, s, rad))

    def __pow__(self, power: int) -> Dimension:
        """The dimension of an integer power."""
        m, kg, s, rad = (a * power for a in self.exponents)
        return Dimension((m, kg, s, rad))

    def __str__(self) -> str:
        """The dimension in SI units: `m/s`, `kg*m/s^2` is shown as `N`; `1` for a bare number."""
        named = _NAMES.get(self)
        if named is not None:
            return named
        over = [_power(b, e) for b, e in zip(BASES, self.exponents, strict=True) if e > 0]
        under = [_power(b, -e) for b, e in zip(BASES, self.exponents, strict=True) if e < 0]
        return "/".join(["*".join(over) or "1", *under])


def _power(base: str, exponent: int) -> str:
    return base if exponent == 1 else f"{base}^{exponent}"


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a number.

    Attributes:
        text: the unit as written.
        factor: value of 1 unit in SI.
        dimension: its dimension.
    """

    text: str
    factor: Fraction
    dimension: Dimension


NUMBER = Dimension()
LENGTH = Dimension((1, 0, 0, 0))
TIME = Dimension((0, 0, 1, 0))
MASS = Dimension((0, 1, 0, 0))
ANGLE = Dimension((0, 0, 0, 1))
FORCE = MASS * LENGTH * TIME**-2
_NAMES = {
    NUMBER: "1",
    FORCE: "N",
    FORCE * LENGTH: "N*m",
    FORCE * LENGTH**-2: "Pa",
    FORCE * LENGTH * TIME**-1: "N*m/s",
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
    "h": (Fraction(3600), TIME),
    "Hz": (Fraction(1), TIME**-1),
    "kg": (Fraction(1), MASS),
    "g": (Fraction(1, 1000), MASS),
    "N": (Fraction(1), FORCE),
    "kN": (Fraction(1000), FORCE),
    "mN": (Fraction(1, 1000), FORCE),
    "Nm": (Fraction(1), FORCE * LENGTH),
    "Pa": (Fraction(1), FORCE * LENGTH**-2),
    "kPa": (Fraction(1000), FORCE * LENGTH**-2),
    "J": (Fraction(1), FORCE * LENGTH),
    "W": (Fraction(1), FORCE * LENGTH * TIME**-1),
    "rad": (Fraction(1), ANGLE),
    "mrad": (Fraction(1, 1000), ANGLE),
    "deg": (_PI / 180, ANGLE),
}

_FACTOR = re.compile(r"([*/]?)(1|%|[A-Za-z]+)(?:\^(-?[1-9]))?(?![A-Za-z0-9_])")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_MAX_LENGTH = 200  # characters of a written quantity; Python converts no longer numeral than 4300
DIMENSIONLESS = Unit("1", Fraction(1), NUMBER)


def unit_names() -> tuple[str, ...]:
    """List every unit that can be written on its own.

    Returns:
        Symbols, as `mm`, `kg` and `deg`.
    """
    return tuple(_ATOMS)


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
        The number in the unit as written, and the unit (multiply by its factor for SI); None if the text is
        no quantity.
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
    return value if unit.factor == 1 else value / unit.factor  # fractions are slow, and most units are SI


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
