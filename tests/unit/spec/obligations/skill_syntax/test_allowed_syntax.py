"""Code that is not on the allow-list of skill code is found at its first place; more cases are in skill_code_cases.txt."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

import ast
import importlib
import subprocess
import sys

import pytest

from aeros.spec.obligations.skill_syntax.allowed_names import (
    ALLOWED_ATTRIBUTES,
    ALLOWED_BUILTINS,
    ALLOWED_MEMBERS,
    ALLOWED_MODULES,
    FORBIDDEN_ATTRIBUTES,
    INTROSPECTION_PREFIXES,
)
from aeros.spec.obligations.skill_syntax.allowed_syntax import REFUSED_NODES, first_refusal


def found(code: str) -> tuple[str, str, str] | None:
    refusal = first_refusal(ast.parse(code))
    return None if refusal is None else (ast.unparse(refusal.node), refusal.description, refusal.help)


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
        "x = sorted(range(3), key=len)\ny = [1].append",
        "def f(a):\n    yield a.value",
        "math = 1\nx = [math]",
        "import dataclasses\n@dataclasses.dataclass\nclass A:\n    x: int = dataclasses.field(default=1)",
        '"""A file."""\nclass A:\n    """A class."""\n\n    x: int = 1\ndef f():\n    """A function."""',
        "import functools\n@functools.cache\ndef f():\n    return 1\n@functools.lru_cache(maxsize=None)\ndef g():\n    return 1",
        "class A:\n    @staticmethod\n    def f():\n        return 1\n    @property\n    def g(self):\n        return 1",
        "import enum\nclass A(enum.Enum):\n    X = 1\nclass B(A):\n    pass",
    ],
)
def test_code_that_only_computes_is_accepted(code: str) -> None:
    assert found(code) is None


@pytest.mark.parametrize("module", sorted(ALLOWED_MODULES - {"__future__"}))
def test_no_allowed_module_hands_out_another(module: str) -> None:
    assert found(f"from {module} import sys") is not None
    assert found(f"from {module} import *") is not None
    assert found(f"from {module} import _private") is not None


@pytest.mark.parametrize("module", sorted(ALLOWED_MEMBERS))
def test_every_listed_member_is_one_of_some_version_of_python(module: str) -> None:
    newer = {"batched", "fma", "sumprod"}  # of Python 3.12 and 3.13
    members = importlib.import_module(module)
    assert [name for name in sorted(ALLOWED_MEMBERS[module] - newer) if not hasattr(members, name)] == []
    assert not [name for name in ALLOWED_MEMBERS[module] if name.startswith("_")]


def test_the_lists_do_not_contradict_each_other() -> None:
    assert not ALLOWED_ATTRIBUTES & FORBIDDEN_ATTRIBUTES
    assert not [name for name in ALLOWED_ATTRIBUTES if name.startswith(INTROSPECTION_PREFIXES)]
    assert not ALLOWED_BUILTINS & {
        "compile",
        "eval",
        "exec",
        "getattr",
        "globals",
        "open",
        "print",
        "setattr",
        "type",
        "vars",
    }


@pytest.mark.parametrize(
    "name",
    ["breakpoint", "compile", "delattr", "dir", "eval", "exec", "exit", "getattr", "globals", "help", "input", "locals",
     "memoryview", "open", "print", "quit", "setattr", "super", "type", "vars", "BaseException", "KeyboardInterrupt"],
)  # fmt: skip
def test_a_builtin_that_reaches_outside_is_refused_read_or_bound(name: str) -> None:
    read = found(f"x = [{name}]")
    assert read is not None
    assert read[:2] == (name, f"uses `{name}`")
    assert found(f"x = 1\ndef f():\n    return {name}\n{name} = 1") is not None
    assert found(f"def f({name}):\n    return 1") is not None


@pytest.mark.parametrize(
    ("code", "at", "what", "help_"),
    [
        ("import os", "import os", "imports `os`", "import only from"),
        ("import math, os, sys", "import math, os, sys", "imports `os`", "import only from"),
        ("import collections.abc", "import collections.abc", "imports `collections.abc`", "import only from"),
        ("from . import x", "from . import x", "imports `.`", "import names of a file"),
        ("from ..math import sqrt", "from ..math import sqrt", "imports `..math`", "import names of a file"),
        ("from collections import OrderedDict", "from collections import OrderedDict", "imports `collections`", "import only from"),
        ("from aeros.skill import run", "from aeros.skill import run", "imports `run` from `aeros.skill`", "import only from"),
        ("from math import pi, sqr", "from math import pi, sqr", "imports `sqr` from `math`", "did you mean `sqrt`?"),
        ("from typing import get_type_hints", "from typing import get_type_hints", "imports `get_type_hints` from `typing`", "import only"),
        ("import math\nx = [math]", "math", "passes the module `math` around", "name a member of it, as `math.NAME`"),
        ("import math as m\nx = m", "m", "passes the module `m` around", "name a member of it, as `m.NAME`"),
        ("import math\nx = math._x", "math._x", "uses `_x` of `math`", "import only from"),
        ("x = ().__class__", "().__class__", "reaches into `__class__`", "import only from"),
        ("x = 1 .gi_frame", "1 .gi_frame", "reaches into `gi_frame`", "read only what the code declares"),
        ("x = ''.format(1)", "''.format", "reaches into `format`", "write an f-string"),
        ("x = [].apend", "[].apend", "reads the attribute `apend`, which no plain value has", "did you mean `append`?"),
        ("async def f():\n    pass", "async def f():\n    pass", "awaits something between actions", "write a plain `def`"),
        ("def f():\n    global x", "global x", "keeps something between actions with `global`", "pass the value as an argument"),
        ("def f():\n    with 1:\n        pass", "with 1:\n    pass", "uses `with`", "call functions directly"),
        ("__all__ = []", "__all__", "binds `__all__`", "import only from"),
        ("x = __name__", "__name__", "uses `__name__`", "import only from"),
        ("x = lenn", "lenn", "uses `lenn`, which it does not define", "did you mean `len`?"),
        ("größe = 1", "größe", "uses the name `größe`, which is not ASCII", "write names with the letters a to z"),
        ("if 1:\n    x = 1", "if 1:\n    x = 1", "uses `if` at the top of a file", "at its top a file has imports"),
        ("f = 1\nf(1)", "f(1)", "does something at the top of a file", "at its top a file has imports"),
        ("def f():\n    class A:\n        pass", "class A:\n    pass", "uses `class` in a function", "at its top a file has imports"),
        ("@sorted\ndef f():\n    pass", "sorted", "decorates `f` with `sorted`", "use one of cache, "),
        ("import functools\n@functools.lru_cache(maxsize=len('a'))\ndef f():\n    pass", "functools.lru_cache(maxsize=len('a'))",
         "decorates `f` with computed options", "write each option as `NAME=True`"),
        ("@property\ndef f():\n    pass", "property", "decorates `f` with `property`", "use one of cache, "),
        ("class A:\n    @len\n    def f(self):\n        pass", "len", "decorates `f` with `len`", "use one of "),
        ("@len\nclass A:\n    pass", "len", "decorates `A` with `len`", "use one of dataclass, "),
        ("class A(dict):\n    pass", "dict", "derives `A` from `dict`", "write `@dataclass(frozen=True)`"),
        ("def f(o):\n    o.x = 1", "o.x", "changes the attribute `x`", "make a new object with `dataclasses.replace`"),
    ],
)  # fmt: skip
def test_a_place_that_reaches_outside_is_found_and_described(
    code: str, at: str, what: str, help_: str
) -> None:
    refused = found(code)
    assert refused is not None
    assert refused[:2] == (at, what)
    assert refused[2].startswith(help_)


@pytest.mark.parametrize(
    ("code", "word"),
    [
        ("x = 1\nx += 1", "+="),
        ("x = 1\ndel x", "del"),
        ("x = (y := 1)", ":="),
        ("for x in ():\n    pass", "for"),
        ("while 0:\n    pass", "while"),
        ("assert 1", "assert"),
        ("raise ValueError", "raise"),
        ("try:\n    pass\nexcept ValueError:\n    pass", "try"),
        ("match 1:\n    case _:\n        pass", "match"),
        ("x = [(yield)]", "yield"),
        ("x = [(yield from ())]", "yield from"),
        ("x = 1\nfor x.y in ():\n    pass", "for"),
    ],
)
def test_a_statement_of_functions_is_refused_at_the_top_by_its_word(code: str, word: str) -> None:
    refused = found(code)
    assert refused is not None
    assert refused[1] == f"uses `{word}` at the top of a file"


@pytest.mark.parametrize(
    ("code", "word"),
    [("class A:\n    pass", "class"), ("import math", "import"), ("from math import pi", "import")],
)
def test_a_statement_of_the_top_is_refused_in_a_function_by_its_word(code: str, word: str) -> None:
    refused = found("def f():\n    " + code.replace("\n", "\n    "))
    assert refused is not None
    assert refused[1] == f"uses `{word}` in a function"


def test_the_first_of_several_places_is_reported() -> None:
    assert (found("import math\nx = open\nimport os") or ())[:2] == ("open", "uses `open`")
    assert (found("x = open\ny = eval") or ())[:2] == ("open", "uses `open`")


def test_every_refused_form_has_a_remedy() -> None:
    assert all(description and help_ for description, help_ in REFUSED_NODES.values())


def test_a_form_that_nobody_listed_is_refused() -> None:
    tree = ast.parse("x = 1")

    class Unheard(ast.expr):
        """An expression of a Python to come."""

        _fields = ()

    assert isinstance(tree.body[0], ast.Assign)
    tree.body[0].value = ast.copy_location(Unheard(), tree.body[0].value)
    refusal = first_refusal(tree)
    assert refusal is not None
    assert refusal.description == "uses `Unheard`, a form of Python that is not allowed"


def test_an_interactive_session_which_adds_a_builtin_refuses_no_more() -> None:
    script = (
        "import builtins\nbuiltins._ = None\n"  # as the prompt does after an expression
        "import ast\nfrom aeros.spec.obligations.skill_syntax.allowed_syntax import first_refusal\n"
        "print(first_refusal(ast.parse('x = [0 for _ in range(3)]')))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ran.stdout == "None\n"
