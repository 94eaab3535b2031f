from __future__ import annotations

import re
import shutil
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import pytest

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
    assert graph("--kind", "closed-loop", "--format", "dot") == Exit.SUCCESS
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
    graph("--kind", what, "--format", "mermaid")
    shown = capsys.readouterr().out
    nodes = set(re.findall(r"^  (\w+)[\[({]", shown, re.MULTILINE))
    arrows = re.findall(r"^  (\w+) -\S+ ?(?:\S.*\| )?(\w+)$", shown, re.MULTILINE)
    assert {name for arrow in arrows for name in arrow} == nodes
    graph("--kind", what, "--format", "dot")
    shown = capsys.readouterr().out
    assert re.findall(r"^  (\w+) -> (\w+) ", shown, re.MULTILINE) == arrows
    graph("--kind", what, "--format", "svg")
    tree = ET.fromstring(capsys.readouterr().out)  # noqa: S314 - our own output
    assert len(tree.findall(".//{*}path[@marker-end]")) == len(arrows)


def test_states_that_cannot_reach_the_goal_stand_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(BASE / "tidy", tmp_path / "tidy")
    manifest = tmp_path / "tidy" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("wiped: {effects: {bench_clean: true}, ", "wiped: {"))
    assert main(["graph", str(tmp_path / "tidy"), *SITE, "--kind", "closed-loop", "--format", "dot"]) == 0
    assert "octagon" in capsys.readouterr().out


CORPUS = Path(__file__).parents[3] / "corpus"
NESTED = (
    *("graph", str(CORPUS / "accepted" / "sequence_in_a_branch_in_a_sequence")),
    *("--site", str(CORPUS / "site" / "table.yaml"), "--kind", "composition"),
)


def test_an_unknown_composition_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NESTED, "--composition", "composd"]) == Exit.USAGE
    assert "has no composition `composd`; did you mean `composed`?" in capsys.readouterr().err
    assert graph("--kind", "composition", "--composition", "c") == Exit.USAGE
    assert capsys.readouterr().err == "aeros: `tidy` has no composition `c`; it has clean_once\n"


def test_a_module_without_compositions_has_none_to_draw(capsys: pytest.CaptureFixture[str]) -> None:
    alone = ["graph", str(CORPUS / "accepted" / "always_slow"), *NESTED[2:]]
    assert main(alone) == Exit.USAGE
    assert capsys.readouterr().err == "aeros: `always_slow` has no composition\n"


def test_layers_go_down_and_boxes_do_not_touch(capsys: pytest.CaptureFixture[str]) -> None:
    graph("--kind", "closed-loop", "--format", "svg")
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


def test_a_loop_without_cells_is_not_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(BASE / "tidy", tmp_path / "tidy")
    manifest = tmp_path / "tidy" / "ecm.yaml"
    goal = "goal: human_distance * human_distance > 1 m*m"
    manifest.write_text(manifest.read_text().replace("goal: bench_clean", goal))
    arguments = ["graph", str(tmp_path / "tidy"), *SITE, "--kind", "closed-loop"]
    assert main(arguments) == Exit.REJECTED
    assert "a condition multiplies `human_distance` by itself" in capsys.readouterr().err


def test_a_module_that_cannot_be_read_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "ecm.yaml").write_text("id: x\n")
    assert main(["graph", str(tmp_path), *SITE]) == Exit.REJECTED
    assert "AE102" in capsys.readouterr().err
