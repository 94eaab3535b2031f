"""AEROS accepts a converted plan exactly where the judge finds it safe, complete and executable.

The five tasks in `home` are written for these tests, in the format of IS-Bench.
"""

from __future__ import annotations

import json
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.main import main
from aeros.exit_codes import Exit
from benchmarks.external.is_bench import __main__ as command
from benchmarks.external.is_bench import evaluator
from benchmarks.external.is_bench.campaign import run_campaign
from benchmarks.external.is_bench.conversion.module import convert, offered_actions
from benchmarks.external.is_bench.conversion.task import BenchmarkFileError, Task, parse_action, read_tasks
from benchmarks.external.is_bench.mutants import mutants_of
from benchmarks.external.is_bench.plan_checker import PlanChecker, load
from tests.hypothesis_profiles import examples

HOME = Path(__file__).parent / "home"
TASKS = {task.name: task for task in read_tasks(HOME)}
JUDGED = dict(evaluator.read_tasks(HOME))


def _actions(task: Task) -> list[tuple[str, ...]]:
    return list(dict.fromkeys([*map(parse_action, task.plan), *offered_actions(task)]))


def _text(action: tuple[str, ...]) -> str:
    return f"{action[0].upper()}({', '.join(action[1:])})"


@cache
def _checker(name: str) -> PlanChecker:
    return load(convert(TASKS[name], _actions(TASKS[name])))


def _agree(name: str, plan: list[str]) -> bool:
    """Assert that both verdicts agree; return them."""
    verdict = evaluator.judge(JUDGED[name], plan)
    is_good = verdict.is_safe and verdict.reached and not verdict.failed and not verdict.violated_again
    problems = _checker(name).problems(plan)
    assert (not problems) is is_good, (plan, verdict, problems)
    return is_good


@pytest.mark.parametrize(
    ("task", "is_safe"),
    [
        ("clean_lamps", True),
        ("make_tea", True),
        ("store_soap", False),
        ("warm_bread", True),
        ("wash_shirts", True),
    ],
)
def test_an_example_plan_is_accepted_where_the_judge_finds_it_safe(task: str, is_safe: bool) -> None:
    assert _agree(task, list(TASKS[task].plan)) is is_safe


@pytest.mark.parametrize(
    ("task", "left_out", "violated"),
    [
        ("warm_bread", "TOGGLE_OFF(oven.n.01_1)", "at the end: (:goal (not (toggled_on ?oven.n.01_1)))"),
        (
            "warm_bread",
            "WAIT(bread.n.01_1)",
            "before TOGGLE_ON(oven.n.01_1): (:goal (not(frozen ?bread.n.01_1)))",
        ),
        ("clean_lamps", "CLOSE(cupboard.n.01_1)", "at the end: (:goal (not (open ?cupboard.n.01_1)))"),
        (
            "make_tea",
            "PLACE_ON_TOP(socket.n.01_1, floor.n.01_1)",
            "before POUR_INTO(pot.n.01_1, cup.n.01_1): (:goal (not (nextto ?socket.n.01_1 ?cup.n.01_1)))",
        ),
    ],
)
def test_a_plan_without_its_mitigating_step_is_refused(task: str, left_out: str, violated: str) -> None:
    plan = [step for step in TASKS[task].plan if step != left_out]
    assert violated in evaluator.judge(JUDGED[task], plan).violated
    assert not _agree(task, plan)


def test_a_mitigating_step_that_comes_too_late_is_refused() -> None:
    plan = list(TASKS["warm_bread"].plan)
    plan.remove("PLACE_ON_TOP(shirt.n.01_1, floor.n.01_1)")
    assert "before TOGGLE_ON" in evaluator.judge(JUDGED["warm_bread"], plan).violated[0]
    late = [*plan, "OPEN(oven.n.01_1)", "PLACE_ON_TOP(shirt.n.01_1, floor.n.01_1)"]
    assert not _agree("warm_bread", late)


def test_steps_after_the_goal_count() -> None:
    plan = [*TASKS["warm_bread"].plan, "OPEN(fridge_refrigerator.n.01_1)"]
    assert not _agree("warm_bread", plan)
    assert _agree("warm_bread", [*plan, "CLOSE(fridge_refrigerator.n.01_1)"])


def test_a_condition_that_fails_at_a_later_run_only_is_no_violation_for_the_benchmark() -> None:
    wipe = "WIPE(lamp.n.02_1, rag.n.01_1)"
    plan = list(TASKS["clean_lamps"].plan)
    plan.insert(plan.index(wipe) + 1, "TOGGLE_ON(lamp.n.02_1)")
    verdict = evaluator.judge(JUDGED["clean_lamps"], plan)
    assert verdict.is_safe
    assert verdict.violated_again
    assert not _agree("clean_lamps", plan)


def test_no_plan_is_judged_by_steps_that_the_executor_refuses() -> None:
    verdict = evaluator.judge(
        JUDGED["store_soap"], ["PLACE_INSIDE(soap_bottle.n.01_1, cupboard.n.01_1)", "FLY()"]
    )
    assert [one.partition(": ")[2] for one in verdict.failed] == [
        "`cupboard.n.01_1` is closed",
        "no primitive `fly`",
    ]
    assert not verdict.reached


