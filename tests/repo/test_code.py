from __future__ import annotations

import ast
import importlib
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import CODES
from tests.repo.tree import PYTHON, ROOT, check_generated, text_of

_REGISTRY = Path("aeros/spec/diagnostics/codes.py")


def _module(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def _exports() -> list[Path]:
    return [path for path in PYTHON if re.search(r"^__all__\b", text_of(path), re.MULTILINE)]


@pytest.mark.parametrize("path", _exports(), ids=str)
def test_everything_in_all_exists_once(path: Path) -> None:
    module = importlib.import_module(_module(path))
    assert [name for name in module.__all__ if not hasattr(module, name)] == []
    assert len(set(module.__all__)) == len(module.__all__)


def test_each_module_says_what_it_is_in_one_line() -> None:
    first = {path: (ast.get_docstring(ast.parse(text_of(path))) or "").partition("\n")[0] for path in PYTHON}
    assert len(first) > 500
    assert [path for path, line in first.items() if not line] == []
    # A bar would break the table of docs/architecture.md.
    assert [path for path, line in first.items() if "|" in line] == []


@cache
def _codes_in_use() -> set[str]:
    """Codes that are string constants anywhere but in the registry."""
    return {
        node.value
        for path in PYTHON
        if path != _REGISTRY and re.search(r"AE\d{3}", text_of(path))
        for node in ast.walk(ast.parse(text_of(path)))
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and re.fullmatch(r"AE\d{3}", node.value)
    }


def test_every_code_in_use_is_registered() -> None:
    assert _codes_in_use() - set(CODES) == set()


def test_every_registered_code_is_in_use() -> None:
    assert set(CODES) - _codes_in_use() == set()


def test_codes_are_unique_and_in_order() -> None:
    ids = re.findall(r'Code\(\s*"(AE\d{3})"', text_of(_REGISTRY))
    assert ids == sorted(set(ids))
    assert ids == list(CODES)


def test_codes_named_in_pages_and_manifests_are_registered() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "ecms").rglob("*.yaml")]
    named = {code for page in pages for code in re.findall(r"\bAE\d{3}\b", page.read_text(encoding="utf-8"))}
    assert named - set(CODES) == set()


def test_the_page_of_diagnostics_is_that_of_the_registry() -> None:
    groups = dict.fromkeys(code.group for code in CODES.values())
    expected = ""
    for group in groups:
        expected += f"\n## {group.capitalize()}\n\n| code | name | what it says |\n|---|---|---|\n"
        expected += "".join(
            f"| {code.id} | {code.slug} | {code.summary} |\n"
            for code in CODES.values()
            if code.group == group
        )
    check_generated("docs/diagnostics.md", "codes", expected + "\n")


def test_files_of_tests_may_share_a_name_in_different_folders() -> None:
    """`test_arguments.py` mirrors two modules; pytest then has to import them by their paths."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert max(names.values()) > 1
    assert "--import-mode=importlib" in text_of("pyproject.toml")
