"""Names: what they mean, and what is suggested for an unknown one."""

from __future__ import annotations

import pytest

from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.syntax import Name, TextRange
from aeros.spec.expr.typecheck.name_resolution import declared_type, resolve_name, resolve_volume, value_type
from aeros.spec.expr.types import IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from tests.unit.spec.expr.scope import GRIP, SCOPE, SPEED


def name(text: str) -> Name:
    return Name(text, TextRange(0, len(text)))


def test_an_integer_is_read_as_a_real() -> None:
    assert SCOPE.variables["laps"].type == IntegerType()
    assert resolve_name(name("laps"), SCOPE, {}, None) == (SCOPE.variables["laps"], RealType(NUMBER))
    assert value_type(SPEED) == SPEED


@pytest.mark.parametrize(
    ("texts", "type_"),
    [(["stop", "grip"], GRIP), (["inputs.pace", "grip"], SPEED), (["stop", "1 + 1"], None), ([], None)],
)
def test_the_first_declared_name_gives_the_type(texts: list[str], type_: object) -> None:
    assert declared_type(map(parse, texts), SCOPE, {}) == type_


def test_a_volume_is_found_by_its_name() -> None:
    assert resolve_volume(name("cell"), SCOPE) == SCOPE.volumes["cell"]
    with pytest.raises(ExpressionTypeError) as raised:
        resolve_volume(name("cel"), SCOPE)
    assert raised.value.cure == "did you mean `cell`?"
