"""Names of the code: words that no identifier uses, and class names that mean one thing.

`vocabulary_exceptions.txt` lists what still stands against these rules; the list may only shrink.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from tests.repo.tree import ROOT

_BANNED_TEXT: Final = """
told tell tells teller telling said beside luck lucky meant moment moments straight grounds passing intake
whoever whatever taken takes taking begun gone heard
"""
BANNED: Final = frozenset(_BANNED_TEXT.split())
"""Words of a private language: each has a plain term in plain-english.md or docs/glossary.md."""

BANNED_IN_TESTS: Final = frozenset({"told", "tell", "said", "luck", "meant", "whoever", "whatever"})
"""Words that no name in `tests/` uses. Test names are sentences, so verbs such as `takes` may stand."""

QUESTIONS: Final = frozenset({"what", "whether", "who", "whoever", "how", "why"})
"""Words that begin no function's name: a name is a verb phrase or a sentence, not a question."""

_EXCEPTIONS: Final = Path(__file__).with_name("vocabulary_exceptions.txt")
_MOST_EXCEPTIONS: Final = 0


def _words(name: str) -> set[str]:
    return {word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)}


def _bound_names(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield every name that a module binds: definitions, parameters, variables, fields, imports."""
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr
        elif isinstance(node, ast.alias) and node.asname:
            yield node.asname


@cache
def _texts() -> dict[str, str]:
    paths = [
        path
        for folder in ("aeros", "proofs", "benchmarks", "tools", "tests")
        for path in (ROOT / folder).rglob("*.py")
    ]
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in sorted(paths)}


@cache
def _tree(path: str) -> ast.Module:
    return ast.parse(_texts()[path])


_DEFINING: Final = (ast.Module, ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_BINDING: Final = (*_DEFINING, ast.arg, ast.Name, ast.Attribute, ast.alias)


@cache
def _nodes() -> dict[str, list[ast.AST]]:
    """Nodes that bind names or have a docstring, by file: each tree is walked through once.

    Only of files whose text has a word that may be at fault: most have none, and to parse a file takes twenty
    times as long as to search it.
    """
    return {
        path: [node for node in ast.walk(_tree(path)) if isinstance(node, _BINDING)]
        for path, text in _texts().items()
        if _may_be_at_fault(path, text)
    }


_IDENTIFIER: Final = re.compile(r"[^\W\d]\w*")


def _may_be_at_fault(path: str, text: str) -> bool:
    """Tell if a word of a text is banned, or a function or a docstring may begin with a question."""
    if re.search(rf"(?:def (?:test)?_*|[\"']\\?\s*)(?:{'|'.join(QUESTIONS)})(?![a-z])", text, re.IGNORECASE):
        return True
    banned = _banned_in(path)
    return any(_words(name) & banned for name in set(_IDENTIFIER.findall(text)) if _holds_any(name, banned))


def _holds_any(name: str, words: frozenset[str]) -> bool:
    lowered = name.lower()
    return any(word in lowered for word in words)


def _banned_names() -> set[str]:
    found = {
        f"word {path} {name}"
        for path, nodes in _nodes().items()
        for name in _bound_names(nodes)
        if _words(name) & _banned_in(path)
    }
    return found | {f"file {path}" for path in _texts() if _words(Path(path).stem) & _banned_in(path)}


def _questions() -> set[str]:
    """Functions whose name, and tests whose docstring, begins with a question word."""
    functions = {
        f"question {path} {node.name}"
        for path, nodes in _nodes().items()
        for node in nodes
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and node.name.removeprefix("test_").lstrip("_").split("_")[0] in QUESTIONS
    }
    return functions | {
        f"docstring {path} {docstring.splitlines()[0]}"
        for path, nodes in _nodes().items()
        if path.startswith("tests/")
        for node in nodes
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        if (docstring := ast.get_docstring(node)) and docstring.split()[0].lower() in QUESTIONS
    }


def _banned_in(path: str) -> frozenset[str]:
    return BANNED_IN_TESTS if path.startswith("tests/") else BANNED


def _doubled_classes() -> set[str]:
    """Public classes of one name in several modules; a declared form and what it resolves to are one pair."""
    places = defaultdict(set)
    for path in _texts():
        if not path.startswith("aeros/") or path.startswith("aeros/spec/declared/"):
            continue
        for node in _tree(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].add(path)
    return {f"class {name} {' '.join(sorted(paths))}" for name, paths in places.items() if len(paths) > 1}


def test_no_name_uses_a_private_word_and_no_class_name_means_two_things() -> None:
    allowed = set(_EXCEPTIONS.read_text(encoding="utf-8").splitlines())
    found = _banned_names() | _questions() | _doubled_classes()
    assert sorted(found - allowed) == [], "choose a plain word (CONTRIBUTING.md, Write)"
    assert sorted(allowed - found) == [], f"no longer true: delete these lines of {_EXCEPTIONS.name}"
    assert len(allowed) <= _MOST_EXCEPTIONS, "the list of exceptions may only shrink"


@pytest.mark.parametrize(
    "text",
    [
        "told = 1",
        "def f(the_moment_of): pass",
        "from os import path as whoever",
        "class SaidSo: pass",
        "def test_what_is(): pass",
        "def _how(): pass",
        'def f():\n    """Whether it is."""',
        "def f():\n    '''\n    Why it is.'''",
    ],
)
def test_a_file_that_is_at_fault_is_not_left_out(text: str) -> None:
    assert _may_be_at_fault("aeros/a.py", text)


def test_a_file_without_such_words_is_left_out() -> None:
    assert not _may_be_at_fault("aeros/a.py", "def show(speed): return speed")
