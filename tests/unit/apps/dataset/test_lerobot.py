"""The layout: places of files, and statistics that are those of NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.apps.dataset import lerobot

_ROWS = [[0.0, -1.0], [2.0, 5.0], [3.0, 5.0], [11.0, 0.25], [-4.0, 8.0]]


def test_a_folder_has_a_thousand_files_at_most() -> None:
    assert lerobot.DATA_PATH.format(**lerobot.place_of(0)) == "data/chunk-000/file-000.parquet"
    assert lerobot.DATA_PATH.format(**lerobot.place_of(2999)) == "data/chunk-002/file-999.parquet"


def test_statistics_are_those_of_numpy() -> None:
    found = lerobot.statistics_of(_ROWS)
    array = np.array(_ROWS)
    assert found["count"] == [5]
    for name, of in (("min", np.min), ("max", np.max), ("mean", np.mean), ("std", np.std)):
        assert found[name] == pytest.approx(of(array, axis=0).tolist())
    for name, share in (("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)):
        assert found[name] == pytest.approx(np.quantile(array, share, axis=0).tolist())


def test_statistics_of_a_column_of_numbers_have_one_each() -> None:
    assert lerobot.statistics_of([False, True, True])["mean"] == [pytest.approx(2 / 3)]


def test_joined_statistics_of_videos_are_those_of_all_pictures() -> None:
    def of(pixels: list[float]) -> dict[str, object]:
        single = {name: one for name, one in lerobot.statistics_of(pixels).items() if name != "count"}
        return {**{name: [[[one[0]]]] * 3 for name, one in single.items()}, "count": [len(pixels)]}

    first, second = [0.0, 0.5, 0.25, 1.0], [0.75, 0.5]
    joined = lerobot.joined_statistics([of(first), of(second)])
    whole = of([*first, *second])
    assert joined["count"] == [6]
    for name in ("min", "max", "mean", "std"):
        assert np.array(joined[name]).shape == (3, 1, 1)
        assert np.array(joined[name]) == pytest.approx(np.array(whole[name]))


def test_tasks_keep_their_numbers() -> None:
    assert lerobot.numbered_tasks(["a", "b"], "a") == {"a": 0, "b": 1}
    assert lerobot.numbered_tasks(["a", "b"], "c") == {"a": 0, "b": 1, "c": 2}


def test_a_dataset_without_a_video_names_no_path_of_videos() -> None:
    features = lerobot.features_of(["x"], ["go"], None, 10)
    assert lerobot.info_of(features, "arm", 10, 1, 5, 1)["video_path"] is None
    assert features["observation.state"] == {"dtype": "float32", "shape": [1], "names": ["x"]}
