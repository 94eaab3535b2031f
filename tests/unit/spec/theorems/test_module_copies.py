from __future__ import annotations

import pytest

from aeros.runtime.gate import finite_layers
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.module_copies import ModuleSource, Mutant, install_stubs

_LAYERS = "aeros.runtime.gate.finite_layers"


def test_a_copy_is_the_shipped_code_and_apart_from_it() -> None:
    code = ModuleSource()
    copy = code.module(_LAYERS, type=lambda _: int)
    assert copy.finite_objections.__code__.co_code == finite_layers.finite_objections.__code__.co_code
    assert (copy._is_count(True), finite_layers._is_count(True)) == (True, False)
    assert code.loaded == {_LAYERS}


def test_a_copy_imports_the_copies_it_is_given() -> None:
    code = ModuleSource()
    form = code.module("aeros.runtime.gate.value_check")
    assert (
        code.module("aeros.runtime.gate.request_check", using=(form,)).check_freshness is form.check_freshness
    )
    assert code.module("aeros.runtime.gate.request_check").check_freshness is not form.check_freshness


def test_a_result_in_the_side_file_has_to_be_there() -> None:
    with pytest.raises(InternalError, match="no `_is_number` any more"):
        ModuleSource().module(_LAYERS, _is_number=None)
    with pytest.raises(InternalError, match="no `gone` any more"):
        install_stubs(ModuleSource().module(_LAYERS), {"gone": None})


def test_a_mutant_is_broken_where_it_says_and_nowhere_else() -> None:
    mutant = Mutant("counts-anything", "counts", _LAYERS, "type(used) is int and used >= 0", "True")
    code = ModuleSource(mutant)
    assert code.module(_LAYERS)._is_count("many")
    assert code.module("aeros.runtime.gate.value_check").check_time("soon") is not None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("used >= 1", "True", "found 0 times"),
        ("if ecm is None", "if ecm", "found 2 times"),
        ("used >= 0", "(used >= 0)", "changes nothing"),
    ],
)
def test_a_mutant_that_does_not_apply_exactly_is_an_error(old: str, new: str, message: str) -> None:
    with pytest.raises(InternalError, match=message):
        ModuleSource(Mutant("wrong", "counts", _LAYERS, old, new)).module(_LAYERS)
