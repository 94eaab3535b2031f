"""Every code has a page in docs/codes, and the examples of each page show what the page says.

A page begins with its code and what the registry says of it, and goes on with `**What it checks.**`,
`**On a robot.**`, `## Failing` and `## Repaired`.  The blocks of the two sections are executed in order,
in a copy of docs/codes/base: ```diff FILE changes a file, ```python is run, ```console lists
commands.  Where a section has no command it is the usual one of the code's group.  After the first
section the code is reported, after the second nothing is.

    AEROS_UPDATE_GOLDEN=1 pytest tests/repo     rewrites the index, and fails
"""

from __future__ import annotations

import io
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from aeros.cli.author.explain import pages
from aeros.cli.main import main
from aeros.spec.diagnostics.codes import CODES
from tests.repo.tree import ROOT, check_generated

FOLDER = ROOT / "docs" / "codes"
_SECTION = re.compile(r"^## (Failing|Repaired)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_COMMANDS = {
    "decision": "aeros decide --ecm tidy --site site.yaml --skill wipe < wipe.json",
    "difference": "aeros diff released tidy --site site.yaml",
}
_USUAL = "aeros verify tidy --site site.yaml --no-lock"

ACCOMPANIED = {
    "AE953": {"AE954"},  # inputs that cannot be compared are shown with their text, too
    "AE504": {"AE851"},  # the composition that runs the skill cannot start it either
    "AE507": {"AE802"},  # a goal that never holds is never reached either
    "AE508": {"AE805"},  # a goal that always holds is reached from the start
    "AE859": {"AE858"},  # what moves an actuator holds it as a resource
    "AE601": {"AE604"},  # where two rules contradict each other, a third one denies nothing more
    "AE801": {"AE851"},  # a composition of the same skills has the same fault
    "AE731": {"AE730"},  # envelopes are proved to lie inside the permission
    "AE740": {"AE730"},  # actuators of every kind in an envelope are proved to be permitted
    "AE741": {"AE730", "AE740"},  # as is the risk
}
"""Codes that cannot come alone, and what comes with them."""


def _page(code: str) -> str:
    return (FOLDER / f"{code}.md").read_text(encoding="utf-8")


def _change(file: Path, patch: str) -> None:
    r"""Replace the lines `-` by the lines `+`; others stay, and each hunk (parted by `@@`) fits once."""
    text = file.read_text(encoding="utf-8")
    for hunk in patch.split("@@\n"):
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(old) == 1, f"{file} has {text.count(old)} times:\n{old}"
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")


def _run(command: str, patch: pytest.MonkeyPatch) -> int:
    line, _, given = command.partition(" < ")
    program, *arguments = shlex.split(line)
    if program == "cp":
        shutil.copytree(arguments[-2], arguments[-1])
        return 0
    assert program == "aeros", command
    request = b"" if not given else b" ".join(Path(given).read_bytes().split()) + b"\n"
    patch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(request)))
    return main(arguments)


def _codes(section: str, usual: str, capsys: pytest.CaptureFixture[str]) -> set[str]:
    """The codes that the last command of a section reports, once everything before it is done."""
    blocks = _BLOCK.findall(section)
    codes: set[str] | None = None
    for language, file, content in blocks:
        capsys.readouterr()
        if language == "diff":
            _change(Path(file), content)
        elif language == "python":
            exec(content, {})  # noqa: S102 - the page's own example
            shown = capsys.readouterr().out
            codes = set(shown.split()) if shown else codes
        else:
            assert language == "console"
            for command in content.splitlines():
                codes = _reported(command.removeprefix("$ "), capsys)
    assert blocks
    return _reported(usual, capsys) if codes is None else codes


def _reported(command: str, capsys: pytest.CaptureFixture[str]) -> set[str]:
    with pytest.MonkeyPatch.context() as patch:
        assert _run(command, patch) in (0, 1, 3), command
    shown = capsys.readouterr()
    return set(re.findall(r"(?<=[\[\"])AE\d{3}(?=[\]\"])", shown.out + shown.err))


@pytest.mark.parametrize("code", CODES)
def test_the_examples_show_what_the_page_says(
    code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(FOLDER / "base", tmp_path / "base")
    monkeypatch.chdir(tmp_path / "base")
    sections = dict(_SECTION.findall(_page(code)))
    assert list(sections) == ["Failing", "Repaired"]
    usual = _COMMANDS.get(CODES[code].group, _USUAL)
    assert _codes(sections["Failing"], usual, capsys) == {code} | ACCOMPANIED.get(code, set())
    assert _codes(sections["Repaired"], usual, capsys) == set()


@pytest.mark.parametrize("code", CODES)
def test_the_page_says_what_and_why(code: str) -> None:
    text = _page(code)
    summary = CODES[code].summary
    first = f"# {code} {CODES[code].slug}\n\n{summary[0].upper()}{summary[1:]}.\n\n**What it checks.** "
    assert text.startswith(first)
    assert "\n\n**On a robot.** " in text
    assert max(map(len, text.splitlines())) <= 120


def test_there_is_no_page_without_a_code() -> None:
    assert {page.stem for page in FOLDER.glob("AE*.md")} - set(CODES) == set()


def test_the_index_is_that_of_the_registry() -> None:
    expected = ""
    for group in dict.fromkeys(code.group for code in CODES.values()):
        of_group = [code for code in CODES.values() if code.group == group]
        expected += f"\n## {group.capitalize()}\n\n| code | name | what it says |\n|---|---|---|\n"
        expected += "".join(f"| [{one.id}]({one.id}.md) | {one.slug} | {one.summary} |\n" for one in of_group)
    check_generated("docs/codes/README.md", "codes", expected + "\n")


def test_the_pages_are_found_where_they_are() -> None:
    assert (pages() / "AE501.md").read_text(encoding="utf-8") == _page("AE501")
