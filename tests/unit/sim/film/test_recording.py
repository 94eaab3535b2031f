"""A recording is read as it was written, each line has only what differs, and damage is named by its line."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from aeros.kinematic_chain import PRISMATIC
from aeros.sim.film.recording import RecordingError, encode_sample, encode_stage, read_recording
from tests.unit.sim.film.recordings import STAGE, samples


def written(path: Path) -> Path:
    pictures = samples(4)
    lines = [encode_stage(STAGE), encode_sample(pictures[0], None)]
    path.write_text("".join(lines + [encode_sample(after, before) for before, after in pairwise(pictures)]))
    return path


def test_a_recording_is_read_as_it_was_written(tmp_path: Path) -> None:
    read = read_recording(written(tmp_path / "poses.jsonl"))
    assert read.stage == STAGE
    assert read.samples == samples(4)


@pytest.mark.parametrize("others", [(0.25,), (0.25, PRISMATIC)])
def test_a_joint_that_slides_or_counts_from_elsewhere_is_kept(
    others: tuple[float, ...], tmp_path: Path
) -> None:
    *rows, last = STAGE.robot.rows
    stage = replace(STAGE, robot=replace(STAGE.robot, rows=(*rows, (*last[:3], *others))))  # type: ignore[arg-type]
    path = tmp_path / "poses.jsonl"
    path.write_text(encode_stage(stage) + encode_sample(samples(1)[0], None), encoding="utf-8")
    assert read_recording(path).stage == stage


def test_a_camera_that_moves_is_read_where_it_was(tmp_path: Path) -> None:
    (name, camera), *_ = STAGE.cameras.items()
    at = {number: {name: replace(camera, eye=(0.1 * number, 0.0, 1.0))} for number in (1, 2)}
    pictures = samples(4)
    pictures[1:] = [replace(one, cameras=at[min(number, 2)]) for number, one in enumerate(pictures[1:], 1)]
    lines = [encode_stage(STAGE), encode_sample(pictures[0], None)]
    lines += [encode_sample(after, before) for before, after in pairwise(pictures)]
    assert ["cameras" in line for line in lines] == [True, False, True, True, False]
    path = tmp_path / "poses.jsonl"
    path.write_text("".join(lines), encoding="utf-8")
    assert read_recording(path).samples == pictures
    path.write_text("".join(lines).replace('"cameras":{"top":[', '"cameras":{"side":['), encoding="utf-8")
    with pytest.raises(RecordingError, match="line 3"):
        read_recording(path)


def test_a_line_has_only_what_differs() -> None:
    first, second, third = samples(3)
    assert json.loads(encode_sample(second, first)).keys() == {"t", "people", "move"}
    assert json.loads(encode_sample(second, first))["move"].keys() == {"0"}
    assert json.loads(encode_sample(third, second)).keys() == {"t", "people", "coated"}


def test_the_last_start_counts_and_a_line_that_was_cut_off_does_not(tmp_path: Path) -> None:
    path = written(tmp_path / "poses.jsonl")
    path.write_text(path.read_text() * 2 + '{"t": 7')
    assert read_recording(path).samples == samples(4)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda lines: [], "has no picture"),
        (lambda lines: lines[:1], "has no picture"),
        (lambda lines: [*lines[:2], "nonsense"], "line 3: no line of a recording"),
        (lambda lines: [*lines[:2], '{"t": "soon"}'], "line 3: .*`soon` is no number"),
        (lambda lines: [*lines[:2], '{"t": 1, "move": {"9": null}}'], "line 3: .*an actor"),
        (lambda lines: [*lines[:2], '{"t": 1, "base": [0, 1e999, 0]}'], "line 3: "),
        (lambda lines: [*lines[:2], "[" * 100_000], "line 3: "),
        (lambda lines: [*lines[:2], '{"t": 1, "q": [0.1]}'], "line 3: .*1 joint positions in place of 7"),
        (lambda lines: lines[1:], "line 1: no line of a recording"),
        (
            lambda lines: [lines[0].replace('["foot",0', '["foot",9'), *lines[1:]],
            "line 1: .*`9` is no joint",
        ),
        (lambda lines: [lines[0].replace("poses/1", "poses/2"), *lines[1:]], "newer AEROS"),
        (lambda lines: [lines[0].replace('"box"', '"cube"', 2), *lines[1:]], "line 1: .*`cube` is no shape"),
    ],
)
def test_a_damaged_recording_is_refused_with_its_line(change, reason: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    path = written(tmp_path / "poses.jsonl")
    path.write_text("".join(line + "\n" for line in change(path.read_text().splitlines())))
    with pytest.raises(RecordingError, match=reason):
        read_recording(path)
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        read_recording(tmp_path / "other.jsonl")


def _first(**change: object) -> Callable[[list[str]], list[str]]:
    """Change fields of the first line; `a__b` is `b` in `a`, and `0` the first of a list."""

    def changed(lines: list[str]) -> list[str]:
        content = json.loads(lines[0])
        for key, value in change.items():
            *way, last = key.split("__")
            place = content
            for step in way:
                place = place[int(step) if step.isdigit() else step]
            place[int(last) if last.isdigit() else last] = value
        return [json.dumps(content), *lines[1:]]

    return changed


def _last(**change: object) -> Callable[[list[str]], list[str]]:
    """Add a picture."""
    return lambda lines: [*lines, json.dumps({"t": 1.0} | change)]


SHAPE = "actors__0__shapes__0"


def test_values_out_of_bounds_are_refused_with_line_cause_and_cure(tmp_path: Path) -> None:
    path = written(tmp_path / "poses.jsonl")
    lines = path.read_text().splitlines()
    for change, reason in (
        (_last(t=10**400), "is no number from 0.1 to 1e+07"),
        (_last(t=-1.0), "`-1.0` is no number"),
        (_last(t=0.05), "`0.05` is no number from 0.1"),
        (_last(t=2e7), "`20000000.0` is no number"),
        (_last(gap=10**400), "is no number from -10000 to 10000"),
        (_last(gap=float("nan")), "`nan` is no number"),
        (_last(move={"0": [0, 0, 0, 0, 0, 0, 0]}), "has not the length 1"),
        (_last(people=[[0, 0, 0, -1, 0.2]]), "-1.0 is not above 0"),
        (_last(coated={"dirt": "1\u0416"}), "characters `0` and `1`"),
        (_last(coated={"rust": "1"}), "layers that the first line does not have: rust"),
        (_first(view__size=[0, 0]), "0 x 0 pixels"),
        (_first(view__size=[10**400, 1]), "no size of a picture"),
        (_first(view__field_of_view=5000.0), "5000.0 degrees is not below 180"),
        (_first(view__eye=list(STAGE.view.target)), "a camera at its target"),
        (_first(robot__hulls__0__2=[]), "hull of `foot`: it has no corners"),
        (_first(robot__hulls__0__1=-1), "`-1` is no joint"),
        (_first(robot__rows__0=[0.0, 0.0]), "line 1: "),
        (_first(robot__rows__0=[0.0] * 5), "a joint of no known kind"),
        (_first(robot__rows__0=[0.0] * 4 + [1.0] * 2), "a joint of no known kind"),
        (_first(robot__urdf="plane.obj"), "`plane.obj` is no URDF file"),
        (_first(robot__carriage=[1, 1, -1]), "`-1` is no number from 0"),
        (_first(**{SHAPE + "__1": [0.1, -1, 0.1]}), "`-1` is no number from 0"),
        (_first(**{SHAPE + "__2": [0.1, 2, 0.1]}), "`2` is no number from 0 to 1"),
        (_first(**{SHAPE + "__3": 77}), "`77` is no number from 0 to 1"),
        (_first(**{SHAPE + "__4": [0] * 7}), "has not the length 1"),
        (_first(coatings__dirt__cell=1e-9), "has more than 100000"),
        (_first(coatings__dirt__cell=1e-320), "line 1: "),
        (_first(coatings__dirt__high=[0, 0]), "`high` is not above its `low`"),
    ):
        damaged = change(lines)
        number = 1 if len(damaged) == len(lines) else len(damaged)
        path.write_text("".join(line + "\n" for line in damaged))
        with pytest.raises(RecordingError, match=re.escape(reason)) as refused:
            read_recording(path)
        assert f"`{path}`, line {number}: no line of a recording" in str(refused.value)
        assert str(refused.value).endswith("run the task again to record it anew")


def test_a_run_may_last_for_days(tmp_path: Path) -> None:
    path = written(tmp_path / "poses.jsonl")
    path.write_text(path.read_text() + '{"t":3000000.5}\n{"t":3000000.5}\n')
    assert read_recording(path).samples[-1].time == 3000000.5
