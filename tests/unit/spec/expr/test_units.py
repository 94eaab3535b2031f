from __future__ import annotations

from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

from aeros.spec.expr.units import (
    ANGLE,
    BASES,
    CURRENT,
    DIMENSIONLESS,
    FORCE,
    LENGTH,
    NUMBER,
    POWER,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VOLTAGE,
    Dimension,
    exact_decimal,
    format_number,
    format_quantity,
    match_unit,
    parse_quantity,
    parse_unit,
    to_unit,
    unit_names,
    units_of,
)


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        ("mm/s", Fraction(1, 1000), LENGTH * TIME**-1),
        ("kg*m/s^2", Fraction(1), FORCE),
        ("m^-2", Fraction(1), LENGTH**-2),
        ("mm^2", Fraction(1, 10**6), LENGTH**2),
        ("1/s", Fraction(1), TIME**-1),
        ("m/s/s", Fraction(1), LENGTH * TIME**-2),
        ("km/h", Fraction(5, 18), LENGTH * TIME**-1),
        ("%", Fraction(1, 100), NUMBER),
        ("1", Fraction(1), NUMBER),
        ("min", Fraction(60), TIME),
        ("L/min", Fraction(1, 60000), LENGTH**3 * TIME**-1),
        ("bar", Fraction(10**5), PRESSURE),
        ("K/s", Fraction(1), TEMPERATURE * TIME**-1),
        ("V*A", Fraction(1), POWER),
        ("mV/mA", Fraction(1), VOLTAGE * CURRENT**-1),
        ("N*m", Fraction(1), FORCE * LENGTH),
    ],
)
def test_a_unit_has_a_factor_and_a_dimension(text: str, factor: Fraction, dimension: Dimension) -> None:
    unit = parse_unit(text)
    assert unit is not None
    assert (unit.text, unit.factor, unit.dimension) == (text, factor, dimension)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " m",
        "m ",
        "m / s",
        "mm /s",
        "parsec",
        "m//s",
        "/s",
        "*m",
        "m*",
        "m^",
        "m^0",
        "m^23",
        "m s",
        "µm",
        "M",
        "°C/s",
        "m*°C",
        "1/°C",
        "°C^2",
        "degC*s",
        "°",
        "°F",
    ],
)
def test_text_that_is_no_unit_gives_none(text: str) -> None:
    assert parse_unit(text) is None


def test_every_unit_has_the_factor_and_the_dimension_of_the_table() -> None:
    lines = (Path(__file__).parent / "data" / "units.txt").read_text("utf-8").splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    assert [name for name, *_ in rows] == list(unit_names())
    for name, factor, *exponents in rows:
        unit = parse_unit(name)
        assert unit is not None
        assert (unit.text, unit.factor) == (name, Fraction(factor))
        assert unit.dimension.exponents == tuple(map(int, exponents))
        assert unit.offset == (Fraction(27315, 100) if name in ("°C", "degC") else 0)


@pytest.mark.parametrize(
    ("exponents", "name"),
    [
        ((0, 0, 0, 0, 0, 0, 0), "1"),
        ((1, 1, -2, 0, 0, 0, 0), "N"),
        ((2, 1, -2, 0, 0, 0, 0), "N*m"),
        ((-1, 1, -2, 0, 0, 0, 0), "Pa"),
        ((2, 1, -3, 0, 0, 0, 0), "N*m/s"),
        ((2, 1, -3, 0, 0, -1, 0), "V"),
        ((0, 0, 0, 0, 1, 1, 1), "K*A*jpos"),
        ((-2, 0, -1, 0, 0, 0, 0), "1/m^2/s"),
    ],
)
def test_a_dimension_has_the_name_that_robots_give_it(exponents: tuple[int, ...], name: str) -> None:
    assert str(Dimension(exponents)) == name


def test_a_quantity_has_at_most_200_characters() -> None:
    assert parse_quantity(f"{'1' * 198} m") is not None
    assert parse_quantity(f"{'1' * 199} m") is None
    assert parse_quantity("1e999 m") is not None
    assert parse_quantity("1e1000 m") is None


def test_a_shown_dimension_parses_back() -> None:
    mechanical = product(range(-3, 4), repeat=4)
    electrical = product((-1, 0, 2), repeat=len(BASES))
    for exponents in (*((*one, 0, 0, 0) for one in mechanical), *electrical):
        dimension = Dimension(exponents)
        unit = parse_unit(str(dimension))
        assert unit is not None, str(dimension)
        assert (unit.factor, unit.dimension) == (Fraction(1), dimension)


