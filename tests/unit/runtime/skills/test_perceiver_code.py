"""Code of perceivers gets the names that it may use, and no others."""

from __future__ import annotations

import pytest

from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.perceiver_code import PerceiverFunction, PerceiverNames, execute_perceiver

NAMES = PerceiverNames({"math": {"pi", "fma"}, "numpy": {"abs", "linalg"}, "numpy.linalg": {"norm"}}, {"len"})


def executed(text: str) -> PerceiverFunction:
    return execute_perceiver(CodeFile("m", "eye.py", "/eye.py", text.encode()), "see", NAMES)


def values(body: str) -> object:
    return next(executed(f"def see(view):\n    {body}\n")(None))


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("import math; yield math.pi > 3", True),
        ("from math import pi; yield len([pi])", 1),
        ("import numpy as np; yield float(np.abs(-2))", None),
        ("import numpy as np; yield np.linalg.norm([3, 4]) == 5", True),
        ("from numpy.linalg import norm; yield norm([3, 4]) == 5", True),
        ("yield view", None),
    ],
)
def test_allowed_names_are_there(body: str, expected: object) -> None:
    if "float(" in body:
        with pytest.raises(NameError, match="'float' is not defined"):
            values(body)
    else:
        assert values(body) == expected


@pytest.mark.parametrize(
    ("body", "error", "why"),
    [
        ("import math; yield math.tau", AttributeError, "'tau'"),
        ("from math import tau; yield tau", ImportError, "cannot import name 'tau'"),
        ("import os; yield", ImportError, "a perceiver may not import `os`"),
        ("import numpy.linalg; yield", ImportError, "import the members of `numpy.linalg` by their names"),
        ("import numpy.lib; yield", ImportError, "a perceiver may not import `numpy.lib`"),
        ("from numpy import lib; yield", ImportError, "cannot import name 'lib'"),
        ("from . import skills; yield", ImportError, r"module `m` has no file for `\.`"),
        ("yield open('/etc/passwd')", NameError, "'open' is not defined"),
    ],
)
def test_other_names_are_not(body: str, error: type[Exception], why: str) -> None:
    with pytest.raises(error, match=why):
        values(body)


def test_a_class_can_be_declared() -> None:
    assert values("class A: size = 2\n    yield A.size") == 2


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "has no generator function `see`"),
        ("see = 3", "has no generator function `see`"),
        ("def see(view): return 1", "has no generator function `see`"),
        ("import os", "ImportError: a perceiver may not import `os`"),
        ("1 / 0", "ZeroDivisionError"),
    ],
)
def test_a_file_without_the_perceiver_is_refused(text: str, why: str) -> None:
    with pytest.raises(SkillRefusedError, match=why):
        executed(text)
