"""Layout of a LeRobot dataset, version 3.0: names of files, features, and the metadata in JSON.

Source: huggingface/lerobot 0.4.4, `datasets/utils.py` and `datasets/lerobot_dataset.py`.  Version 3.0 is what
its present readers read; they refuse 2.1.  Each episode is in files of its own, which the format allows, so
that an episode that is added changes no file of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import sqrt
from typing import Any, Final

VERSION: Final = "v3.0"
"""Version of the layout, as `meta/info.json` has it."""

CHUNK: Final = 1000
"""Files in a folder at most."""

DATA_PATH: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH: Final = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH: Final = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
INFO: Final = "meta/info.json"
STATS: Final = "meta/stats.json"
TASKS: Final = "meta/tasks.parquet"

STATE: Final = "observation.state"
KNOWN: Final = "observation.known"
ACTION: Final = "action"
VIDEO: Final = "observation.images.cell"
"""Key of the video: the cell as films show it, not as a camera of the robot sees it."""

_QUANTILES: Final = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

_INDICES: Final = ("frame_index", "episode_index", "index", "task_index")


def place_of(episode: int) -> dict[str, int]:
    """Return the place of an episode's files, as fields of the path templates.

    Args:
        episode: its number, from 0.

    Returns:
        `chunk_index` and `file_index`.
    """
    return {"chunk_index": episode // CHUNK, "file_index": episode % CHUNK}


def features_of(
    state: Sequence[str], action: Sequence[str], size: tuple[int, int] | None, rate: int
) -> dict[str, dict[str, Any]]:
    """Describe the columns of a dataset.

    Args:
        state: names of the numbers of the state.
        action: names of the numbers of an action.
        size: width and height of the video, pixels; None for no video.
        rate: frames per second.

    Returns:
        The `features` of `meta/info.json`.
    """

    def column(dtype: str, length: int, names: Sequence[str] | None = None) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [length], "names": None if names is None else list(names)}

    found = {
        STATE: column("float32", len(state), state),
        KNOWN: column("float32", len(state), state),
        ACTION: column("float32", len(action), action),
        "next.reward": column("float32", 1),
        "next.done": column("bool", 1),
        "next.success": column("bool", 1),
        "timestamp": column("float32", 1),
        **{name: column("int64", 1) for name in _INDICES},
    }
    if size is not None:
        width, height = size
        found[VIDEO] = {
            "dtype": "video",
            "shape": [height, width, 3],
            "names": ["height", "width", "channels"],
            "info": {
                "video.height": height,
                "video.width": width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": rate,
                "video.channels": 3,
                "has_audio": False,
            },
        }
    return found


def info_of(
    features: Mapping[str, Any], robot: str, rate: int, episodes: int, frames: int, tasks: int
) -> dict[str, Any]:
    """Build `meta/info.json`.

    Args:
        features: the columns.
        robot: name of the robot.
        rate: frames per second.
        episodes: number of episodes.
        frames: number of frames of all episodes.
        tasks: number of different tasks.

    Returns:
        Values for JSON.
    """
    return {
        "codebase_version": VERSION,
        "robot_type": robot,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "chunks_size": CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": rate,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if VIDEO in features else None,
        "features": dict(features),
    }


def statistics_of(column: Sequence[Any]) -> dict[str, list[float]]:
    """Compute the statistics of a column.

    Args:
        column: its values: numbers, or rows of equal length.

    Returns:
        `min`, `max`, `mean`, `std` (of the population) and quantiles of each number of a row, and `count`.
    """
    rows = [list(map(float, one)) if isinstance(one, list | tuple) else [float(one)] for one in column]
    numbers = [sorted(values) for values in zip(*rows, strict=True)]
    count = len(rows)
    means = [sum(values) / count for values in numbers]
    spread = [
        sqrt(sum((value - mean) ** 2 for value in values) / count)
        for values, mean in zip(numbers, means, strict=True)
    ]
    return {
        "min": [values[0] for values in numbers],
        "max": [values[-1] for values in numbers],
        "mean": means,
        "std": spread,
        "count": [count],
        **{name: [_quantile(values, share) for values in numbers] for name, share in _QUANTILES.items()},
    }


def _quantile(ordered: Sequence[float], share: float) -> float:
    """Interpolate linearly between the two nearest of ordered values."""
    place = share * (len(ordered) - 1)
    below = int(place)
    above = min(below + 1, len(ordered) - 1)
    return ordered[below] + (place - below) * (ordered[above] - ordered[below])


def flat_statistics(statistics: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Name statistics as the columns of an episode's metadata do.

    Args:
        statistics: statistics by column.

    Returns:
        Values by `stats/COLUMN/STATISTIC`.
    """
    return {
        f"stats/{column}/{name}": value for column, one in statistics.items() for name, value in one.items()
    }


def numbered_tasks(known: Iterable[str], task: str) -> dict[str, int]:
    """Number tasks in the order in which they appeared.

    Args:
        known: the tasks so far, in that order.
        task: the task of the new episode.

    Returns:
        The number of each.
    """
    return {name: number for number, name in enumerate(dict.fromkeys((*known, task)))}


def joined_statistics(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Join the statistics of the videos of several episodes.

    Means and deviations are exact.  Quantiles are means of the parts' quantiles, weighted by the number of
    pictures, as LeRobot joins them.

    Args:
        parts: statistics of each, of shape (3, 1, 1), and `count`.

    Returns:
        The statistics of all.
    """
    counts = [one["count"][0] for one in parts]

    def channels(name: str) -> list[list[float]]:
        return [[level[0][0] for level in one[name]] for one in parts]

    def weighted(rows: Sequence[Sequence[float]]) -> list[float]:
        total = sum(counts)
        return [
            sum(value * count for value, count in zip(values, counts, strict=True)) / total
            for values in zip(*rows, strict=True)
        ]

    mean = weighted(channels("mean"))
    squares = [
        [deviation**2 + level**2 for deviation, level in zip(deviations, levels, strict=True)]
        for deviations, levels in zip(channels("std"), channels("mean"), strict=True)
    ]
    found = {
        "min": [min(values) for values in zip(*channels("min"), strict=True)],
        "max": [max(values) for values in zip(*channels("max"), strict=True)],
        "mean": mean,
        "std": [
            sqrt(max(square - level**2, 0.0)) for square, level in zip(weighted(squares), mean, strict=True)
        ],
        **{name: weighted(channels(name)) for name in _QUANTILES},
    }
    nested = {name: [[[value]] for value in values] for name, values in found.items()}
    return {**nested, "count": [sum(counts)]}
