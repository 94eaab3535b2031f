"""Every module of `aeros` has a test file of its own place and name, so that its tests are found.

`aeros/runtime/gate/gate.py` is tested by `tests/unit/runtime/gate/test_gate.py`, or by several
`test_gate_*.py`.
"""

from __future__ import annotations

import ast
from pathlib import Path

from tests.conftest import MARKED
from tests.repo.tree import PYTHON, ROOT, text_of


def _has_code(path: Path) -> bool:
    """Return true if a module holds a function that does something: declarations alone have no behaviour."""
    functions = (
        one
        for one in ast.walk(ast.parse(text_of(path)))
        if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)
    )
    return any(not isinstance(statement, ast.Expr) for function in functions for statement in function.body)


def _mirrors(path: Path) -> list[Path]:
    """The test files of a module's own name."""
    folder = ROOT / "tests" / "unit" / path.parent.relative_to("aeros")
    return [*folder.glob(f"test_{path.stem}.py"), *folder.glob(f"test_{path.stem}_*.py")]


def test_every_module_has_tests_of_its_own() -> None:
    modules = [path for path in PYTHON if path.name not in ("__init__.py", "__main__.py")]
    without = [path.as_posix() for path in modules if _has_code(path) and not _mirrors(path)]
    assert without == [], "write tests/unit/<same folder>/test_<same name>.py for each"


def test_every_place_that_conftest_marks_exists() -> None:
    tests = ROOT / "tests"
    places = [place for of_marker in MARKED.values() for place in of_marker]
    assert [place for place in places if not list(tests.glob(place))] == []
