"""Compositions drawn: their steps, conditions and handlers, with outcomes on the edges."""

from __future__ import annotations

import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

CORPUS = Path(__file__).parents[3] / "corpus"


NESTED = (
    *("graph", str(CORPUS / "accepted" / "sequence_in_a_branch_in_a_sequence")),
    *("--site", str(CORPUS / "site" / "table.yaml"), "--kind", "composition"),
)


def test_a_composition_is_drawn_with_outcomes_conditions_and_handlers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([*NESTED]) == Exit.SUCCESS
    assert capsys.readouterr().out == (
        '---\ntitle: "sequence_in_a_branch_in_a_sequence: composition composed"\n---\n'
        "flowchart TD\n"
        '  n0(["composed<br/>where not stop_pressed"])\n'
        '  n1["fetch<br/>at most 3 tries"]\n'
        '  n2[/"at the same time"/]\n'
        '  n3["turn_round: roll"]\n'
        '  n4{"if not table_tidy"}\n'
        '  n5["scrub"]\n'
        '  n6["sweep_arm"]\n'
        '  n7[/"when all have succeeded"/]\n'
        '  n8("shake")\n'
        '  n9[["done"]]\n'
        '  n10{{"stopped as failed"}}\n'
        "  n0 --> n1\n"
        '  n1 -.->|"mistaken"| n8\n'
        '  n1 -.->|"mistaken, after 3 tries"| n10\n'
        '  n1 -->|"found"| n2\n'
        "  n2 --> n3\n"
        "  n2 --> n4\n"
        '  n3 -->|"rolled or held_up"| n7\n'
        '  n4 -->|"then"| n5\n'
        '  n4 -->|"else"| n6\n'
        '  n5 -->|"scrubbed"| n6\n'
        '  n6 -->|"done"| n7\n'
        "  n7 --> n9\n"
        '  n8 -.->|"stuck"| n10\n'
        '  n8 -->|"shaken"| n1\n'
    )


def test_a_composition_in_the_language_of_graphviz(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NESTED, "--composition", "composed", "--format", "dot"]) == Exit.SUCCESS
    assert capsys.readouterr().out == (
        'digraph "sequence_in_a_branch_in_a_sequence: composition composed" {\n'
        "  node [fontname=sans]; edge [fontname=sans];\n"
        '  n0 [shape=box, style=rounded, penwidth=2, label="composed\\nwhere not stop_pressed"];\n'
        '  n1 [shape=box, label="fetch\\nat most 3 tries"];\n'
        '  n2 [shape=box, style=filled, fillcolor=gray85, height=0.2, label="at the same time"];\n'
        '  n3 [shape=box, label="turn_round: roll"];\n'
        '  n4 [shape=diamond, label="if not table_tidy"];\n'
        '  n5 [shape=box, label="scrub"];\n'
        '  n6 [shape=box, label="sweep_arm"];\n'
        '  n7 [shape=box, style=filled, fillcolor=gray85, height=0.2, label="when all have succeeded"];\n'
        '  n8 [shape=box, style=rounded, label="shake"];\n'
        '  n9 [shape=box, peripheries=2, label="done"];\n'
        '  n10 [shape=octagon, label="stopped as failed"];\n'
        '  n0 -> n1 [label=""];\n'
        '  n1 -> n8 [label="mistaken", style=dashed];\n'
        '  n1 -> n10 [label="mistaken, after 3 tries", style=dashed];\n'
        '  n1 -> n2 [label="found"];\n'
        '  n2 -> n3 [label=""];\n'
        '  n2 -> n4 [label=""];\n'
        '  n3 -> n7 [label="rolled or held_up"];\n'
        '  n4 -> n5 [label="then"];\n'
        '  n4 -> n6 [label="else"];\n'
        '  n5 -> n6 [label="scrubbed"];\n'
        '  n6 -> n7 [label="done"];\n'
        '  n7 -> n9 [label=""];\n'
        '  n8 -> n10 [label="stuck", style=dashed];\n'
        '  n8 -> n1 [label="shaken"];\n'
        "}\n"
    )


def test_a_composition_as_an_image_needs_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NESTED, "--format", "svg"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    tree = ET.fromstring(shown)  # noqa: S314 - our own output
    assert not re.search(r"href|url\((?!#head\))|<script|<style|@import", shown)
    written = [one for one in tree.findall("{*}text") if one.get("y")]
    top = {"".join(one.itertext()): float(one.get("y", "")) for one in reversed(written)}  # nodes come first
    way = ["composed", "fetch", "at the same time", "scrub", "sweep_arm", "when all have succeeded", "done"]
    assert [top[name] for name in way] == sorted({top[name] for name in way})


def test_an_outcome_that_never_happens_is_not_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(NESTED[1], tmp_path / "nested")
    manifest = tmp_path / "nested" / "ecm.yaml"
    written = manifest.read_text()
    manifest.write_text(
        written.replace("found: {", "found: {probability: 1, ").replace(
            "mistaken: {", "mistaken: {probability: 0, "
        )
    )
    assert main(["graph", str(tmp_path / "nested"), *NESTED[2:]]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "mistaken" not in shown
    assert "found" in shown


def test_parts_that_may_be_stopped_name_their_steps_and_fail_at_any_time(
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = CORPUS / "accepted" / "held_and_timed_parts"
    site = ("--site", str(CORPUS / "site" / "table.yaml"))
    assert main(["graph", str(case), *site, "--kind", "composition"]) == Exit.SUCCESS
    lines = capsys.readouterr().out.splitlines()
    assert '  n1[/"while fetched == brush: sweep, sweep_slowly"/]' in lines
    assert '  n3[/"within 5 s: sweep"/]' in lines
    assert '  n1 -.->|"at any time until its end"| n6' in lines
    assert '  n3 -.->|"at any time until its end"| n5' in lines
