from __future__ import annotations

import re
import shutil
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import pytest

from aeros.apps.drawings.drawing import Diagram, Edge, Node, dot, mermaid, svg
from aeros.cli.main import main
from aeros.exit_codes import Exit

BASE = Path(__file__).parents[4] / "docs" / "codes" / "base"
SITE = ("--site", str(BASE / "site.yaml"))
FORMATS = ("mermaid", "dot", "svg")


def graph(*arguments: str) -> int:
    return main(["graph", str(BASE / "tidy"), *SITE, *arguments])


def test_the_rules_are_drawn_in_their_order(capsys: pytest.CaptureFixture[str]) -> None:
    assert graph() == Exit.SUCCESS
    assert capsys.readouterr().out == (
        '---\ntitle: "tidy: planning rules of clean_up"\n---\n'
        "flowchart TD\n"
        '  start(["clean_up"])\n'
        '  step0["1. pick_cloth<br/>unless cloth_held or bench_clean<br/>at most 2 tries"]\n'
        '  step1["2. wipe<br/>unless bench_clean<br/>at most 2 tries"]\n'
        '  goal[["goal: bench_clean"]]\n'
        "  start --> step0\n"
        '  step0 -.->|"try again"| step0\n'
        "  step0 --> step1\n"
        '  step1 -.->|"try again"| step1\n'
        "  step1 --> goal\n"
    )


def test_the_closed_loop_has_every_outcome(capsys: pytest.CaptureFixture[str]) -> None:
    assert graph("--what", "closed-loop", "--format", "dot") == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert set(re.findall(r"(\w+) → (\w+)", shown)) == {
        ("pick_cloth", "picked"),
        ("pick_cloth", "missed"),
        ("wipe", "wiped"),
        ("wipe", "streaks"),
    }
    failures = [line for line in shown.splitlines() if "dashed" in line]
    assert failures
    assert all("missed" in line or "streaks" in line for line in failures)


@pytest.mark.parametrize("what", ["rules", "closed-loop"])
def test_every_arrow_of_every_format_joins_two_nodes(what: str, capsys: pytest.CaptureFixture[str]) -> None:
    graph("--what", what, "--format", "mermaid")
    shown = capsys.readouterr().out
    nodes = set(re.findall(r"^  (\w+)[\[({]", shown, re.MULTILINE))
    arrows = re.findall(r"^  (\w+) -\S+ ?(?:\S.*\| )?(\w+)$", shown, re.MULTILINE)
    assert {name for arrow in arrows for name in arrow} == nodes
    graph("--what", what, "--format", "dot")
    shown = capsys.readouterr().out
    assert re.findall(r"^  (\w+) -> (\w+) ", shown, re.MULTILINE) == arrows
    graph("--what", what, "--format", "svg")
    tree = ET.fromstring(capsys.readouterr().out)  # noqa: S314 - our own output
    assert len(tree.findall(".//{*}path[@marker-end]")) == len(arrows)


def test_what_cannot_reach_the_goal_stands_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(BASE / "tidy", tmp_path / "tidy")
    manifest = tmp_path / "tidy" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("wiped: {effects: {bench_clean: true}, ", "wiped: {"))
    assert main(["graph", str(tmp_path / "tidy"), *SITE, "--what", "closed-loop", "--format", "dot"]) == 0
    assert "octagon" in capsys.readouterr().out


CORPUS = Path(__file__).parents[3] / "corpus"
NESTED = (
    *("graph", str(CORPUS / "accepted" / "sequence_in_a_branch_in_a_sequence")),
    *("--site", str(CORPUS / "site" / "table.yaml"), "--what", "composition"),
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
        '  n1 -.->|"mistaken, after 3 tries"| n10\n'
        '  n1 -.->|"mistaken"| n8\n'
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
        '  n1 -> n10 [label="mistaken, after 3 tries", style=dashed];\n'
        '  n1 -> n8 [label="mistaken", style=dashed];\n'
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


def test_an_unknown_composition_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NESTED, "--composition", "composd"]) == Exit.USAGE
    assert "has no composition `composd`; did you mean `composed`?" in capsys.readouterr().err
    assert graph("--what", "composition", "--composition", "c") == Exit.USAGE
    assert capsys.readouterr().err == "aeros: `tidy` has no composition `c`; it has clean_once\n"


def test_a_module_without_compositions_has_none_to_draw(capsys: pytest.CaptureFixture[str]) -> None:
    alone = ["graph", str(CORPUS / "accepted" / "always_slow"), *NESTED[2:]]
    assert main(alone) == Exit.USAGE
    assert capsys.readouterr().err == "aeros: `always_slow` has no composition\n"


HOSTILE = Diagram(
    'a "title" </title><script>',
    (Node("a", ('"]; end', "<b>&amp;</b>", "\x1b[31m\u202e"), "start"), Node("b", ("back\\slash",))),
    (Edge("a", "b", '"|<i>'), Edge("b", "a", "]]>"), Edge("b", "b", "again", dashed=True)),
)


def test_text_is_never_markup() -> None:
    tree = ET.fromstring(svg(HOSTILE))  # noqa: S314 - our own output
    assert {one.tag.rpartition("}")[2] for one in tree.iter()} == {
        *("svg", "title", "defs", "marker", "path", "rect", "text")
    }
    assert "".join(tree.itertext()).count("<b>&amp;</b>") == 1
    chart = mermaid(HOSTILE).split("flowchart TD\n")[1]
    assert "<b>" not in chart
    assert chart.count('"') == 2 * (2 + 3)
    for line in dot(HOSTILE).splitlines():
        assert len(re.findall(r'(?<!\\)(?:\\\\)*"', line)) in (0, 2)
    assert all("\x1b" not in drawn and "\u202e" not in drawn for drawn in (chart, dot(HOSTILE), svg(HOSTILE)))


def test_layers_go_down_and_boxes_do_not_touch(capsys: pytest.CaptureFixture[str]) -> None:
    graph("--what", "closed-loop", "--format", "svg")
    tree = ET.fromstring(capsys.readouterr().out)  # noqa: S314 - our own output
    boxes = [one for one in tree.findall("{*}rect") if one.get("rx")]
    rows: dict[float, list[tuple[float, float]]] = {}
    for box in boxes:
        left, width, top, height = (float(box.get(name, "")) for name in ("x", "width", "y", "height"))
        rows.setdefault(top + height / 2, []).append((left, left + width))
    assert len(rows) > 2
    for row in rows.values():
        assert all(right < left for (_, right), (left, _) in pairwise(sorted(row)))


def test_an_unknown_task_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert graph("--task", "clean") == Exit.USAGE
    assert capsys.readouterr().err == "aeros: `tidy` has no task `clean`; did you mean `clean_up`?\n"


def test_a_loop_over_numbers_is_not_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(BASE / "tidy", tmp_path / "tidy")
    manifest = tmp_path / "tidy" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("goal: bench_clean", "goal: human_distance > 1 m"))
    arguments = ["graph", str(tmp_path / "tidy"), *SITE, "--what", "closed-loop"]
    assert main(arguments) == Exit.REJECTED
    assert (
        "depends on `human_distance`, which is neither a truth value nor an enum" in capsys.readouterr().err
    )


def test_a_module_that_cannot_be_read_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "ecm.yaml").write_text("id: x\n")
    assert main(["graph", str(tmp_path), *SITE]) == Exit.REJECTED
    assert "AE102" in capsys.readouterr().err
