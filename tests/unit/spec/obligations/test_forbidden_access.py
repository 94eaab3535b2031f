"""Code that reaches outside a skill is found at its first place."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

import ast

import pytest

from aeros.spec.obligations.forbidden_access import ALLOWED_MODULES, FORBIDDEN, first_forbidden_access


def found(code: str) -> tuple[str, str] | None:
    access = first_forbidden_access(tuple(ast.walk(ast.parse(code))))
    if access is None:
        return None
    node, description = access
    return ast.unparse(node), description


@pytest.mark.parametrize(
    "code",
    [
        "",
        "from aeros.skill import act, Action, Inputs, Observation, SkillBody",
        "from __future__ import annotations",
        "import math\nx = math.sin(math.pi)",
        "import math as m\nx = m.sqrt(2)",
        "from collections.abc import Generator as G\nfrom dataclasses import dataclass, replace",
        "from math import sqrt\nx = [sqrt]",
        "x = sorted(range(3), key=len)\ny = x.append\nz = x.f",
        "def f(a):\n    yield a.value",
        "math = 1\nx = [math]",
    ],
)
def test_code_that_only_computes_is_accepted(code: str) -> None:
    assert found(code) is None


@pytest.mark.parametrize("module", sorted(ALLOWED_MODULES - {"__future__"}))
def test_no_allowed_module_hands_out_another(module: str) -> None:
    assert found(f"from {module} import sys") is not None
    assert found(f"from {module} import *") is not None
    assert found(f"from {module} import _private") is not None


@pytest.mark.parametrize("name", sorted(FORBIDDEN))
def test_a_builtin_that_reaches_outside_is_refused(name: str) -> None:
    assert found(f"x = [{name}]") == (name, f"uses `{name}`")


@pytest.mark.parametrize(
    ("code", "at", "what"),
    [
        ("import os", "import os", "imports `os`"),
        ("import math, os, sys", "import math, os, sys", "imports `os`"),
        ("import collections.abc", "import collections.abc", "imports `collections.abc`"),
        ("from . import x", "from . import x", "imports `.`"),
        ("from ..math import sqrt", "from ..math import sqrt", "imports `..math`"),
        ("from collections import OrderedDict", "from collections import OrderedDict", "imports `collections`"),
        ("from aeros.skill import run", "from aeros.skill import run", "imports `run` from `aeros.skill`"),
        ("from math import pi, nothing", "from math import pi, nothing", "imports `nothing` from `math`"),
        ("from typing import get_type_hints", "from typing import get_type_hints",
         "imports `get_type_hints` from `typing`"),
        ("import math\nf(math)", "math", "passes the module `math` around"),
        ("import math as m\nx = m", "m", "passes the module `m` around"),
        ("import typing\nx = typing.get_type_hints", "typing.get_type_hints", "uses `get_type_hints` of `typing`"),
        ("import math\nx = math._x", "math._x", "uses `_x` of `math`"),
        ("x = ().__class__", "().__class__", "reaches into `__class__`"),
        ("x.gi_frame", "x.gi_frame", "reaches into `gi_frame`"),
        ("x.tb_next", "x.tb_next", "reaches into `tb_next`"),
        ("async def f():\n    pass", "async def f():\n    pass", "keeps or awaits something between actions"),
        ("def f():\n    global x", "global x", "keeps or awaits something between actions"),
        ("def f():\n    def g():\n        nonlocal x\n    x = 1", "nonlocal x",
         "keeps or awaits something between actions"),
    ],
)  # fmt: skip
def test_a_place_that_reaches_outside_is_found_and_described(code: str, at: str, what: str) -> None:
    assert found(code) == (at, what)


def test_the_first_of_several_places_is_reported() -> None:
    assert found("import math\nx = open\nimport os") == ("import os", "imports `os`")  # statements come first
    assert found("x = open\ny = eval") == ("open", "uses `open`")
