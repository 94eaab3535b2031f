"""Runs become episodes of a dataset, which readers that are not ours read."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT

_READ = Path(__file__).parent / "read_dataset.py"
_INTERPRETER = "AEROS_LEROBOT_PYTHON"


def _run(folder: Path, seed: int, *more: str, module: str = "make_dumplings") -> Exit:
    task = {"make_dumplings": "make dumplings", "clean_table": "clean the table"}[module]
    return Exit(
        main(
            ["run", task, "--ecms", str(ROOT / "ecms" / module), "--plant", "symbolic", "--gate", "compiled",
             "--seed", str(seed), "--state", str(folder / "state"), "--out", str(folder / f"run-{seed}"),
             "--dataset", str(folder / "dataset"), *more]
        )
    )  # fmt: skip


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def test_runs_become_episodes_in_the_published_layout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert [_run(tmp_path, seed) for seed in (0, 1)] == [Exit.SUCCESS] * 2
    folder = tmp_path / "dataset"
    shown = capsys.readouterr().out
    info = _json(folder / "meta" / "info.json")
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_tasks"], info["fps"]) == (2, 1, 10)
    assert info["splits"] == {"train": "0:2"}
    tables = [pq.read_table(folder / f"data/chunk-000/file-00{number}.parquet") for number in (0, 1)]
    assert info["total_frames"] == sum(len(table) for table in tables)
    assert f"episode 1 of {len(tables[1])} frames" in shown
    for number, table in enumerate(tables):
        assert set(table.column_names) == set(info["features"])
        for name, feature in info["features"].items():
            (length,) = feature["shape"]
            first = table[name][0].as_py()
            assert length == (len(first) if isinstance(first, list) else 1)
            assert feature["names"] is None or len(feature["names"]) == length
        count = len(table)
        assert table["frame_index"].to_pylist() == list(range(count))
        assert table["episode_index"].to_pylist() == [number] * count
        assert table["timestamp"].to_pylist() == pytest.approx([place / 10 for place in range(count)])
        assert table["next.done"].to_pylist() == [False] * (count - 1) + [True]
        assert table["next.reward"].to_pylist() == [0.0] * (count - 1) + [1.0]
        episode = pq.read_table(folder / f"meta/episodes/chunk-000/file-00{number}.parquet").to_pylist()[0]
        assert episode["tasks"] == ["make dumplings"]
        assert episode["dataset_to_index"] - episode["dataset_from_index"] == episode["length"] == count
        assert episode["data/file_index"] == number
    joined = [row for table in tables for row in table["index"].to_pylist()]
    assert joined == list(range(info["total_frames"]))
    stats = _json(folder / "meta" / "stats.json")
    assert stats["index"]["max"] == [info["total_frames"] - 1]
    assert len(stats["observation.state"]["mean"]) == len(info["features"]["observation.state"]["names"])
    about = _json(folder / "meta" / "aeros" / "episode-000001.json")
    assert (about["seed"], about["plant"], about["drawn"]) == (1, "symbolic", {})
    log = (tmp_path / "run-1" / "audit.jsonl").read_text(encoding="utf-8").splitlines()
    assert about["audit_head"] == json.loads(log[-1])["hash"]


@pytest.mark.deep
def test_states_and_actions_are_those_of_the_run(tmp_path: Path) -> None:
    assert _run(tmp_path, 0) is Exit.SUCCESS
    folder = tmp_path / "dataset"
    features = _json(folder / "meta" / "info.json")["features"]
    table = pq.read_table(folder / "data/chunk-000/file-000.parquet")
    states, actions = features["observation.state"]["names"], features["action"]["names"]
    assert "tool_position.x" in states
    assert not [name for name in states if name.startswith("clean_table.")]
    cooked = [
        row[states.index("make_dumplings.dumplings_cooked")] for row in table["observation.state"].to_pylist()
    ]
    assert (cooked[0], cooked[-1]) == (0.0, 1.0)
    known = table["observation.known"].to_pylist()
    assert known[0][states.index("tool_position.x")] == 1.0
    assert known[0][states.index("make_dumplings.push_start.x")] == 0.0
    records = [
        json.loads(line)
        for line in (tmp_path / "run-0" / "audit.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    decided = [one["details"] for one in records if one["event"] == "decision"]
    for frame, row in enumerate(table["action"].to_pylist()):
        due = [one["decided"] for one in decided if one["time"] <= frame / 10 + 1e-9]
        kinds = {name for name in actions if "." not in name and row[actions.index(name)] == 1.0}
        assert kinds == ({due[-1]["kind"]} if due else set())
        if due and due[-1]["kind"] == "move_tool":
            found = [row[actions.index(f"move_tool.target.{axis}")] for axis in "xyz"]
            assert found == pytest.approx(due[-1]["parameters"]["target"], abs=1e-6)


def test_a_folder_with_something_else_is_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dataset").mkdir()
    (tmp_path / "dataset" / "notes.txt").write_text("mine")
    assert _run(tmp_path, 0) is Exit.REJECTED
    assert "is not empty and has no meta/info.json" in capsys.readouterr().err
    assert not (tmp_path / "run-0").exists()


def test_a_watched_run_has_no_dataset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(tmp_path, 0, "--watchdog") is Exit.USAGE
    assert "--dataset and --randomise cannot be combined with --watchdog" in capsys.readouterr().err


@pytest.mark.deep
@pytest.mark.physics
def test_other_readers_read_states_and_video(tmp_path: Path) -> None:
    """Hugging Face's `datasets`, pandas and PyAV in an environment of their own, or LeRobot itself.

    LeRobot needs 3 GB of PyTorch, so it reads only where AEROS_LEROBOT_PYTHON names an interpreter with it.
    """
    assert _run(tmp_path, 0, "--plant", "mujoco", module="clean_table") is Exit.SUCCESS
    interpreter = os.environ.get(_INTERPRETER)
    if interpreter is None:
        subprocess.run(["python3", "-m", "venv", tmp_path / "venv"], check=True)
        interpreter = str(tmp_path / "venv" / "bin" / "python")
        packages = ["datasets>=4,<5", "pandas", "av"]
        subprocess.run([interpreter, "-m", "pip", "install", "-q", *packages], check=True, timeout=900)
    answer = subprocess.run(
        [interpreter, _READ, tmp_path / "dataset"],
        check=True,
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "cache")},
    )
    info = _json(tmp_path / "dataset" / "meta" / "info.json")
    found = json.loads(answer.stdout.splitlines()[-1])
    assert found["frames"] == info["total_frames"]
    assert found["task"] == "clean the table"
    assert found["picture"] == [3, 240, 320]
    assert found["state"] == len(info["features"]["observation.state"]["names"])
    assert found["last_reward"] == 1.0
    assert (found["reader"] == "lerobot") == (_INTERPRETER in os.environ)
