"""Every module of `aeros` has a test file of its own place and name, so that its tests are found.

`aeros/runtime/gate/gate.py` is tested by `tests/unit/runtime/gate/test_gate.py`, or by several
`test_gate_*.py`. `mirror_exceptions.txt` lists the modules that have none yet, and may only shrink.
"""

from __future__ import annotations

import ast
from pathlib import Path

from tests.conftest import MARKED
from tests.repo.tree import PYTHON, ROOT, text_of

_EXCEPTIONS = Path(__file__).with_name("mirror_exceptions.txt")
_MOST_EXCEPTIONS = 33
"""As many as there are: lower it with the list."""


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


def _without_tests() -> list[str]:
    modules = [path for path in PYTHON if path.name not in ("__init__.py", "__main__.py")]
    return [path.as_posix() for path in modules if _has_code(path) and not _mirrors(path)]


def _excepted() -> list[str]:
    lines = _EXCEPTIONS.read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_every_module_but_the_exceptions_has_tests_of_its_own() -> None:
    new = sorted(set(_without_tests()) - set(_excepted()))
    assert new == [], "write tests/unit/<same folder>/test_<same name>.py for each"


def test_no_exception_has_become_needless() -> None:
    assert sorted(set(_excepted()) - set(_without_tests())) == [], (
        "take these lines out, and lower the number"
    )
    assert _excepted() == sorted(_excepted())


def test_exceptions_become_fewer_and_never_more() -> None:
    assert len(_excepted()) == _MOST_EXCEPTIONS


def test_every_place_that_conftest_marks_exists() -> None:
    tests = ROOT / "tests"
    places = [place for of_marker in MARKED.values() for place in of_marker]
    assert [place for place in places if not list(tests.glob(place))] == []
