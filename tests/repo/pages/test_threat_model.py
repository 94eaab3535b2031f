"""Each line of the threat model names a test, a theorem or an assumption that exists."""

from __future__ import annotations

import re

from aeros.spec.theorems.theorem_folder import proofs_folder, theorem_folders
from tests.repo.tree import ROOT, text_of

PAGE = "docs/threat-model.md"
ACTORS = (
    "Author of a module",
    "Operator",
    "Program of a tool",
    "Peer on the bus",
    "MCP client",
    "Other users of the host",
    "Thief of a disk",
)

_TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
_THEOREM = re.compile(r"theorem \[[^\]]+\]\(\.\./proofs/(\w+)/statement\.md\)")
_ASSUMPTION = re.compile(r"assumption: (.+?) *$")


def rows(text: str) -> list[list[str]]:
    """The rows of all tables, without their heads."""
    lines = [line.strip().strip("|").split("|") for line in text.splitlines() if line.startswith("|")]
    return [
        [cell.strip() for cell in line]
        for line in lines
        if not {*line[0].strip()} <= {"-"} and line[0] != " attempt "
    ]


def test_each_actor_has_lines_that_stop_and_lines_that_do_not() -> None:
    parts = re.split(r"^## (.+)$", text_of(PAGE), flags=re.MULTILINE)[1:]
    assert tuple(parts[::2]) == ACTORS
    for text in parts[1::2]:
        stopped, _, open_ = text.partition("Not stopped")
        assert rows(stopped)
        assert rows(open_)


def test_each_line_names_evidence() -> None:
    lines = rows(text_of(PAGE))
    assert len(lines) >= 30
    for line in lines:
        assert len(line) == 3, line
        assert all(line), line
        assert _TEST.search(line[2]) or _THEOREM.search(line[2]) or _ASSUMPTION.search(line[2]), line


def test_every_named_test_exists() -> None:
    named = _TEST.findall(text_of(PAGE))
    assert named
    for path, name in named:
        assert (ROOT / path).is_file(), path
        assert re.search(rf"^(async )?def {name}\(", text_of(path), re.MULTILINE), f"{path}::{name}"


def test_every_named_theorem_exists() -> None:
    named = set(_THEOREM.findall(text_of(PAGE)))
    assert named
    assert named - theorem_folders(proofs_folder()).keys() == set()


def test_every_named_assumption_is_one_of_the_assurance() -> None:
    table = text_of("docs/assurance.md").partition("## Assumptions")[2]
    declared = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")]
    named = [found[1] for row in rows(text_of(PAGE)) if (found := _ASSUMPTION.search(row[2]))]
    assert named
    assert [one for one in named if not any(text.startswith(one) for text in declared)] == []
