"""A dataset takes episodes of the same columns, and refuses folders with something else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.world.world import WorldModel
from aeros.apps.dataset import dataset as dataset_module
from aeros.apps.dataset.dataset import DatasetError, DatasetWriter, Episode
from aeros.apps.dataset.parquet import read_columns
from aeros.apps.dataset.recorder import EpisodeFrame
from aeros.runtime.gate.configuration import Configuration
from tests.unit.cli.staged import proved


@pytest.fixture
def configuration() -> Configuration:
    return proved()[0]


def _episode(*known: Mapping[str, Any], task: str = "clean it", is_success: bool = True) -> Episode:
    frames = [
        EpisodeFrame(place / 10, WorldModel(place / 10, one, {}, {})) for place, one in enumerate(known)
    ]
    return Episode(frames, (), task, is_success, {"seed": 1})


def _writer(folder: Path, configuration: Configuration) -> DatasetWriter:
    return DatasetWriter(folder, configuration, ["tidy"], has_video=False)


def _columns(folder: Path, number: int) -> dict[str, list[Any]]:
    return read_columns((folder / f"data/chunk-000/file-{number:03d}.parquet").read_bytes())


def test_episodes_of_several_tasks_share_the_files_of_the_dataset(
    tmp_path: Path, configuration: Configuration
) -> None:
    folder = tmp_path / "new"
    _writer(folder, configuration).add(_episode({"bench_clean": False}, {"bench_clean": True}), tmp_path)
    writer = _writer(folder, configuration)
    assert writer.episodes == 1
    writer.add(_episode({}, task="rest", is_success=False), tmp_path)
    first, second = _columns(folder, 0), _columns(folder, 1)
    assert (first["task_index"], first["index"], first["episode_index"]) == ([0, 0], [0, 1], [0, 0])
    assert (second["task_index"], second["index"], second["episode_index"]) == ([1], [2], [1])
    assert (first["next.success"], second["next.success"]) == ([False, True], [False])
    assert second["next.done"] == [True]
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 3, 2)
    place = info["features"]["observation.state"]["names"].index("bench_clean")
    stats = json.loads((folder / "meta/stats.json").read_text())
    assert stats["observation.state"]["mean"][place] == pytest.approx(1 / 3)
    assert stats["observation.known"]["mean"][place] == pytest.approx(2 / 3)


def test_a_frame_before_any_decision_has_no_action(tmp_path: Path, configuration: Configuration) -> None:
    folder = tmp_path / "new"
    _writer(folder, configuration).add(_episode({}), tmp_path)
    names = json.loads((folder / "meta/info.json").read_text())["features"]["action"]["names"]
    (row,) = _columns(folder, 0)["action"]
    assert {name for name, value in zip(names, row, strict=True) if value and "." not in name} == set()


def test_an_episode_without_frames_is_refused(tmp_path: Path, configuration: Configuration) -> None:
    with pytest.raises(DatasetError, match="measured nothing"):
        _writer(tmp_path / "new", configuration).add(_episode(), tmp_path)
    assert not (tmp_path / "new").exists()


def test_other_folders_are_refused(tmp_path: Path, configuration: Configuration) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"is not empty and has no meta/info\.json"):
        _writer(tmp_path, configuration)
    folder = tmp_path / "new"
    _writer(folder, configuration).add(_episode({}), tmp_path)
    state = dict(list(configuration.site.state.items())[1:])
    with pytest.raises(DatasetError, match="has other columns"):
        _writer(folder, replace(configuration, site=replace(configuration.site, state=state)))
    info = folder / "meta" / "info.json"
    info.write_text(info.read_text().replace("v3.0", "v2.1"))
    with pytest.raises(DatasetError, match=r"is not of a dataset of version v3\.0"):
        _writer(folder, configuration)
    info.write_text("{")
    with pytest.raises(DatasetError, match="is damaged"):
        _writer(folder, configuration)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, configuration: Configuration) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(DatasetError, match="cannot write the dataset"):
        _writer(file / "inside", configuration).add(_episode({}), tmp_path)


def test_a_missing_package_is_named(
    tmp_path: Path, configuration: Configuration, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr("aeros.apps.dataset.parquet", raising=False)
    monkeypatch.setitem(__import__("sys").modules, "aeros.apps.dataset.parquet", None)
    with pytest.raises(DatasetError, match=r"pip install '\.\[dataset\]'` in the clone"):
        _writer(tmp_path / "new", configuration)


def test_a_video_needs_a_recording(tmp_path: Path, configuration: Configuration) -> None:
    writer = DatasetWriter(tmp_path / "new", configuration, ["tidy"], has_video=True)
    with pytest.raises(DatasetError, match="poses"):
        writer.add(_episode({}), tmp_path)
    assert not (tmp_path / "new" / "meta" / "info.json").exists()
    assert dataset_module.SIZE == (320, 240)
