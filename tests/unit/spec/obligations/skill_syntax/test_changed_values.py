"""Places at which an action may change are found; further cases are in `skill_code_cases.txt`."""

from __future__ import annotations

import ast

import pytest

from aeros.spec.obligations.skill_syntax.changed_values import first_change_of_actions
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

KEPT = "kept = act('wait')\n"  # an action at large


def changed(text: str) -> str | None:
    found = first_change_of_actions("skills.py", {"skills.py": SkillFile("skills.py", text.encode())})
    return None if found is None else ast.unparse(found)


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("x['a'] = 1", "x"),
        ("x[0]['a'] = 1", "x[0]"),
        ("del x['a']", "x"),
        ("x['a'] += 1", "x"),
        ("x |= {}", "x"),
        ("for x['a'] in y: pass", "x"),
        ("x.pop('a')", "x"),
        ("x = {}; x.pop('a')", None),
        ("x: dict = {}; x.pop('a')", None),
        ("(x := {}); x.pop('a')", None),
        ("x = [] if y else {}; x.pop()", None),
        ("x = y if y else {}; x.pop()", "x"),
        ("x = y or {}; x.pop()", "x"),
        ("x = dict(y); x['a'] = 1", None),
        ("x = y.copy(); x['a'] = 1", None),
        ("x = max(y); x['a'] = 1", "x"),
        ("def dict(y): return y\nx = dict(y); x['a'] = 1", "x"),
        ("x = {}; x, z = y; x['a'] = 1", "x"),
        ("x = {}\nfor x in y: pass\nx['a'] = 1", "x"),
        ("x = {}\ndef f(x): x['a'] = 1", "x"),
        ("x = 0; x |= 1; x += y", None),
        ("x += y", None),
    ],
)
def test_values_are_changed_only_under_the_name_to_which_a_new_one_was_assigned(
    code: str, expected: str | None
) -> None:
    assert changed(KEPT + code) == expected
    assert changed(code) is None  # no action is made


@pytest.mark.parametrize(
    ("code", "is_at_large"),
    [
        ("def f(o):\n    o['a'] = 1\n    yield act('wait')", False),
        ("def f(o):\n    o['a'] = 1\n    yield Action('wait', {})", False),
        ("def f(o):\n    o['a'] = 1\n    yield (act('wait'),)", True),
        ("def f():\n    yield act('wait')\ndef g(o):\n    o['a'] = yield from f()", False),
        ("def f():\n    yield act('wait')\ndef g(o):\n    o['a'] = next(f())", True),
        ("def f():\n    yield act('wait')\ndef g(o):\n    o['a'] = f", True),
        ("def f(o):\n    o['a'] = lambda: (yield act('wait'))", True),
        ("class C:\n    def f(self, o):\n        o['a'] = 1\n        yield act('wait')", True),
    ],
)
def test_nothing_is_asked_of_code_that_yields_each_action_where_it_is_made(
    code: str, is_at_large: bool
) -> None:
    assert changed(code) == ("o" if is_at_large else None)
