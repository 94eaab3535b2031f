"""`aeros plan`, and the arguments of `aeros run` that go with it."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.registry.installed import InstalledModules
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.runtime.registry.stored_modules import policy_file
from aeros.spec.text.discovery import reference_site_path

ROOT = Path(__file__).parents[4]
ECMS = ["--ecms", str(ROOT / "ecms")]


def test_a_plan_says_what_is_done_where_outcomes_differ(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "make dumplings", *ECMS]) == Exit.SUCCESS
    assert capsys.readouterr().out.splitlines()[2:] == [
        "plan",
        "  make_dumplings.prepare, tried 4 times at most",
        "  if not make_dumplings.wrapper_aligned",
        "    make_dumplings.recover, tried 4 times at most",
        "  make_dumplings.wrap, tried 4 times at most, recover between tries",
        "  make_dumplings.boil, tried 4 times at most",
        "proved the goal can be reached from each of the 5 states that declared outcomes may lead to; "
        "the path has 3 steps",
        "time   77 s are expected, a failure counting as a minute; "
        "the risk that a step fails in all its tries is 0.00011",
    ]


def test_any_goal_may_be_planned_for_and_the_plan_be_had_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    goal = "object_grasped and not object_delivered"
    given = ["--goal", goal, "--initial", "robot_at_target=true", "--initial", "object_detected=true"]
    assert main(["plan", *given, *ECMS, "--format", "json"]) == Exit.SUCCESS
    shown = json.loads(capsys.readouterr().out)
    assert shown["schema"] == "aeros/plan/1"
    assert shown["goal"] == goal
    assert shown["start"]["fetch_object.object_detected"] is True
    assert [step["skill"] for step in shown["plan"]] == ["fetch_object.grasp"]
    assert shown["steps_at_least"] == 1
    assert shown["reason"] is None


def test_a_missing_plan_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    goal = ["--goal", "table_wiped and not estop_pressed"]
    assert main(["plan", *goal, "--initial", "estop_pressed=unknown", *ECMS]) == Exit.REJECTED
    assert "`estop_pressed` is not measured, and no skill sets it" in capsys.readouterr().out
    assert main(["plan", *goal, "--initial", "estop_pressed=true", *ECMS]) == Exit.REJECTED
    assert "`not estop_pressed`, which does not hold now, and no skill" in capsys.readouterr().out


def test_a_goal_that_holds_already_needs_no_plan(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "--goal", "not table_wiped", *ECMS]) == Exit.SUCCESS
    assert "plan   nothing to do: the goal holds" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], Exit.USAGE, "give an instruction or --goal"),
        (["--goal", "table_wipd"], Exit.REJECTED, "did you mean `table_wiped`?"),
        (["--goal", "tool_speed > 3 m"], Exit.REJECTED, "--goal:1:14"),
        (["fly away"], Exit.REJECTED, "no installed module provides"),
        (["clean the table", "--initial", "table_wipd=true"], Exit.USAGE, "did you mean `table_wiped`?"),
        (["clean the table", "--initial", "table_wiped=3 m"], Exit.REJECTED, "--initial table_wiped:1:1"),
    ],
)
def test_contradictory_options_are_refused(
    arguments: list[str], code: Exit, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", *arguments, *ECMS]) == code
    assert message in capsys.readouterr().err


def _run(folder: Path, *arguments: str) -> int:
    where = ["--state", str(folder / "state"), "--out", str(folder / "out"), "--plant", "symbolic"]
    return main(["run", "make dumplings", *ECMS, *where, *arguments])


def test_a_run_may_pursue_another_goal_than_the_tasks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--goal", "dumpling_wrapped and not dumpling_cooked") == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "goal       dumpling_wrapped and not dumpling_cooked\nmeasured   " in message
    assert "step make_dumplings.boil" not in message


def test_a_plan_may_lead_through_the_skills_of_several_modules(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--goal", "dumpling_cooked and table_wiped") == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "0 denied" in message
    for module in ("clean_table", "make_dumplings"):
        assert f"step {module}." in message


def test_no_plan_in_time_leaves_the_robot_where_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--planner", "smt", "--planning-timeout", "0.000001", "--timeout", "2"]
    assert _run(tmp_path, *arguments) == Exit.REJECTED
    message = capsys.readouterr().out
    assert "there was no plan within 1e-06 s; stands still" in message
    assert "steps      0 run" in message


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--goal", "dumpling_cooked", "--planner", "rules"], "--goal requires --planner smt"),
        (["--planning-timeout", "5"], "--planning-timeout requires --planner smt"),
        (["--composition", "any", "--planner", "smt"], "cannot be combined with --planner or --goal"),
    ],
)
def test_arguments_that_contradict_each_other_are_refused(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, *arguments) == Exit.USAGE
    assert message in capsys.readouterr().err


def test_the_page_on_planning_shows_what_is_answered(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "planning.md").read_text()
    shown = page.split("```console\n")[1].split("```")[0]
    answered = ""
    for line in shown.splitlines():
        if line.startswith("$ aeros "):
            main(shlex.split(line)[2:])
            answered += f"{line}\n{capsys.readouterr().out}"
    assert answered == shown


@pytest.mark.parametrize(
    ("plan", "code", "message"),
    [
        (
            "(make_dumplings.prepare)\n(make_dumplings.recover)\n(MAKE_DUMPLINGS.WRAP)\n(make_dumplings.boil)",
            Exit.SUCCESS,
            "accepted  4 steps",
        ),
        (
            "; laid askew?\n(make_dumplings.prepare)\n(make_dumplings.wrap)\n(make_dumplings.boil)\n",
            Exit.REJECTED,
            "rejected  step 2, `make_dumplings.wrap`: its precondition `robot_at_bench and",
        ),
        ("(make_dumplings.prepare)", Exit.REJECTED, "rejected  it ends, and the goal does not hold"),
        ("(make_dumplings.prepar)", Exit.REJECTED, "no such skill; did you mean `make_dumplings.prepare`?"),
        ("make_dumplings.prepare", Exit.USAGE, "line 1: expected a step in brackets"),
    ],
)
def test_a_plan_from_elsewhere_is_judged(
    plan: str, code: Exit, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.plan").write_text(plan)
    assert main(["plan", "check", str(tmp_path / "a.plan"), "make dumplings", *ECMS]) == code
    printed = capsys.readouterr()
    assert message in printed.out + printed.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["check", "no.plan", "make dumplings"], "the plan to check: no file or folder `no.plan`"),
        (["check", "ecms"], "give an instruction or --goal"),
        (["make", "dumplings"], 'an instruction is one argument: "make dumplings"'),
        (["make dumplings", "--every-step"], "--every-step requires `check FILE`"),
        (
            ["check", "ecms", "make dumplings", "--export-pddl", "out"],
            "`check` cannot be combined with --export-pddl",
        ),
    ],
)
def test_the_plan_to_check_must_be_named(
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["plan", *arguments]) == Exit.USAGE
    assert message in capsys.readouterr().err


def test_a_judgement_may_be_had_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.plan").write_text(
        "(clean_table.organize)\n(clean_table.wipe)\n(clean_table.organize)\n(clean_table.verify)"
    )
    arguments = ["check", str(tmp_path / "a.plan"), "clean the table", "--format", "json"]
    assert main(["plan", *arguments, *ECMS]) == Exit.SUCCESS
    assert json.loads(capsys.readouterr().out) == {
        "schema": "aeros/plan-check/1",
        "steps": ["clean_table.organize", "clean_table.wipe", "clean_table.organize", "clean_table.verify"],
        "accepted": True,
        "problems": [],
    }


def test_the_same_problem_may_be_had_in_pddl(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    unknown = ["--initial", "wrapper_aligned=unknown"]
    assert (
        main(["plan", "make dumplings", *unknown, *ECMS, "--export-pddl", str(tmp_path / "pddl")])
        == Exit.SUCCESS
    )
    domain = (tmp_path / "pddl" / "domain.pddl").read_text()
    assert "(:action make_dumplings-recover-aligned" in domain
    assert (
        ":effect (and (make_dumplings--wrapper_aligned) (not (unknown-make_dumplings--wrapper_aligned)))"
        in domain
    )
    assert (
        "(make_dumplings--wrappers_suffice) (unknown-make_dumplings--wrapper_aligned))"
        in (tmp_path / "pddl" / "problem.pddl").read_text()
    )
    (tmp_path / "file").write_text("")
    assert main(["plan", "make dumplings", *ECMS, "--export-pddl", str(tmp_path / "file")]) == Exit.REJECTED
    assert "cannot write to" in capsys.readouterr().err


@pytest.mark.parametrize("ways", [("--ecms", "ecms"), ("--site", "site.yaml"), ()])
def test_the_operators_word_holds_for_a_plan_with_modules_of_a_folder(
    ways: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "ecms" / "clean_table", "ecms/clean_table")
    shutil.copy(reference_site_path(), "site.yaml")
    block = OperatorBlock("wet", "wet floor", "clean_table", "wipe", None)
    monkeypatch.setattr(
        InstalledModules, "snapshot", lambda _: RegistrySnapshot(1, policy_file(_SITE), {}, {"wet": block})
    )
    monkeypatch.setattr(InstalledModules, "site_file", lambda *_: reference_site_path())
    assert main(["plan", "clean the table", *ways]) == Exit.REJECTED
    assert "`clean_table.wipe` is left out: the operator's block `wet` denies" in capsys.readouterr().out
    withdrawn = RegistrySnapshot(1, policy_file(_SITE), withdrawn=frozenset({"clean_table"}))
    monkeypatch.setattr(InstalledModules, "snapshot", lambda _: withdrawn)
    assert main(["plan", "clean the table", *ways]) == Exit.REJECTED
    assert "`clean_table` is no longer active on this robot" in capsys.readouterr().err


_SITE = reference_site_path().read_bytes()
