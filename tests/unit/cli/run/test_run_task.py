"""One run on the symbolic plant: its exit code, its summary, what it leaves, and a task that had ended."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.instructions.meaning import with_goal
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.task_graph import TaskGraph
from aeros.apps.goal import parse_goal
from aeros.apps.watchdog.resumable_run import save_run_options
from aeros.cli.latest_run import latest_run
from aeros.cli.run.run_task import RunRequest, run_task
from aeros.exit_codes import Exit
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import verify_log
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from tests.unit.cli.staged import options, proved, staged
from tests.unit.runtime.registry.support.fixed_modules import FixedModules

HOLDS = "not bench_clean"
"""A goal that holds where the task begins, so that no skill has to run."""


class Idle(RulePlanner):
    """A planner that proposes nothing."""

    def plan(self, *_: object) -> TaskGraph:
        return TaskGraph(())


class Interrupted(RulePlanner):
    """A planner at which somebody presses Ctrl-C."""

    def plan(self, *given: Any) -> TaskGraph:
        import signal

        signal.raise_signal(signal.SIGINT)
        return super().plan(*given)


def run(
    arguments: Namespace,
    planner: RulePlanner | None = None,
    goal: str | None = None,
    signing: SigningConfiguration | None = None,
) -> Exit:
    configuration, report = proved()
    goal_condition = None if goal is None else parse_goal(goal, configuration.site)
    governor = RegistryGovernor(
        Registry(arguments.state), FixedModules(configuration), resumed=arguments.resume
    )
    with governor:
        meaning = understand(arguments.instruction, configuration.modules)
        meaning = meaning if goal_condition is None else with_goal(meaning, goal_condition)
        asked = RunRequest(governor, report, planner or RulePlanner(), meaning, goal_condition, signing)
        return run_task(staged(arguments), asked)


def test_a_task_that_is_done_is_a_success_with_a_summary(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(options(tmp_path), goal=HOLDS) is Exit.SUCCESS
    message = capsys.readouterr().out
    assert "goal reached" in message
    assert "bench_clean = false" in message  # of the goal that replaces the task's
    records = verify_log(tmp_path / "out" / "audit.jsonl").records
    assert f"audit      {records} records, chain sound\n" in message
    assert "aeros why" not in message
    assert message.endswith(f"output     {tmp_path / 'out'}/: audit.jsonl, measured.jsonl, trace.jsonl\n")
    assert latest_run(tmp_path / "state") == (tmp_path / "out", True)


def test_a_goal_that_is_not_reached_is_a_rejection_that_says_where_to_ask(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(options(tmp_path), Idle()) is Exit.REJECTED
    message = capsys.readouterr().out
    assert "goal not reached: " in message
    assert f"why        aeros why {tmp_path / 'out'}\n" in message


def test_a_time_that_is_over_cancels_the_task(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(options(tmp_path, "--timeout", "0.01"), Idle()) is Exit.REJECTED
    assert "the time limit of 0.01 s has passed" in capsys.readouterr().out


def test_ctrl_c_stops_the_robot_and_is_the_exit_code(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(options(tmp_path), Interrupted()) is Exit.INTERRUPTED
    assert "stopping the robot" in capfd.readouterr().err
    assert verify_log(tmp_path / "out" / "audit.jsonl").is_sound


@pytest.fixture
def key(tmp_path: Path) -> Path:
    path = tmp_path / "key"
    make_key(path)
    return path


@pytest.mark.parametrize("is_anchored", [False, True])
def test_a_signed_log_says_so(
    key: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], *, is_anchored: bool
) -> None:
    signing = SigningConfiguration(read_signing_key(key), (tmp_path / "anchor",) if is_anchored else ())
    assert run(options(tmp_path), goal=HOLDS, signing=signing) is Exit.SUCCESS
    ending = "chain sound, signed and anchored" if is_anchored else "chain sound, signed"
    assert f" records, {ending}\n" in capsys.readouterr().out


def test_a_report_and_a_bag_are_named_with_the_outputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    assert (
        run(options(tmp_path, "--report", "--mcap", str(tmp_path / "run.mcap")), goal=HOLDS) is Exit.SUCCESS
    )
    message = capsys.readouterr().out
    assert f"mcap       {tmp_path / 'run.mcap'}\n" in message
    assert "report.html" in message.splitlines()[-1]


@pytest.mark.parametrize(
    ("is_clean", "code", "shown"),
    [
        (False, Exit.SUCCESS, "believed true, true in the simulator"),
        (True, Exit.REJECTED, "believed true, false in the simulator: bench_clean = true"),
    ],
)
def test_a_goal_that_is_believed_and_false_is_no_success(
    is_clean: bool,
    code: Exit,
    shown: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("aeros.cli.run.run_referee.truth_of", lambda _: {"bench_clean": is_clean})
    assert run(options(tmp_path), goal=HOLDS) is code
    assert f"truth      goal reached: {shown}" in capsys.readouterr().out
    log = (tmp_path / "out" / "audit.jsonl").read_text()
    (record,) = [line for line in log.splitlines() if "goal-judged" in line]
    assert '"believed":true' in record.replace(" ", "")


# Resumed.


@pytest.mark.parametrize("is_supervised", [False, True])
def test_a_task_that_had_ended_is_reported_again_and_not_done_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, is_supervised: bool
) -> None:
    run(options(tmp_path), goal=HOLDS)
    first = capsys.readouterr().out
    records = verify_log(tmp_path / "out" / "audit.jsonl").records
    again = options(tmp_path, "--resume", *(["--supervised"] if is_supervised else []))
    again.plant_at = tmp_path / "plant.sock"
    save_run_options(again)
    assert run(again, goal=HOLDS) is Exit.SUCCESS
    message = capsys.readouterr().out
    assert message.startswith("The task had already ended.\n")
    assert "goal reached" in first
    assert "goal reached" in message
    assert verify_log(tmp_path / "out" / "audit.jsonl").records == records
    # What is left to resume is for the supervisor to remove, where there is one.
    assert (tmp_path / "state" / "run.json").exists() is is_supervised


def test_the_end_in_another_log_is_not_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(options(tmp_path), goal=HOLDS)
    capsys.readouterr()
    again = options(tmp_path, "--resume", "--out", str(tmp_path / "other"))
    with pytest.raises(AgentError, match="cannot be resumed"):
        run(again, goal=HOLDS)
    assert "had already ended" not in capsys.readouterr().out
