"""Datasets of runs: each run that is added is an episode."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.agent.world.state_numbers import StateNumbers
from aeros.apps.dataset import lerobot
from aeros.apps.dataset.recorder import RATE, EpisodeFrame
from aeros.apps.film.run_film import FilmError, film_imports
from aeros.apps.report_page.run_data import RecordedDecision
from aeros.distribution import install_command
from aeros.files import make_folder, replace_durably
from aeros.runtime.gate.configuration import Configuration
from aeros.sim.film_file import FILE as POSES
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

SIZE: Final = (320, 240)
"""Width and height of the video, pixels."""

_ROUNDING: Final = 1e-9
"""Difference of times that are equal but for the rounding of sums, s."""

_ABOUT: Final = "meta/aeros/episode-{episode:06d}.json"
"""File of what only AEROS knows of an episode."""


class DatasetError(Exception):
    """A dataset that cannot be written; the message says why and what to do."""


@dataclass(frozen=True)
class Episode:
    """A run as an episode.

    Attributes:
        frames: the measured state at a constant rate.
        decisions: the gate's decisions, in order.
        task: text of the task.
        is_success: True if the goal was reached, by truth where there is one.
        about: how the run came about, as JSON values: its seed and plant, and the end of its audit log.
    """

    frames: Sequence[EpisodeFrame]
    decisions: Sequence[RecordedDecision]
    task: str
    is_success: bool
    about: Mapping[str, Any]


class DatasetWriter:
    """Writer of a dataset in a folder.

    Args:
        folder: a new or empty folder, or one with a dataset of the same columns.
        configuration: site and modules, whose variables and actions are the columns.
        modules: ids of the modules whose variables are kept, beside those of the site.
        has_video: True to add a video, which needs a recording of poses.

    Attributes:
        state: the state variables of the columns, by name.

    Raises:
        DatasetError: a package is missing, or the folder has something else.
    """

    def __init__(
        self, folder: Path, configuration: Configuration, modules: Sequence[str], *, has_video: bool
    ) -> None:
        with _import_errors():
            from aeros.apps.dataset import parquet
        if has_video:
            with _film_errors(), film_imports():
                from aeros.sim.film import episode_video  # noqa: F401 - so that it is missed before the run
        self._parquet = parquet
        self._folder = folder
        site = configuration.site
        self._robot = site.robot or site.id
        self.state = {name: one for name, one in site.state.items() if _owner(name) in ("", *modules)}
        self._numbers = StateNumbers(self.state)
        self._kinds = tuple(sorted(site.kinds))
        self._parameters = StateNumbers(_parameters(site))
        self._has_video = has_video
        names = (*self._kinds, *self._parameters.names)
        self._features = lerobot.features_of(self._numbers.names, names, SIZE if has_video else None, RATE)
        with self._file_errors():
            self._info = self._read_info()

    @property
    def episodes(self) -> int:
        """Number of episodes in the folder."""
        return 0 if self._info is None else int(self._info["total_episodes"])

    def add(self, episode: Episode, run: Path) -> None:
        """Add an episode; files that all episodes share are replaced last.

        Args:
            episode: the episode, of at least one frame.
            run: folder of the run, with its recording of poses if there is a video.

        Raises:
            DatasetError: a file cannot be written or read, or the video cannot be drawn.
        """
        if not episode.frames:
            raise DatasetError("the run measured nothing, so there is no episode")
        with self._file_errors():
            columns = self._columns(episode)
            statistics: dict[str, Mapping[str, Any]] = {
                name: lerobot.statistics_of(values) for name, values in columns.items()
            }
            if self._has_video:
                statistics[lerobot.VIDEO] = self._write_video(episode, run)
            place = lerobot.place_of(self.episodes)
            self._write(lerobot.DATA_PATH.format(**place), self._parquet.data_table(columns, self._features))
            self._write_episode(episode, statistics)
            self._write_shared(episode)

    def _columns(self, episode: Episode) -> dict[str, list[Any]]:
        """Return the values of each feature."""
        count, last = len(episode.frames), len(episode.frames) - 1
        encoded = [self._numbers.encode(frame.world.known) for frame in episode.frames]
        first = 0 if self._info is None else int(self._info["total_frames"])
        number = self._tasks(episode)[episode.task]
        return {
            lerobot.STATE: [numbers for numbers, _ in encoded],
            lerobot.KNOWN: [[float(flag) for flag in flags] for _, flags in encoded],
            lerobot.ACTION: self._actions(episode),
            "next.reward": [float(place == last and episode.is_success) for place in range(count)],
            "next.done": [place == last for place in range(count)],
            "next.success": [place == last and episode.is_success for place in range(count)],
            "timestamp": [place / RATE for place in range(count)],
            "frame_index": list(range(count)),
            "episode_index": [self.episodes] * count,
            "index": list(range(first, first + count)),
            "task_index": [number] * count,
        }

    def _actions(self, episode: Episode) -> list[list[float]]:
        """Return for each frame the action that the gate decided last, and may be under way."""
        decided = [one for one in episode.decisions if one.decision != "DENY"]
        found, place = [], 0
        current: RecordedDecision | None = None
        for frame in episode.frames:
            while place < len(decided) and decided[place].time <= frame.time + _ROUNDING:
                current, place = decided[place], place + 1
            found.append(self._action_row(current))
        return found

    def _action_row(self, decision: RecordedDecision | None) -> list[float]:
        kind = None if decision is None else decision.kind
        given = {} if decision is None else decision.decided
        numbers, _ = self._parameters.encode({f"{kind}.{name}": value for name, value in given.items()})
        return [*(float(one == kind) for one in self._kinds), *numbers]

    def _write_video(self, episode: Episode, run: Path) -> Mapping[str, Any]:
        """Write the video, and return its statistics.

        Raises:
            FilmError: it cannot be drawn; the caller of `add` gets a `DatasetError`.
        """
        with _film_errors():
            with film_imports():
                from aeros.sim.film.episode_video import draw_video
                from aeros.sim.film.film import EmptyFilmError
                from aeros.sim.film.gl_context import OpenGlError
                from aeros.sim.film.recording import RecordingError, read_recording
            try:
                recording = read_recording(run / POSES)
                frames = episode.frames
                video = draw_video(recording, frames[0].time, len(frames), SIZE, RATE)
            except (EmptyFilmError, OpenGlError, RecordingError) as error:
                raise FilmError(str(error)) from error
        place = lerobot.place_of(self.episodes)
        self._write(lerobot.VIDEO_PATH.format(video_key=lerobot.VIDEO, **place), video.content)
        return video.statistics

    def _write_episode(self, episode: Episode, statistics: Mapping[str, Mapping[str, Any]]) -> None:
        number, place = self.episodes, lerobot.place_of(self.episodes)
        first = 0 if self._info is None else int(self._info["total_frames"])
        prefixes = ["data/", "meta/episodes/", *([f"videos/{lerobot.VIDEO}/"] if self._has_video else [])]
        row: dict[str, Any] = {
            "episode_index": number,
            "tasks": [episode.task],
            "length": len(episode.frames),
            "dataset_from_index": first,
            "dataset_to_index": first + len(episode.frames),
            **{f"{prefix}{name}": value for prefix in prefixes for name, value in place.items()},
        }
        if self._has_video:
            row[f"videos/{lerobot.VIDEO}/from_timestamp"] = 0.0
            row[f"videos/{lerobot.VIDEO}/to_timestamp"] = len(episode.frames) / RATE
        row |= lerobot.flat_statistics(statistics)
        self._write(lerobot.EPISODES_PATH.format(**place), self._parquet.episode_table(row))
        self._write(_ABOUT.format(episode=number), _json(episode.about))

    def _write_shared(self, episode: Episode) -> None:
        """Replace the files that tell of all episodes; the one that counts them comes last."""
        tasks = self._tasks(episode)
        episodes = self.episodes + 1
        frames = len(episode.frames) + (0 if self._info is None else int(self._info["total_frames"]))
        self._write(lerobot.TASKS, self._parquet.task_table(tasks))
        self._write(lerobot.STATS, _json(self._statistics_of_all(episodes)))
        info = lerobot.info_of(self._features, self._robot, RATE, episodes, frames, len(tasks))
        self._write(lerobot.INFO, _json(info))
        self._info = info

    def _statistics_of_all(self, episodes: int) -> dict[str, Any]:
        """Compute the statistics of all frames; of videos, those of the episodes are joined."""
        columns: dict[str, list[Any]] = {}
        videos: list[dict[str, Any]] = []
        for episode in range(episodes):
            place = lerobot.place_of(episode)
            path = self._folder / lerobot.DATA_PATH.format(**place)
            for name, values in self._parquet.read_columns(path.read_bytes()).items():
                columns.setdefault(name, []).extend(values)
            if self._has_video:
                row = self._parquet.read_columns(
                    (self._folder / lerobot.EPISODES_PATH.format(**place)).read_bytes()
                )
                prefix = f"stats/{lerobot.VIDEO}/"
                videos.append(
                    {
                        name.removeprefix(prefix): one[0]
                        for name, one in row.items()
                        if name.startswith(prefix)
                    }
                )
        found: dict[str, Any] = {name: lerobot.statistics_of(values) for name, values in columns.items()}
        if videos:
            found[lerobot.VIDEO] = lerobot.joined_statistics(videos)
        return found

    def _tasks(self, episode: Episode) -> dict[str, int]:
        path = self._folder / lerobot.TASKS
        known = [] if self._info is None else self._parquet.read_tasks(path.read_bytes())
        return lerobot.numbered_tasks(known, episode.task)

    def _read_info(self) -> dict[str, Any] | None:
        """Read the dataset's description; None if there is none.

        Raises:
            DatasetError: the folder has something else, or a dataset with other columns.
        """
        path = self._folder / lerobot.INFO
        if not path.exists():
            if self._folder.exists() and any(self._folder.iterdir()):
                raise DatasetError(
                    f"`{self._folder}` is not empty and has no {lerobot.INFO}: give a new folder to --dataset"
                )
            return None
        info: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(info, dict) or info.get("codebase_version") != lerobot.VERSION:
            raise DatasetError(f"`{path}` is not of a dataset of version {lerobot.VERSION}")
        if info.get("features") != self._features or info.get("fps") != RATE:
            raise DatasetError(
                f"the dataset `{self._folder}` has other columns: it is of other modules, another site or "
                "plant; give a new folder to --dataset"
            )
        return info

    def _write(self, name: str, content: bytes) -> None:
        path = self._folder / name
        make_folder(path.parent)
        replace_durably(path, content, is_private=False)

    @contextmanager
    def _file_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise DatasetError(f"cannot write the dataset `{self._folder}`: {error.strerror}") from error
        except ValueError as error:
            raise DatasetError(f"the dataset `{self._folder}` is damaged: {error}") from error


def _owner(variable: str) -> str:
    """Return the id of the module that a variable belongs to; empty for one of the site."""
    return variable.partition(".")[0] if "." in variable else ""


def _parameters(site: Site) -> dict[str, Declared]:
    """Return the parameters of all action kinds, by `KIND.PARAMETER`."""
    return {
        f"{kind.name}.{name}": one for kind in site.kinds.values() for name, one in kind.parameters.items()
    }


def _json(content: Mapping[str, Any]) -> bytes:
    return (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode()


@contextmanager
def _import_errors() -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise DatasetError(
            f"a dataset needs {install_command('dataset')} ({error.name} is missing)"
        ) from error


@contextmanager
def _film_errors() -> Iterator[None]:
    try:
        yield
    except FilmError as error:
        raise DatasetError(f"the dataset's video cannot be drawn: {error}; or use --no-film") from error
