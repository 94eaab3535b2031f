from __future__ import annotations

import json
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.identity import Identity, lock_folder
from aeros.agent.memory.sightings import Sighting
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.cli.main import main

CONTEXT = json.dumps({"task": "cook.cook", "code": "0123456789abcdef", "predicates": {"lid_on": True}})


@pytest.fixture
def state(tmp_path: Path) -> Path:
    with open_memory(tmp_path / MEMORY_FILE, Identity(uuid4(), "chef", "", 1)) as memory:
        for failed, reason, seconds in (
            (False, "", 4.0),
            (False, "", 6.0),
            (True, "outcome `not_sealed`", 5.0),
            (True, "100% of it\x1b[2J spilt", 5.0),
        ):
            inputs, seen = {"force": 0.5}, {"lid_on": True}
            beginning = EpisodeStart("cook.cook", "cook", "boil", "step", inputs, 1.0, seen, CONTEXT)
            outcome = None if failed else "cooked"
            ending = EpisodeEnd(
                "finished", outcome, failed, reason, 1.0 + seconds, seen, counts_toward_record=True
            )
            memory.end_episode(memory.start_episode(beginning), ending)
        memory.start_episode(EpisodeStart("cook.cook", "cook", "steam", "retry", {}, 9.0, {}, CONTEXT))
        memory.set_fact(
            "last run of cook.cook",
            {
                "reached": False,
                "steps": 0,
                "reason": None,
                "measured": {"holding": True, "wiped_fraction": 0.0},
            },
            "session 1",
        )
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = main(["memory", *arguments])
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_show_sums_up_each_skill(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "show", "--state", str(state))
    lines = out.splitlines()
    assert code == 0
    assert lines[:5] == [
        "cook.boil: 2 of 4 succeeded, next 50%",
        "  successes take 5.0 s (half in 4.5 to 5.5 s)",
        "  2 of 4 succeeded, next 50% in cook.cook, by code 0123456789ab, lid_on = true",
        "  failed 1 time: 100% of it\\x1b[2J spilt",
        "  failed 1 time: outcome `not_sealed`",
    ]
    assert lines[5] == "cook.steam: 0 of 0 succeeded, next 50%"
    assert lines[6] == (
        "last run of cook.cook (session 1): measured: holding = true, wiped_fraction = 0, reached: false"
    )
    assert lines[7].startswith("session 1: began ")
    assert lines[7].endswith(", 5 steps")


def test_show_as_json_can_be_of_one_skill(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("show", "--skill", "cook.boil", "--format", "json", "--state", str(state))
    code, out, _ = run(capsys, *asked)
    data = json.loads(out)
    (skill,) = data["skills"]
    assert (code, data["schema"], data["facts"]) == (0, "aeros/memory/1", [])
    assert (skill["successes"], skill["failures"], skill["expected"]) == (2, 2, 0.5)
    assert skill["usual"] == {"median": 5.0, "low": 4.5, "high": 5.5, "successes": 2}
    assert skill["contexts"][0]["context"] == json.loads(CONTEXT)


def test_a_skill_that_nobody_tried_is_reported_as_unknown(
    state: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = run(capsys, "show", "--skill", "cook.fry", "--state", str(state))
    assert (code, err) == (1, "aeros: there is no memory of `cook.fry`\n")


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ((), [5, 4, 3, 2, 1]),
        (("SEALED",), [3]),
        (("%",), [4]),
        (("_",), [3]),
        (("force",), [4, 3, 2, 1]),
        (("!",), []),
        (("'; DROP TABLE episodes; --",), []),
        (("--skill", "cook.steam"), [5]),
        (("--outcome", "cooked"), [2, 1]),
        (("--failed",), [4, 3]),
        (("--failed", "sealed", "--skill", "cook.steam"), []),
        (("--task", "cook.cook", "--limit", "2"), [5, 4]),
        (("--session", "2"), []),
    ],
)
def test_search_finds_steps_newest_first(
    state: Path, capsys: pytest.CaptureFixture[str], asked: tuple[str, ...], found: list[int]
) -> None:
    code, out, _ = run(capsys, "search", *asked, "--format", "json", "--state", str(state))
    assert code == 0
    assert [one["id"] for one in json.loads(out)["episodes"]] == found


def test_search_prints_a_step_in_one_line(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "search", "--limit", "3", "--state", str(state))
    assert out.splitlines() == [
        "5 (session 1, cook.cook) retry cook.steam: end unknown",
        "4 (session 1, cook.cook, 5.0 s) step cook.boil: 100% of it\\x1b[2J spilt",
        "3 (session 1, cook.cook, 5.0 s) step cook.boil: outcome `not_sealed`",
    ]
    assert run(capsys, "search", "dragons", "--state", str(state))[1] == "no matching episodes\n"