def test_a_unit_ends_where_a_longer_word_begins() -> None:
    assert match_unit("m/s_max", 0) is not None
    found = match_unit("2 m/s_max", 2)
    assert found is not None
    assert (found[0].text, found[1]) == ("m", 3)
    assert match_unit("mm5", 0) is None
    for text in ("mm*load", "mm/load"):  # `load` is a name
        found = match_unit(text, 0)
        assert found is not None
        assert (found[0].text, found[1]) == ("mm", 2)


def test_units_of_a_dimension_are_listed_the_largest_first() -> None:
    assert units_of(ANGLE) == ("rad", "deg", "mrad")
    assert units_of(LENGTH) == ("km", "m", "cm", "mm", "um")
    assert units_of(LENGTH * TIME**-1) == ()


def test_a_turn_per_minute_is_a_part_of_pi() -> None:
    rpm, deg = parse_unit("rpm"), parse_unit("deg")
    assert rpm is not None
    assert deg is not None
    assert (rpm.factor, rpm.dimension) == (6 * deg.factor, ANGLE * TIME**-1)


@pytest.mark.parametrize("text", ["°C", "degC"])
def test_a_temperature_in_degrees_celsius_has_an_offset_from_kelvin(text: str) -> None:
    parsed = parse_quantity(f"-40 {text}")
    assert parsed is not None
    number, unit = parsed
    assert (unit.dimension, unit.to_si(number)) == (TEMPERATURE, Fraction("233.15"))
    assert format_quantity(Fraction("293.15"), unit) == f"20 {text}"
    assert to_unit(Fraction("273.15"), unit) == 0


def test_a_degree_is_a_part_of_pi() -> None:
    unit = parse_unit("deg")
    assert unit is not None
    assert abs(180 * unit.factor - Fraction("3.14159265358979323846264338327950288")) == 0
    assert unit.dimension not in (NUMBER, LENGTH)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("250 mm/s", Fraction(250), "mm/s"),
        ("-0.5", Fraction(-1, 2), "1"),
        ("+1e-3s", Fraction(1, 1000), "s"),
        (".5   m", Fraction(1, 2), "m"),
        ("50 %", Fraction(50), "%"),
    ],
)
def test_a_quantity_is_a_number_and_a_unit(text: str, value: Fraction, unit: str) -> None:
    parsed = parse_quantity(text)
    assert parsed is not None
    assert (parsed[0], parsed[1].text) == (value, unit)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "mm",
        "1 parsec",
        "1 m m",
        "nan",
        "inf",
        "1e1000",
        "٣ m",
        "1_000",
        "0x10",
        "1/3",
        "9" * 5000,
        "1,5",
        "2\tm",
        "2 Xm",
        "2m\n",
    ],
)
def test_text_that_is_no_quantity_gives_none(text: str) -> None:
    assert parse_quantity(text) is None


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (Fraction(3), "3"),
        (Fraction(1, 4), "0.25"),
        (Fraction(1, 3), "≈0.333333333"),
        (Fraction(10**12 - 1), "999999999999"),
        (Fraction(10**12), "1e+12"),
        (Fraction(-(10**12)), "-1e+12"),
        (Fraction(10) ** 20, "1e+20"),
        (Fraction(10) ** 400, "≈10^400"),
        (-(Fraction(10) ** 400), "≈-10^400"),
        (Fraction(1, 10**400), "≈0"),
    ],
)
def test_a_number_is_shown_short_and_marked_where_it_is_rounded(value: Fraction, shown: str) -> None:
    assert format_number(value) == shown


def test_a_quantity_is_shown_in_its_unit() -> None:
    unit = parse_unit("mm")
    assert unit is not None
    assert format_quantity(Fraction(1, 4), unit) == "250 mm"
    assert format_quantity(Fraction(1, 4), DIMENSIONLESS) == "0.25"


def test_a_dimension_has_an_exponent_for_each_base() -> None:
    short = Dimension((1, 0))
    for one, other in ((short, LENGTH), (LENGTH, short)):
        with pytest.raises(ValueError, match="argument 2 is"):
            one * other
    with pytest.raises(ValueError, match="argument 2 is"):
        str(short)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (Fraction(0), "0"),
        (Fraction(10), "10"),
        (Fraction(-10), "-10"),
        (Fraction(1, 4), "0.25"),
        (Fraction(-1, 4), "-0.25"),
        (Fraction(1001, 10), "100.1"),
        (Fraction(1, 10**12), "0.000000000001"),
        (Fraction(1, 10**13), None),
        (Fraction(1, 3), None),
        (Fraction(10) ** 30, "1" + "0" * 30),
    ],
)
def test_a_decimal_is_exact_or_none(value: Fraction, shown: str | None) -> None:
    assert exact_decimal(value) == shown
