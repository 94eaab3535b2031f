"""Sizes of the house: packages, classes, contracts and configuration stay small enough to be read whole."""

from __future__ import annotations

import ast
import re
from collections import Counter
from typing import Final

from tests.repo.tree import ROOT, text_of

MOST_MODULES: Final = 20
MOST_CLASS_LINES: Final = 250
MOST_CONTRACTS: Final = 12
MOST_CONFIGURATION_LINES: Final = 200

_SOURCES: Final = [
    path.relative_to(ROOT)
    for folder in (
        "aeros",
        "proofs",
        "benchmarks",
        "tools",
        "tests",
    )
    for path in (ROOT / folder).rglob("*.py")
    if "probes" not in path.parts  # hostile skill code, one file a case: data
]


def test_no_package_has_more_modules_than_one_list_shows() -> None:
    sizes = Counter(path.parent.as_posix() for path in _SOURCES if path.name != "__init__.py")
    assert {name: size for name, size in sizes.items() if size > MOST_MODULES} == {}


def test_no_class_is_too_long() -> None:
    lengths = {
        f"{path}::{node.name}": (node.end_lineno or 0) - node.lineno + 1
        for path in _SOURCES
        if path.parts[0] != "tests"
        for node in ast.walk(ast.parse(text_of(path)))
        if isinstance(node, ast.ClassDef)
    }
    assert {name: lines for name, lines in lengths.items() if lines > MOST_CLASS_LINES} == {}


def test_contracts_are_few_and_every_layer_list_is_exhaustive() -> None:
    text = text_of(".importlinter")
    assert len(re.findall(r"^\[importlinter:contract:", text, re.MULTILINE)) <= MOST_CONTRACTS
    assert text.count("type = layers") == text.count("exhaustive = True") > 0


def test_the_project_file_is_short() -> None:
    assert len(text_of("pyproject.toml").splitlines()) <= MOST_CONFIGURATION_LINES
