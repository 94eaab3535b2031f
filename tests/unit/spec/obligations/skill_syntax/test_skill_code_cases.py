"""Skill code of `skill_code_cases.txt` is judged as each case says; accepted code does what was claimed."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import GeneratorType
from typing import Any

import pytest

from aeros.runtime.skills.code import CodeFile
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_syntax.allowed_syntax import ALLOWED_NODES, REFUSED_NODES
from aeros.spec.obligations.skill_syntax.skill_source import read_skill_files
from aeros.spec.text.discovery import reference_site_path
from tests.reports_in_full import compare_with_section, shown

_CASES = Path(__file__).parents[1] / "data" / "skill_code_cases.txt"
_REPORTS = _CASES.with_name("skill_code_reports.txt")
_MODULE = Path(__file__).parents[5] / "ecms" / "clean_table"
_NO_CODE = {"AugLoad", "AugStore", "Expression", "ExtSlice", "FunctionType", "Index", "Interactive", "Param"}
_NO_CODE |= {"Suite", "TypeIgnore", "Num", "Str", "Bytes", "NameConstant", "Ellipsis"}


@dataclass(frozen=True)
class Case:
    """One case of the file: the code and the line that are reported, and the text of the skill."""

    name: str
    code: str
    line: int
    text: str


def _read_cases() -> Iterator[Case]:
    for block in re.split(r"^=== ", _CASES.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        head, _, text = block.partition("\n")
        code, _, name = head.partition(" ")
        line, _, rest = name.partition(" ")
        is_numbered = line.isdigit()
        yield Case(rest if is_numbered else name, code, int(line) if is_numbered else 0, text)


CASES = list(_read_cases())
ACCEPTED = [case for case in CASES if case.code == "ok"]
REJECTED = [case for case in CASES if case.code != "ok"]


@pytest.fixture(scope="module")
def loaded() -> tuple[Ecm, Site]:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    found = load_ecm(_MODULE, site, Diagnostics())
    assert found is not None
    skill = found.ecm.skills["wipe"]
    envelope = {**skill.envelope, "wait": skill.envelope["grip"]}
    return replace(found.ecm, skills={"wipe": replace(skill, envelope=envelope)}, perceivers={}), site


def judge(loaded: tuple[Ecm, Site], text: str) -> list[Diagnostic]:
    """Return every diagnostic about a file of skill code."""
    ecm, site = loaded
    files = read_skill_files(ecm.folder, {"skills.py": text.encode()})
    claims = [*entry_point_obligations(ecm, files), *skill_code_obligations(ecm, site, files)]
    return [one.diagnostic for one in claims if one.diagnostic is not None]


def test_the_file_holds_cases_of_every_kind() -> None:
    assert len(ACCEPTED) >= 9
    assert len(REJECTED) >= 130
    assert len({case.name for case in CASES}) == len(CASES)


@pytest.mark.parametrize("case", ACCEPTED, ids=lambda case: case.name)
def test_code_that_only_computes_and_asks_is_accepted(case: Case, loaded: tuple[Ecm, Site]) -> None:
    assert judge(loaded, case.text) == []


@pytest.mark.parametrize("case", REJECTED, ids=lambda case: case.name)
def test_any_other_code_is_refused_at_its_line_with_a_remedy(case: Case, loaded: tuple[Ecm, Site]) -> None:
    found = [one for one in judge(loaded, case.text) if one.code == case.code]
    assert found
    assert found[0].help
    assert found[0].primary is not None
    if case.code != "AE124":  # reported at the entry in the manifest
        assert found[0].primary.span.line == case.line
    if case.code != "AE139":  # in the words of the Python that runs
        lines = [line for one in judge(loaded, case.text) for line in shown(one)]
        compare_with_section(_REPORTS, case.name, "".join(f"{line}\n" for line in lines))


@pytest.mark.parametrize("case", ACCEPTED, ids=lambda case: case.name)
def test_accepted_code_asks_for_nothing_else_when_it_runs(case: Case, loaded: tuple[Ecm, Site]) -> None:
    ecm, site = loaded
    wipe = CodeFile("clean_table", "skills.py", "skills.py", case.text.encode()).generator_function("wipe")
    for observed in (
        {},
        {"hand": (1.0, 2.0, 3.0), "tool_position": "brush"},
        {"tool_position": (1.0, 2.0)},
        {"tool_position": {"kind": "a"}},
    ):
        body = wipe(observed, {})
        assert isinstance(body, GeneratorType)
        for action in _ask(body, observed):
            assert type(action) is Action
            assert action.kind in ecm.skills["wipe"].envelope
            assert set(action.parameters) <= set(site.kinds[action.kind].parameters)


def _ask(body: GeneratorType[Any, Any, Any], observed: dict[str, Any]) -> Iterator[Any]:
    """Yield what a skill asks for, until it ends or fails."""
    try:
        yield next(body)
        for _ in range(20):
            yield body.send(observed)
    except (StopIteration, RuntimeError, ValueError, KeyError, TypeError):
        return


def test_every_class_of_node_that_this_python_has_is_listed_once() -> None:
    classes = {
        name
        for name, one in vars(ast).items()
        if isinstance(one, type) and issubclass(one, ast.AST) and not one.__subclasses__()
        if not name.startswith("_")  # deprecated names, as `_ast_Ellipsis` in Python 3.13
    }
    assert not ALLOWED_NODES.keys() & REFUSED_NODES.keys()
    assert classes - _NO_CODE <= ALLOWED_NODES.keys() | REFUSED_NODES.keys()


@pytest.mark.parametrize(
    "character", ["\u202e", "\u2066", "\u200b", "\u00ad", "\x0c", "\r", "\x85", "\u3164"]
)
@pytest.mark.parametrize("where", ["# {} x", "x = '{}'", "x = 1 {} # x", "{} # x"])
def test_a_character_that_nobody_sees_is_refused_with_its_place(
    character: str, where: str, loaded: tuple[Ecm, Site]
) -> None:
    text = f"from math import pi\n{where.format(character)}\ndef wipe(o, i):\n    yield\n"
    (found,) = {one for one in judge(loaded, text) if one.code == "AE005"}
    assert found.primary is not None
    assert (found.primary.span.line, found.primary.span.text) == (2, character)
    assert f"U+{ord(character):04X}" in found.headline
    assert found.help
