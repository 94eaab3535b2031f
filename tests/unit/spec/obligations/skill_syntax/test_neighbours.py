"""Claims about code follow its imports from file to file of the module."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_syntax.neighbours import (
    files_run_by,
    files_run_together,
    neighbour_imports,
)
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile, read_skill_files
from aeros.spec.text.discovery import reference_site_path

MODULE = Path(__file__).parents[5] / "ecms" / "clean_table"
WIPE = "from .legs import leg\ndef wipe(o, i):\n    yield from leg(o)\n"
LEGS = "from aeros.skill import act\ndef leg(o):\n    yield act('grip', width=0.0, force=1.0)\n"


@pytest.fixture(scope="module")
def loaded() -> tuple[Ecm, Site]:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    found = load_ecm(MODULE, site, Diagnostics())
    assert found is not None
    skills = {"wipe": found.ecm.skills["wipe"]}
    (perceiver, *_) = found.ecm.perceivers.values()
    return replace(found.ecm, skills=skills, perceivers={perceiver.id: perceiver}), site


def _reported(loaded: tuple[Ecm, Site], **texts: str) -> list[tuple[str, str, str, int]]:
    """Code, headline, file and line of each report about these files."""
    ecm, site = loaded
    files = read_skill_files("", {f"{name}.py": text.encode() for name, text in texts.items()})
    found = [one.diagnostic for one in skill_code_obligations(ecm, site, files) if one.diagnostic is not None]
    return [
        (one.code, one.headline, one.primary.span.source.path, one.primary.span.line)
        for one in found
        if one.primary is not None
    ]


def _files(**texts: str) -> dict[str, SkillFile]:
    return {f"{name}.py": SkillFile(f"{name}.py", text.encode()) for name, text in texts.items()}


@pytest.mark.parametrize(
    "legs",
    [
        LEGS,
        # A class of a neighbour: its members may be read, and it may be a base.
        "from typing import NamedTuple\nclass Base(NamedTuple):\n    tilt: float\n" + LEGS,
        LEGS + "def other(o):\n    yield act('move_base', x=0.0, y=0.0, speed=0.1)\n",
    ],
)
def test_code_in_several_files_is_accepted_as_in_one(loaded: tuple[Ecm, Site], legs: str) -> None:
    wipe = WIPE
    if "Base" in legs:
        wipe = (
            "from .legs import Base, leg\nclass Other(Base):\n    '''Another.'''\n"
            "def wipe(o, i):\n    x = Base(1.0).tilt\n    yield from leg(o)\n"
        )
    assert _reported(loaded, skills=wipe, legs=legs) == []


@pytest.mark.parametrize(
    ("legs", "report"),
    [
        # An action beyond the envelope: in a function that is led to, by another name, or when loaded.
        (LEGS.replace("'grip', width", "'move_base', width"), ("AE133", 3)),
        (
            "from aeros.skill import act\nfrom .deep import leg as deeper\n"
            "def leg(o):\n    yield from deeper(o)\n",
            ("AE133", 3),
        ),
        (LEGS + "DRIVE = act('move_base', x=0.0, y=0.0, speed=0.1)\n", ("AE133", 4)),
        ("import os\n" + LEGS, ("AE134", 1)),
        ("import numpy as np\n" + LEGS, ("AE134", 1)),
        # Whoever receives what a neighbour's function yields can change the action.
        (
            "from .deep import leg as deeper\ndef leg(o):\n"
            "    for one in deeper(o):\n        one[1]['x'] = 9.0\n        yield one\n",
            ("AE133", 4),
        ),
        ("from .enum import Enum\n" + LEGS + "class A(Enum):\n    B = 1\n", ("AE143", 1)),
        (
            "from .typing import Union\nfrom aeros.skill import Action\nx: Union[Action]\n" + LEGS,
            ("AE133", 3),
        ),
    ],
)
def test_a_fault_in_an_imported_file_is_found_there(
    loaded: tuple[Ecm, Site], legs: str, report: tuple[str, int]
) -> None:
    deep = "from aeros.skill import act\ndef leg(o):\n    yield act('move_base', x=0.0, y=0.0, speed=0.1)\n"
    if "one[1]" in legs:
        deep = LEGS
    found = _reported(loaded, skills=WIPE, legs=legs, deep=deep, typing="Union = list\n")
    assert report in {(code, line) for code, _, _, line in found}
    assert {path for _, _, path, _ in found} <= {"legs.py", "deep.py"}


def test_a_file_of_skills_and_of_perceivers_keeps_to_both_lists(loaded: tuple[Ecm, Site]) -> None:
    see = "from .shared import PART\ndef see_table(view):\n    yield {}\n"
    wipe = "from .shared import PART\ndef wipe(o, i):\n    return\n    yield\n"
    assert _reported(loaded, skills=wipe, perceivers=see, shared="PART = 0.1\n") == []
    for line, kind in (("import numpy\n", "skill"), ("from aeros.skill import act\n", "perceiver")):
        ((code, headline, path, _),) = _reported(
            loaded, skills=wipe, perceivers=see, shared=f"{line}PART = 0.1\n"
        )
        assert (code, path) == ("AE134", "shared.py")
        assert headline.startswith(f"{kind} code of `clean_table` imports `")
    assert _reported(loaded, skills=GRIP, perceivers=see, shared="import numpy\nPART = 0.1\n") == []


GRIP = "def wipe(o, i):\n    return\n    yield\n"


def test_files_are_executed_for_an_entry_and_together() -> None:
    files = _files(
        skills="from .a import x\n", other="from .a import x\n", a="from .b import x\n", b="", lone=""
    )
    assert list(files_run_by("skills.py", files)) == ["skills.py", "a.py", "b.py"]
    assert list(files_run_by("absent.py", files)) == []
    assert list(files_run_together("b.py", files)) == ["skills.py", "other.py", "a.py", "b.py"]
    assert list(files_run_together("lone.py", files)) == ["lone.py"]


def test_only_a_file_beside_the_importing_one_is_a_neighbour() -> None:
    code = "from .legs import leg\nfrom .more.legs import leg\nfrom ..legs import leg\nfrom . import legs"
    (found,) = neighbour_imports(ast.parse(f"{code}\nfrom legs import leg"))
    assert (found.path, found.alias.name) == ("legs.py", "leg")
