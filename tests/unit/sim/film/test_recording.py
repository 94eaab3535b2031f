"""A recording is read as it was written, each line has only what differs, and damage is named by its line."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import pytest

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
        (lambda lines: [*lines[:2], '{"t": "soon"}'], "line 3: .*no number"),
        (lambda lines: [*lines[:2], '{"t": 1, "move": {"9": null}}'], "line 3: .*an actor"),
        (lambda lines: [*lines[:2], '{"t": 1, "base": [0, 1e999, 0]}'], "line 3: "),
        (lambda lines: [*lines[:2], "[" * 100_000], "line 3: "),
        (lambda lines: [*lines[:2], '{"t": 1, "q": [0.1]}'], "line 3: .*1 joint positions in place of 7"),
        (lambda lines: lines[1:], "line 1: no line of a recording"),
        (lambda lines: [lines[0].replace('["foot",0', '["foot",9'), *lines[1:]], "line 1: .*IndexError"),
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