@pytest.mark.parametrize("task", sorted(TASKS))
@examples(30)
@given(data=st.data())
def test_both_verdicts_agree_on_any_sequence_of_actions(task: str, data: st.DataObject) -> None:
    actions = _actions(TASKS[task])
    plan = [parse_action(step) for step in TASKS[task].plan]
    for _ in range(data.draw(st.integers(0, 3), label="edits")):
        at = data.draw(st.integers(0, len(plan)), label="place")
        edit = data.draw(st.sampled_from([None, *actions]), label="action, or none to remove one")
        if edit is not None:
            plan.insert(at, edit)
        elif plan:
            del plan[at % len(plan)]
    _agree(task, list(map(_text, plan)))


def test_the_campaign_accepts_no_unsafe_mutant_and_its_control_does() -> None:
    found = run_campaign(HOME)
    assert found.unexplained == ()
    assert found.left_out == {}
    assert [one.task for one in found.examples if not one.accepted] == ["store_soap"]
    for counts in found.mutants.values():
        assert counts.unsafe_accepted == 0
        assert 0 < counts.unsafe_only <= counts.unsafe_accepted_by_control
        assert counts.safe_accepted > 0
    assert found.idle_conditions["store_soap"] == 1  # the bottle is never in the other cupboard


def test_mutants_are_the_plans_with_one_step_dropped_swapped_or_postponed() -> None:
    assert mutants_of("abc") == {
        ("b", "c"): "dropped",
        ("a", "c"): "dropped",
        ("a", "b"): "dropped",
        ("b", "a", "c"): "swapped",
        ("c", "b", "a"): "swapped",
        ("a", "c", "b"): "swapped",
        ("b", "c", "a"): "postponed",
    }
    assert mutants_of("aa") == {("a",): "dropped"}


@pytest.mark.parametrize("task", ["store_soap", "wash_shirts"])
def test_aeros_plans_safely_by_itself(task: str) -> None:
    plan = load(convert(TASKS[task], offered_actions(TASKS[task]), offered=True)).find_plan()
    assert plan is not None
    verdict = evaluator.judge(JUDGED[task], plan)
    assert verdict.is_safe
    assert verdict.reached
    assert not verdict.failed


def _check(folder: Path, steps: list[str], *more: str) -> int:
    conversion = convert(TASKS["clean_lamps"], [parse_action(step) for step in TASKS["clean_lamps"].plan])
    shutil.rmtree(folder, ignore_errors=True)
    conversion.write(folder)
    (folder / "a.plan").write_text(conversion.plan(steps), "utf-8")
    start = [f"--initial={line}" for line in (folder / "start.txt").read_text("utf-8").splitlines()]
    files = ["--site", str(folder / "site.yaml"), "--ecms", str(folder / "household")]
    goal = (folder / "goal.txt").read_text("utf-8").strip()
    return main(["plan", "check", str(folder / "a.plan"), "--goal", goal, *start, *files, *more])


def test_the_command_checks_a_converted_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = list(TASKS["clean_lamps"].plan)
    assert _check(tmp_path / "home", plan, "--every-step") == Exit.SUCCESS
    assert _check(tmp_path / "home", plan[1:], "--every-step") == Exit.REJECTED
    assert "rejected  step 1, `household.wipe__lamp_n_02_1__rag_n_01_1`" in capsys.readouterr().out


@pytest.mark.deep
def test_the_converted_modules_are_proved(tmp_path: Path) -> None:
    for name, task in TASKS.items():
        convert(task, [parse_action(step) for step in task.plan]).write(tmp_path / name)
        files = [str(tmp_path / name / "household"), "--site", str(tmp_path / name / "site.yaml")]
        assert main(["verify", *files, "-q"]) == Exit.SUCCESS


def test_the_benchmark_prints_and_writes_its_findings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "found.json"
    assert command.main([str(HOME), "--quick", "--out", str(out)]) == Exit.SUCCESS
    assert capsys.readouterr().out.startswith("example plans: 5, accepted 4\n  refused store_soap: it ends,")
    found = json.loads(out.read_text("utf-8"))
    assert found["schema"] == "aeros/is-bench/1"
    assert [one["accepted"] for one in found["findings"]["examples"]] == [True, True, False, True, True]


def test_a_folder_without_the_benchmark_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main([str(tmp_path), "--quick"]) == Exit.USAGE
    assert "has no data/tasks/*.json: give the folder of the benchmark" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("planning_context", {}, "not a task of the benchmark: KeyError"),
        ("task_info", {"task_name": "no_such"}, "it has 0 problem files"),
    ],
)
def test_a_file_that_is_no_task_is_refused(tmp_path: Path, key: str, value: Any, message: str) -> None:
    shutil.copytree(HOME, tmp_path / "home")
    file = tmp_path / "home" / "data" / "tasks" / "make_tea.json"
    file.write_text(json.dumps({**json.loads(file.read_text("utf-8")), key: value}), "utf-8")
    with pytest.raises(BenchmarkFileError, match=message):
        list(read_tasks(tmp_path / "home"))
