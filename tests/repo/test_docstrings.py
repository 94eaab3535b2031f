"""Docstrings of public code: a first line that names or commands, and sections that say what goes in and out.

`docstring_exceptions.txt` lists functions that do not do so yet; the list may only shrink.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tests.repo.tree import PYTHON, text_of

_EXCEPTIONS: Final = Path(__file__).with_name("docstring_exceptions.txt")
_MOST_EXCEPTIONS: Final = 0
_QUESTION: Final = re.compile(
    r"(What|Whether|How|Why|Which|Where|Who|Whom|Whose|When|Whoever|Whatever|See)\b"
)
_SHORT: Final = frozenset(("None", "bool", "Self", "Iterator[None]", "Generator[None]"))
"""Results that the first line tells."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def _public(body: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Yield the public functions and classes of a module, and the public methods of its public classes."""
    for node in body:
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body, f"{prefix}{node.name}.")


def _problems(path: Path) -> Iterator[str]:
    tree = ast.parse(text_of(path))
    if _QUESTION.match(ast.get_docstring(tree) or ""):
        yield f"{path} (module): starts with a question word"
    for name, node in _public(tree.body):
        docstring = ast.get_docstring(node) if isinstance(node, Function | ast.ClassDef) else None
        if docstring is None:
            continue  # ruff's D rules ask for it
        if _QUESTION.match(docstring):
            yield f"{path} {name}: starts with a question word"
        if isinstance(node, Function):
            yield from (f"{path} {name}: {problem}" for problem in _missing_sections(node, docstring))


def _missing_sections(node: Function, docstring: str) -> Iterator[str]:
    decorators = {ast.unparse(one).split("(")[0] for one in node.decorator_list}
    if "override" in decorators or docstring.startswith("Implement"):
        return  # the port says it
    given = [
        *node.args.posonlyargs,
        *node.args.args,
        *node.args.kwonlyargs,
        node.args.vararg,
        node.args.kwarg,
    ]
    names = [
        one.arg for one in given if one is not None and one.arg not in {"self", "cls"} and one.arg.strip("_")
    ]
    described = set(re.findall(r"^ {4}\*{0,2}(\w+)(?: \([^)]*\))?:", docstring, flags=re.MULTILINE))
    missing = [name for name in names if name not in described]
    if missing:
        yield f"Args does not describe {', '.join(missing)}"
    returned = "" if node.returns is None else ast.unparse(node.returns)
    is_property = bool(decorators & {"property", "cached_property", "contextmanager"})
    if (
        returned not in _SHORT
        and not is_property
        and not re.search(r"^(Returns|Yields):", docstring, re.MULTILINE)
    ):
        yield "no Returns"


def test_public_functions_say_what_they_take_and_give() -> None:
    allowed = set(_EXCEPTIONS.read_text(encoding="utf-8").splitlines())
    found = {problem for path in PYTHON for problem in _problems(path)}
    assert sorted(found - allowed) == []
    assert sorted(allowed - found) == [], f"no longer true: delete these lines of {_EXCEPTIONS.name}"
    assert len(allowed) <= _MOST_EXCEPTIONS, "the list of exceptions may only shrink"