def test_export_is_everything_a_line_each(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "export", "--state", str(state))
    rows = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    assert [row["row"] for row in rows] == ["session", *["episode"] * 5, "fact"]
    assert rows[1]["before"] == {"lid_on": True}
    assert rows[1]["context"] == json.loads(CONTEXT)
    assert rows[4]["reason"] == "100% of it\x1b[2J spilt"


def test_memory_can_be_read_while_the_agent_is_awake(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with lock_folder(state), open_memory(state / MEMORY_FILE, Identity(uuid4(), "chef", "", 2)):
        assert run(capsys, "show", "--state", str(state))[0] == 0
        code, _, err = run(capsys, "forget", "--session", "1", "--yes", "--state", str(state))
    assert code == 1
    assert "this robot has an agent already: pid" in err


def test_nothing_is_forgotten_without_a_yes(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "forget", "--skill", "cook.boil", "--state", str(state))
    assert (code, err) == (2, "aeros: `cook.boil` would be deleted permanently; add --yes to confirm\n")
    assert "cook.boil: 2 of 4" in run(capsys, "show", "--state", str(state))[1]


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (("--skill", "cook.boil"), "deleted `cook.boil`: 0 sessions, 4 episodes, 0 events, 0 facts"),
        (("--session", "1"), "deleted session 1: 1 sessions, 5 episodes, 0 events, 1 facts"),
        (("--older-than", "1"), "UTC: 0 sessions, 0 episodes, 0 events, 0 facts"),
    ],
)
def test_deleted_records_are_counted(
    state: Path, capsys: pytest.CaptureFixture[str], asked: tuple[str, ...], message: str
) -> None:
    code, out, _ = run(capsys, "forget", *asked, "--yes", "--state", str(state))
    assert (code, message in out) == (0, True)


@pytest.mark.parametrize("action", ["show", "search", "export"])
def test_a_folder_without_a_memory_is_refused_and_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], action: str
) -> None:
    code, _, err = run(capsys, action, "--state", str(tmp_path))
    assert code == 1
    assert err.startswith("aeros: nothing is remembered here: there is no ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "wrong", [("show", "--skill", "boil"), ("search", "--limit", "0"), ("forget", "--yes"), ("dream",)]
)
def test_wrong_usage_is_reported(capsys: pytest.CaptureFixture[str], wrong: tuple[str, ...]) -> None:
    with pytest.raises(SystemExit) as stopped:
        run(capsys, *wrong)
    assert stopped.value.code == 2


def test_a_damaged_memory_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / MEMORY_FILE).write_bytes(b"\x00garbage" * 1000)
    code, _, err = run(capsys, "show", "--state", str(tmp_path))
    assert code == 1
    assert "damaged" in err


def test_the_sightings_of_a_variable_can_be_forgotten(
    state: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("forget", "--variable", "cup_position", "--state", str(state))
    code, _, err = run(capsys, *asked)
    assert (code, err) == (2, "aeros: `cup_position` would be deleted permanently; add --yes to confirm\n")
    with open_memory(state / MEMORY_FILE, Identity(uuid4(), "chef", "", 2)) as memory:
        memory.note_sightings([Sighting("cup_position", [0.1, 0.2, 0.3], 1.0, None, None)])
    code, out, _ = run(capsys, *asked, "--yes")
    assert code == 0
    assert out == "deleted `cup_position`: 0 sessions, 0 episodes, 0 events, 0 facts, 1 sightings, 0 values\n"


@pytest.mark.parametrize(
    ("asked", "unknown"),
    [
        (("--variable", "cup_positon"), "`cup_positon`"),
        (("--skill", "cook.bol"), "`cook.bol`"),
        (("--session", "9"), "session 9"),
    ],
)
def test_to_forget_what_is_not_remembered_is_refused(
    state: Path, capsys: pytest.CaptureFixture[str], asked: tuple[str, str], unknown: str
) -> None:
    code, out, err = run(capsys, "forget", *asked, "--yes", "--state", str(state))
    assert (code, out) == (1, "")
    assert err == f"aeros: nothing is remembered of {unknown}, so nothing was deleted\n"


def test_show_has_the_record_of_each_set_of_inputs_and_what_prevented_a_skill(
    state: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cause = {"kind": "rule", "rule": "separation", "text": ""}
    with open_memory(state / MEMORY_FILE, Identity(uuid4(), "chef", "", 2)) as memory:
        begun = EpisodeStart("cook.cook", "cook", "boil", "step", {"force": 2.0}, 1.0, {}, CONTEXT)
        ending = EpisodeEnd("denied", None, True, "near", 2.0, {}, counts_toward_record=True, causes=[cause])
        memory.end_episode(memory.start_episode(begun), ending)
    _, out, _ = run(capsys, "show", "--skill", "cook.boil", "--state", str(state))
    assert (
        "  2 of 4 succeeded, next 50% with force = 0.5\n  0 of 1 succeeded, next 33% with force = 2\n" in out
    )
    assert "  prevented 1 time by rule `separation`\n" in out
