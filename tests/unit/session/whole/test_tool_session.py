"""A module that asks a tool, from its proof to its run: decided, counted, blocked and recorded."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.text.discovery import reference_site_path
from tests.host_layers import require_layers

MODULE = Path(__file__).parents[1] / "data" / "ask_and_wait"
ANSWER = "import json, sys; print(json.dumps({'cooking_time': 60 * json.load(sys.stdin)['mass']}))"
TOOL = """\
  cooking_time:
    {type: real, unit: s, range: [0, 600], sensor: ask_cookbook, max_age: 60 s, offers: [cooking_time]}

actions:
  ask_cookbook:
    description: ask how long a filling cooks
    risk: low
    parameters: {mass: {type: real, unit: kg, range: [0, 1]}, filling: {type: fillings}}
    tool: {program: PROGRAM, confinement: {reads: READS}, timeout: 20 s, answers: [cooking_time]}
"""
READS = json.dumps(sorted({sys.prefix, sys.base_prefix}))
"""Folders of this interpreter, which may be in somebody's home."""


def site(folder: Path, answer: str = ANSWER, **more: str) -> Path:
    """The reference site with a tool that runs this program."""
    text = reference_site_path().read_text()
    program = json.dumps([sys.executable, "-c", answer])
    edits = {
        "\nactions:\n": "\n" + TOOL.replace("PROGRAM", program).replace("READS", READS),
        "  body_regions: [": "  fillings: [pork, cabbage]\n  body_regions: [",
        "hand_camera, table_top_camera, aisle_top_camera]": "hand_camera, table_top_camera, ask_cookbook]",
        **more,
    }
    for old, new in edits.items():
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "site.yaml"
    path.write_text(text)
    return path


def run(folder: Path, site_file: Path, *commands: tuple[str, ...]) -> tuple[int, list[dict[str, Any]]]:
    """Install the module, give the commands, and run its task; return exit code and records."""
    state, out = folder / "robot", folder / "run"
    verbs = [("policy", str(site_file)), ("install", str(MODULE)), ("configure", "ask_and_wait")]
    for command in (*verbs, ("activate", "ask_and_wait"), *commands):
        assert main([*command, "--state", str(state)]) == Exit.SUCCESS
    plant = ("--plant", "kinematic", "--state", str(state), "--out", str(out))
    code = main(["run", "time the dumpling", *plant])
    return code, [json.loads(line) for line in (out / "audit.jsonl").read_text().splitlines()]


def details(records: list[dict[str, Any]], event: str) -> list[dict[str, Any]]:
    return [one["details"] for one in records if one["event"] == event]


def test_an_answer_is_decided_upon_and_recorded(tmp_path: Path) -> None:
    code, records = run(tmp_path, site(tmp_path))
    assert code == Exit.SUCCESS
    assert details(records, "tool-answered") == [
        {"tool": "ask_cookbook", "time": 0.0, "answer": {"cooking_time": 3.0}}
    ]
    kinds = [one["details"]["decided"]["kind"] for one in records if one["event"] == "decision"]
    assert kinds == ["ask_cookbook", "wait"]  # the second is bounded by the answer


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("print('{\"cooking_time\": 601}')", "outside 0 s to 600 s"),
        # tests/unit/runtime/tools/ has every reason, without a session
        pytest.param("print('{\"cooking_tim\": 6}')", "does not declare", marks=pytest.mark.deep),
        pytest.param("raise SystemExit(1)", "ended with code 1", marks=pytest.mark.deep),
    ],
)
def test_without_a_usable_answer_the_skill_knows_nothing(tmp_path: Path, answer: str, reason: str) -> None:
    code, records = run(tmp_path, site(tmp_path, answer))
    assert code == Exit.REJECTED
    failures = details(records, "tool-failed")
    assert failures
    assert {one["reason"] for one in failures if reason not in one["reason"]} == set()
    assert details(records, "tool-answered") == []


def test_a_program_sees_nothing_of_the_robot_that_calls_it(tmp_path: Path) -> None:
    require_layers("landlock")
    robot = tmp_path / "robot"
    _, records = run(tmp_path, site(tmp_path, f"import os; print(os.listdir({str(robot)!r}))"))
    reasons = {one["reason"] for one in details(records, "tool-failed")}
    denied = f"PermissionError: [Errno 13] Permission denied: '{robot}'"
    assert reasons == {f"it ended with code 1; its last line of errors: {denied}"}


def test_an_operators_block_ends_the_calls(tmp_path: Path) -> None:
    block = ("block", "--id", "closed", "--reason", "the kitchen is closed", "--action", "ask_cookbook")
    code, records = run(tmp_path, site(tmp_path), block)
    assert code == Exit.REJECTED
    assert details(records, "tool-answered") == details(records, "tool-failed") == []


def test_a_quota_counts_calls(tmp_path: Path) -> None:
    quota = "  quotas:\n    - {id: calls, on: [ask_cookbook], at_most: 1, within: 60 s, rationale: price}\n"
    _, records = run(tmp_path, site(tmp_path, "print('{}')", **{"  quotas:\n": quota}))
    first, second = (one["time"] for one in details(records, "tool-answered")[:2])
    assert second - first >= 60.0
