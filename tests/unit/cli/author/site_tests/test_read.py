"""Mistakes in a file of tests, each at its line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.cli.author.site_tests.rewriting import rewrite


@pytest.mark.parametrize(
    ("old", "new", "code", "marked"),
    [
        ("by: [slow-near-person]", "by: [slow-near-persons]", "AE122", "slow-near-persons"),
        ("state: {person_near: true}", "state: {person_nere: true}", "AE122", "person_nere"),
        ("state: {person_near: true}", "state: {person_near: 3 m}", "AE203", "3 m"),
        ("{pace: 0.3 m/s}", "{pace: 0.3 s}", "AE204", "0.3 s"),
        ("{pace: 0.3 m/s}", "{pace: [1 m/s, 2 m/s]}", "AE112", "pace"),
        (
            "left_to_the_gate.tidy\n    action: approach\n    parameters: {pace: 0.3 m/s}",
            "left_to_the_gate.tidi\n    action: approach",
            "AE122",
            "left_to_the_gate.tidi",
        ),
        ("ages: {person_near: 101 ms}", "ages: {person_near: 1 m}", "AE204", "1 m"),
        ("codes: [AE501]", "codes: [AE000]", "AE122", "AE000"),
        ("expect: ALLOW", "expect: MAYBE", "AE110", "MAYBE"),
        ("    expect: ALLOW\n", "    expect: ALLOW\n    becomes: {pace: 1 m/s}\n", "AE101", ""),
        ("    verify: ", "    skill: a.b\n    verify: ", "AE101", ""),
        ("rejected/safety/fast_near_a_person", "nowhere", "AE130", "nowhere"),
    ],
)
def test_a_mistake_in_the_file_is_marked_in_its_line(
    changed: Path, old: str, new: str, code: str, marked: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = rewrite(changed, old, new)
    assert main(["test", str(file)]) == Exit.REJECTED
    shown = capsys.readouterr()
    assert shown.out == ""
    assert f"error[{code}]" in shown.err
    place = re.search(rf"--> {re.escape(str(file))}:(\d+):", shown.err)
    assert place is not None
    assert marked in file.read_text().splitlines()[int(place[1]) - 1]
