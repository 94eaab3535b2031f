"""Reads a dataset without AEROS: with LeRobot, or with the libraries that it reads with. Prints JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any


def _by_lerobot(folder: Path) -> dict[str, Any]:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("aeros/test", root=folder, video_backend="pyav")
    item, last = dataset[5], dataset[len(dataset) - 1]
    return {
        "reader": "lerobot",
        "frames": len(dataset),
        "task": item["task"],
        "picture": list(item["observation.images.cell"].shape),
        "state": len(item["observation.state"]),
        "last_reward": float(last["next.reward"]),
    }


def _by_libraries(folder: Path) -> dict[str, Any]:
    """The steps of LeRobot's reader, from what `meta/info.json` says."""
    import av
    import datasets
    import pandas

    info = json.loads((folder / "meta" / "info.json").read_text())
    columns = {
        name: datasets.Value(one["dtype"])
        if one["shape"] == [1]
        else datasets.Sequence(datasets.Value(one["dtype"]), length=one["shape"][0])
        for name, one in info["features"].items()
        if one["dtype"] != "video"
    }
    files = sorted(map(str, (folder / "data").glob("*/*.parquet")))
    frames = datasets.Dataset.from_parquet(files, features=datasets.Features(columns))
    episodes = datasets.Dataset.from_parquet(sorted(map(str, (folder / "meta/episodes").glob("*/*.parquet"))))
    tasks = pandas.read_parquet(folder / "meta" / "tasks.parquet")
    item, last = frames[5], frames[len(frames) - 1]
    (key,) = (name for name, one in info["features"].items() if one["dtype"] == "video")
    episode = episodes[item["episode_index"]]
    path = info["video_path"].format(
        video_key=key,
        chunk_index=episode[f"videos/{key}/chunk_index"],
        file_index=episode[f"videos/{key}/file_index"],
    )
    with av.open(str(folder / path)) as container:
        pictures = list(container.decode(video=0))
    assert len(pictures) == episode["length"]
    assert abs(pictures[5].time - item["timestamp"]) < 1e-4
    height, width, channels = pictures[5].to_ndarray(format="rgb24").shape
    return {
        "reader": "libraries",
        "frames": len(frames),
        "task": tasks.iloc[item["task_index"]].name,
        "picture": [channels, height, width],
        "state": len(item["observation.state"]),
        "last_reward": last["next.reward"],
    }


if __name__ == "__main__":
    given = Path(sys.argv[1])
    try:
        import lerobot  # noqa: F401
    except ImportError:
        sys.stdout.write(json.dumps(_by_libraries(given)))
    else:
        sys.stdout.write(json.dumps(_by_lerobot(given)))
