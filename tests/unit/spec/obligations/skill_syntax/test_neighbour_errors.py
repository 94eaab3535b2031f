"""An import that finds no file or no name, and a circle of imports, are reported where they are written."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.obligations.skill_syntax.neighbour_errors import import_cycle_error, missing_neighbour_error
from aeros.spec.obligations.skill_syntax.neighbours import import_cycle
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile
from tests.reports_in_full import compare_with_file, shown

GRIP = "def wipe(o, i):\n    return\n    yield\n"
LEGS = "from aeros.skill import act\ndef leg(o):\n    yield act('grip', width=0.0, force=1.0)\n"


def _files(**texts: str) -> dict[str, SkillFile]:
    return {f"{name}.py": SkillFile(f"{name}.py", text.encode()) for name, text in texts.items()}


def _reported(**texts: str) -> list[tuple[str, str, str, int]]:
    """Code, headline, file and line of each report about these files."""
    files = _files(**texts)
    found = [missing_neighbour_error(file, files) for file in files.values()] + [import_cycle_error(files)]
    return [
        (one.code, one.headline, one.primary.span.source.path, one.primary.span.line)
        for one in found
        if one is not None and one.primary is not None
    ]


@pytest.mark.parametrize(
    ("text", "headline"),
    [
        ("from .leg import leg\n", "there is no `leg.py` in this module"),
        ("from .legs import lag\n", "`legs.py` defines no `lag`"),
        ("from .legs import act\n", "`legs.py` defines no `act`"),  # imported there
    ],
)
def test_an_import_that_finds_no_file_or_no_name_is_reported(text: str, headline: str) -> None:
    assert _reported(skills=text + GRIP, legs=LEGS) == [("AE143", headline, "skills.py", 1)]


def test_a_circle_of_imports_is_reported_once_with_each_import() -> None:
    texts = {
        "skills": "from .a import x\n" + GRIP,
        "a": "from .b import y\nx = 1\n",
        "b": "y = 1\nfrom .a import x\n",
    }
    headline = "2 files import each other in a circle"
    assert _reported(**texts) == [("AE144", headline, "a.py", 1)]
    assert [path for path, _ in import_cycle(_files(**texts))] == ["a.py", "b.py"]
    texts["a"] = "x = 1\n"
    assert _reported(**texts) == []
    (own,) = _reported(skills=GRIP, a="from .a import x as y\nx = 1\n")
    assert own == ("AE144", "a file imports itself", "a.py", 1)


def test_the_reports_on_imports_in_full() -> None:
    circle = {"a": "from .b import y\nx = 1\n", "b": "y = 1\nfrom .a import x\n"}
    texts: list[dict[str, str]] = [
        *({"skills": f"{line}\n{GRIP}", "legs": LEGS} for line in _MISSES),
        {"skills": "from .a import x\n" + GRIP, **circle},
        {"skills": GRIP, "a": "from .a import x\n"},
    ]
    lines: list[str] = []
    for files in (_files(**one) for one in texts):
        found = [missing_neighbour_error(file, files) for file in files.values()] + [
            import_cycle_error(files)
        ]
        lines += [line for one in found if one is not None for line in shown(one)]
    data = Path(__file__).parents[1] / "data"
    compare_with_file(data / "neighbour_reports.txt", "\n".join(lines) + "\n")


_MISSES = (
    "from .leg import leg",
    "from .arms import arm",
    "from .legs import lag",
    "from .legs import arm",
)
