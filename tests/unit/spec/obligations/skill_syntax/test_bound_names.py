"""Every form of Python that binds a name is seen: compared with the compiler's own table of symbols."""

from __future__ import annotations

import ast
import symtable

import pytest

from aeros.spec.obligations.skill_syntax.bound_names import bound_names, identifiers

BINDING = [
    "a = 1",
    "a: int = 1",
    "a += 1",
    "(a, [b, *c]) = 1, [2]",
    "del a",
    "import a",
    "import a.b",
    "import a.b as c",
    "from a import b",
    "from a import b as c",
    "def a(b=(c := 1)): d = 1",
    "def a(b: (c := int)) -> (e := int): pass",
    "def a(*, b=(c := 1)): pass",
    "x = lambda a=(b := 1): (c := 2)",
    "class a((b := object)): c = 1",
    "class a(metaclass=(b := type)): c = 1",
    "@(a := staticmethod)\ndef b(): pass",
    "for a, b in (): c = 1\nelse: d = 2",
    "while (a := 0): b = 1",
    "with (a := b) as c, d as (e, f): g = 1",
    "try: a = 1\nexcept ValueError as b: c = 1\nelse: d = 1\nfinally: e = 1",
    "match (z := 1):\n case [a, *b]: c = 1\n case {'x': d, **e}: pass",
    "match 1:\n case int(f) as g: pass\n case h if (i := 1): pass",
    "if (a := 1): b = 1\nelif (c := 2): d = 1",
]


@pytest.mark.parametrize("code", BINDING)
def test_a_name_is_bound_where_the_compiler_says_so(code: str) -> None:
    table = symtable.symtable(code, "code.py", "exec")
    expected = {one.get_name() for one in table.get_symbols() if one.is_assigned() or one.is_imported()}
    expected |= {name for name in ("a",) if code == "del a"}
    tree = ast.parse(code)
    assert {name for statement in tree.body for name in bound_names(statement)} == expected


@pytest.mark.parametrize("code", ["x = [a for a in range(3) if (b := a)]", "x = {a: (b := 1) for a in (1,)}"])
def test_a_walrus_in_a_comprehension_binds_outside_of_it(code: str) -> None:
    assert set(bound_names(ast.parse(code))) == {"x", "b"}


def test_a_name_is_yielded_as_often_as_it_is_bound() -> None:
    assert sorted(bound_names(ast.parse("a = a = 1\nimport a"))) == ["a", "a", "a"]


def test_names_of_inner_scopes_are_included_on_request() -> None:
    tree = ast.parse(
        "def a(b, *c, **d):\n    e = [f for f in b]\n    global g\nclass h:\n    i = lambda j: 1"
    )
    assert set(bound_names(tree)) == {"a", "h"}
    assert set(bound_names(tree, nested=True)) == set("abcdefghij")


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("a.b(c=1)", {"a", "b", "c"}),
        ("import a.b as c", {"a", "b", "c"}),
        ("from a.b import c as d", {"a", "b", "c", "d"}),
        ("from __future__ import annotations", {"annotations"}),
        ("from a import *", {"a"}),
        ("def a(b, /, *c, d, **e): pass", set("abcde")),
        ("match a:\n case b(c=d): pass", set("abcd")),
        ("match a:\n case {'x': 1, **b}: pass", {"a", "b"}),
        ("match a:\n case [*b]: pass", {"a", "b"}),
        ("try: pass\nexcept a as b: pass", {"a", "b"}),
        ("def a():\n global b\n", {"a", "b"}),
        ("x = 'text'", {"x"}),
    ],
)
def test_every_identifier_of_a_text_is_found(code: str, expected: set[str]) -> None:
    assert {name for node in ast.walk(ast.parse(code)) for name in identifiers(node)} == expected
