"""The latest plan and the sequence of skills are drawn from the record, however long the run was."""

from __future__ import annotations

from pathlib import Path

from aeros.apps.drawings.drawing import svg
from aeros.apps.report_page.run_data import RunData, SkillExecution, TraceEvent, read_run_data
from aeros.apps.report_page.run_diagrams import plan_diagram, run_diagram
from tests.unit.apps.report_page.left_runs import copied_run


def test_the_latest_plan_is_drawn_with_how_its_parts_were_left() -> None:
    plans = [
        TraceEvent(0.0, "plan-accepted", "", {"steps": ["m.a"]}),
        TraceEvent(
            5.0,
            "plan-accepted",
            "",
            {"steps": ["m.a (retry 2)", "(if not x then (m.b) else nothing)", "m.c", "m.d"]},
        ),
    ]
    runs = [
        SkillExecution("m.d", 1.0, None, 2.0, "finished", "", "step", "ok", False),
        SkillExecution("m.a", 5.0, None, 6.0, "finished", "", "step", "ok", False),
        SkillExecution("m.b", 6.0, None, 7.0, "denied", "", "step", None, True),
        SkillExecution("m.c", 7.0),
    ]
    drawing = plan_diagram(RunData(runs=runs, events=plans))
    assert drawing is not None
    assert [node.lines[-1] for node in drawing.nodes] == [
        "planned at 5.00 s", "done", "failed", "not ended", "not run"
    ]  # fmt: skip
    assert [(edge.source, edge.target) for edge in drawing.edges] == [
        ("p0", "p1"), ("p1", "p2"), ("p2", "p3"), ("p3", "p4")
    ]  # fmt: skip
    assert plan_diagram(RunData(runs=runs)) is None


def test_transitions_between_steps_are_counted(tmp_path: Path) -> None:
    drawing = run_diagram(read_run_data(copied_run(tmp_path)))
    names = {node.id: node.lines[0].partition(".")[2] or node.lines[0] for node in drawing.nodes}
    assert {(names[e.source], names[e.target], e.label, e.dashed) for e in drawing.edges} == {
        ("make dumplings", "prepare", "", False),
        ("prepare", "prepare", "missed", True),
        ("prepare", "wrap", "laid_out", False),
        ("wrap", "recover", "spoilt", True),
        ("recover", "wrap", "aligned", False),
        ("wrap", "boil", "wrapped", False),
        ("boil", "goal reached", "cooked", False),
    }


def test_a_long_run_is_no_larger_than_a_short_one() -> None:
    runs: list[SkillExecution] = []
    for number in range(1000):
        before = runs[-1] if runs else None
        runs.append(SkillExecution("m.a", number, before, number + 1.0, "finished", "", "step", "ok", False))
    drawing = run_diagram(RunData(runs=runs))
    assert [edge.label for edge in drawing.edges] == ["", "ok ×999", "ok"]
    assert len(svg(drawing)) < 4000


def test_a_run_of_which_nothing_is_recorded_is_drawn_too() -> None:
    drawing = run_diagram(RunData())
    assert [node.lines for node in drawing.nodes] == [("began",), ("no end is recorded",)]
