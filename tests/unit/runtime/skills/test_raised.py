"""An exception of skill code is described by its line and by the name that was probably meant."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.raised import describe_raised

_PATH = "/modules/tidy/skills.py"
_CODE = """
def helper(values, key):
    return values[key]


def tidy(observed, inputs):
    yield helper(observed, inputs)


def odd(observed, inputs):
    class Missing(KeyError):
        pass
    yield
    raise Missing("clutter")
"""


def described(name: str, observed: Any, inputs: Any) -> str:
    function = CodeFile("tidy", "skills.py", _PATH, _CODE.encode()).generator_function(name)
    with pytest.raises(BaseException) as raised:  # noqa: PT011  any that the code raises
        list(function(observed, inputs))
    return describe_raised(raised.value, function, ("clutter_position", "holding"))


def test_memory_that_ran_out_is_named_in_words() -> None:
    class Full(dict[str, int]):
        def __missing__(self, _: str) -> int:
            raise MemoryError

    assert described("tidy", Full(), "x") == "skills.py:3: MemoryError: its process may use no more memory"


def test_a_key_that_is_misspelt_is_named_with_its_line_and_the_nearest_name() -> None:
    assert described("tidy", {}, "cluter_position") == (
        "skills.py:3: KeyError: 'cluter_position'; did you mean `clutter_position`?"
    )


@pytest.mark.parametrize("key", ["zzz", 3, ("clutter_position",)])
def test_a_key_that_resembles_no_name_gets_no_advice(key: object) -> None:
    assert described("tidy", {}, key) == f"skills.py:3: KeyError: {key!r}"


def test_the_line_is_of_the_code_also_where_a_library_raises() -> None:
    assert described("tidy", "abc", "b").startswith("skills.py:3: TypeError: ")


def test_an_exception_of_the_codes_own_is_not_asked_for_its_key() -> None:
    assert described("odd", {}, {}) == "skills.py:14: Missing: 'clutter'"


def test_the_line_may_be_in_a_file_that_the_code_imports() -> None:
    near = b"def reach(values):\n    return values['clutter']\n"
    code = b"from .near import reach\ndef tidy(observed, inputs):\n    yield reach(observed)\n"
    file = CodeFile("tidy", "skills.py", _PATH, code, (("near.py", near),))
    function = file.generator_function("tidy")
    with pytest.raises(KeyError) as raised:
        list(function({}, {}))
    assert describe_raised(raised.value, function, ()) == "near.py:2: KeyError: 'clutter'"


def test_an_exception_from_elsewhere_has_no_line() -> None:
    function = CodeFile("tidy", "skills.py", _PATH, _CODE.encode()).generator_function("tidy")
    assert describe_raised(ValueError("no"), function, ()) == "ValueError: no"
