from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

from tests.repo.tree import PYTHON, ROOT, check_generated, text_of


def _first_line(path: Path) -> str:
    return (ast.get_docstring(ast.parse(text_of(path))) or "").partition("\n")[0]


def test_the_map_of_the_tree_is_that_of_the_tree() -> None:
    expected = ""
    for folder in sorted({path.parent for path in PYTHON}):
        inside = [path for path in PYTHON if path.parent == folder and path.name != "__init__.py"]
        expected += f"\n### {folder}/\n\n{_first_line(folder / '__init__.py')}\n"
        if inside:
            expected += "\n| file | what it is |\n|---|---|\n"
        expected += "".join(f"| `{path.name}` | {_first_line(path)} |\n" for path in inside)
    check_generated("docs/architecture.md", "map", expected + "\n")


def test_every_path_that_the_map_names_exists() -> None:
    named = re.findall(r"`([\w.<>/-]+/)`", text_of("docs/architecture.md"))
    assert named
    assert [path for path in named if "<" not in path and not (ROOT / path).exists()] == []


def test_the_layers_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == EXIT_STATUS_SUCCESS


def test_skill_code_sees_nothing_of_aeros_but_its_interface() -> None:
    for path in sorted((ROOT / "ecms").rglob("*.py")):
        names = {
            name
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Import | ast.ImportFrom)
            for name in (
                [node.module or ""] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
            )
        }
        used = {name for name in names if name.split(".")[0] == "aeros"}
        entries = {"skills.py": {"aeros.skill"}, "perceivers.py": {"aeros.perception"}}
        allowed = entries.get(path.name, {"aeros.skill", "aeros.perception"})
        assert used <= allowed, path
        assert len(used) <= 1, path
