from __future__ import annotations

import pytest

from aeros.runtime.gate import finite_layers
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.module_copies import Code, Mutant, put_in_place

_LAYERS = "aeros.runtime.gate.finite_layers"


def test_a_copy_is_the_shipped_code_and_apart_from_it() -> None:
    code = Code()
    copy = code.module(_LAYERS, type=lambda _: int)
    assert copy.finite_objections.__code__.co_code == finite_layers.finite_objections.__code__.co_code
    assert (copy._is_count(True), finite_layers._is_count(True)) == (True, False)
    assert code.loaded == {_LAYERS}


def test_a_copy_imports_the_copies_it_is_given() -> None:
    code = Code()
    form = code.module("aeros.runtime.gate.value_check")
    assert code.module("aeros.runtime.gate.request_check", using=(form,)).check_age is form.check_age
    assert code.module("aeros.runtime.gate.request_check").check_age is not form.check_age


def test_what_is_put_aside_has_to_be_there() -> None:
    with pytest.raises(InternalError, match="no `_is_number` any more"):
        Code().module(_LAYERS, _is_number=None)
    with pytest.raises(InternalError, match="no `gone` any more"):
        put_in_place(Code().module(_LAYERS), {"gone": None})


def test_a_mutant_is_broken_where_it_says_and_nowhere_else() -> None:
    mutant = Mutant("counts-anything", "counts", _LAYERS, "type(used) is int and used >= 0", "True")
    code = Code(mutant)
    assert code.module(_LAYERS)._is_count("many")
    assert code.module("aeros.runtime.gate.value_check").check_now("soon") is not None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("used >= 1", "True", "found 0 times"),
        ("if ecm is None", "if ecm", "found 2 times"),
        ("used >= 0", "(used >= 0)", "changes nothing"),
    ],
)
def test_a_mutant_that_does_not_apply_exactly_is_an_error(old: str, new: str, said: str) -> None:
    with pytest.raises(InternalError, match=said):
        Code(Mutant("wrong", "counts", _LAYERS, old, new)).module(_LAYERS)
