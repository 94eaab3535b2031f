"""Keys of returned and yielded dictionaries: undeclared ones are found where they are certain."""

from __future__ import annotations

import ast

import pytest

from aeros.spec.obligations.skill_syntax.returned_keys import undeclared_keys
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile


def found(body: str, leaving: type[ast.Return | ast.Yield] = ast.Return) -> list[str]:
    """The marked keys of a function with this body, whose declared keys are `height` and `width`."""
    file = SkillFile("skills.py", f"def entry(view):\n{body}".encode())
    mistakes = undeclared_keys(file, file.functions["entry"], leaving, ("height", "width"), "an output")
    return [one.primary.span.text for one in mistakes if one.primary is not None]


@pytest.mark.parametrize(
    "body",
    [
        "    return {'height': 1, 'heihgt': 2}\n",
        "    if view:\n        return {'height': 1}\n    return {'heihgt': 2, **view}\n",
    ],
)
def test_an_undeclared_key_is_marked(body: str) -> None:
    assert found(body) == ["'heihgt'"]


@pytest.mark.parametrize(
    "body",
    [
        "    return {'height': 1, **view}\n",
        "    return {view: 1}\n",
        "    other = {'heihgt': 1}\n    return {'height': other['heihgt']}\n",
        "    values = {'heihgt': 1}\n    view(values)\n    return values\n",
        "    values = {'heihgt': 1}\n    del values['heihgt']\n    return values\n",
        "    values = {'heihgt': 1}\n    values.pop('heihgt')\n    return values\n",
        "    values = view\n    values['heihgt'] = 2\n    return values\n",
        "    def inner():\n        return {'heihgt': 1}\n    return {'height': inner()}\n",
        "    yield {'heihgt': 1}\n",
    ],
)
def test_a_key_that_may_be_right_is_not_marked(body: str) -> None:
    assert found(body) == []


def test_yielded_dictionaries_are_looked_at_where_they_leave() -> None:
    body = "    while True:\n        view = yield {'height': 1, 'depth': 2}\n"
    assert found(body, ast.Yield) == ["'depth'"]
    assert found(body) == []


def test_a_near_name_is_suggested_or_else_all_are_listed() -> None:
    file = SkillFile("skills.py", b"def entry():\n    return {'heihgt': 1, 'q': 2}\n")
    mistakes = undeclared_keys(file, file.functions["entry"], ast.Return, ("height", "width"), "an output")
    assert [(one.headline, one.help) for one in mistakes] == [
        ("`heihgt` is not an output", ("did you mean `height`?",)),
        ("`q` is not an output", ("there are `height`, `width`",)),
    ]
