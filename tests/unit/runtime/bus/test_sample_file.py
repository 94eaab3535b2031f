"""Samples of what is measured: ten a second, of single values and what rules read, and never a failure."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.bus.sample_file import PERIOD, SampleWriter
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


def site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_ten_ticks_a_second_are_kept(tmp_path: Path) -> None:
    with SampleWriter(tmp_path / "m", site()) as samples:
        for tick in range(241):
            samples.on_tick(tick / 240, {"human_distance": 3.0 - tick / 240}, RobotChain())
    times = [line["time"] for line in lines(tmp_path / "m")]
    assert 9 <= len(times) <= 11
    assert all(later - time >= PERIOD for time, later in pairwise(times))


def test_a_run_that_goes_on_after_a_crash_goes_on_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "m").write_text('{"time": 0.0, "state": {}}\n{"time": 0.1, "sta')
    for now in (1.0, 2.0):
        with SampleWriter(tmp_path / "m", site()) as samples:
            samples.on_tick(now, {"human_distance": 3.0}, RobotChain())
    first, torn, *later = (tmp_path / "m").read_text().splitlines()
    assert first == '{"time": 0.0, "state": {}}'
    assert torn == '{"time": 0.1, "sta'
    assert [json.loads(line)["time"] for line in later] == [1.0, 2.0]


def test_observations_are_written_between_ticks_with_the_times_of_their_values(tmp_path: Path) -> None:
    with SampleWriter(tmp_path / "m", site()) as samples:
        samples.on_tick(1.0, {"human_distance": Reading(3.0, 0.9)}, RobotChain())
        samples.on_observed(
            {"estop_pressed": Reading(True, 0.2), "holding": Reading(False, 1.0)}, RobotChain()
        )
    assert lines(tmp_path / "m") == [
        {"time": 1.0, "state": {"human_distance": [3.0, 0.9]}},
        {"time": 1.0, "state": {"estop_pressed": [True, 0.2], "holding": [False, 1.0]}},
    ]


def test_an_observation_that_a_truth_has_changed_is_kept_whenever_it_comes(tmp_path: Path) -> None:
    with SampleWriter(tmp_path / "m", site()) as samples:
        for holding, distance in ((False, 3.0), (False, 2.0), (True, 1.0), (True, 0.5)):
            readings = {"holding": Reading(holding, 1.0), "human_distance": Reading(distance, 1.0)}
            samples.on_observed(readings, RobotChain())
    kept = [line["state"]["human_distance"][0] for line in lines(tmp_path / "m")]
    assert kept == [3.0, 1.0]


def test_vectors_that_no_rule_reads_are_left_out(tmp_path: Path) -> None:
    with SampleWriter(tmp_path / "m", site()) as samples:
        samples.on_tick(
            0.0, {"sponge_position": (0.0, 0.0, 0.0), "base_position": (1.0, 2.0, 3.0)}, RobotChain()
        )
    assert lines(tmp_path / "m")[0]["state"] == {"base_position": [[1.0, 2.0, 3.0], 0.0]}


def test_values_without_a_written_form_are_written_as_null(tmp_path: Path) -> None:
    odd = {"human_distance": float("nan"), "tool_speed": object(), "link_speed": (1.0, float("inf"))}
    with SampleWriter(tmp_path / "m", site()) as samples:
        samples.on_tick(0.0, odd, RobotChain())
        samples.on_observed(
            {"holding": Reading(True, float("nan")), "estop_pressed": Reading(True, 0.5)}, RobotChain()
        )
    state = lines(tmp_path / "m")[0]["state"]
    assert {name: value for name, (value, _) in state.items()} == {
        "human_distance": None, "tool_speed": None, "link_speed": [1.0, None],
    }  # fmt: skip
    assert lines(tmp_path / "m")[1]["state"]["holding"] == [True, None]


def test_a_file_that_cannot_be_written_is_counted_and_nothing_raised() -> None:
    with SampleWriter(Path("/dev/full"), site()) as samples:
        samples.on_tick(0.0, {"human_distance": 3.0}, RobotChain())
        samples.on_tick(1.0, {"human_distance": 3.0}, RobotChain())
        assert samples.lost == 2


def test_the_use_of_resources_is_written_with_a_line_and_at_the_end(tmp_path: Path) -> None:
    asked: list[bool] = []

    def usage(is_last: bool) -> dict[str, Any] | None:
        asked.append(is_last)
        return {"polish": len(asked)} if is_last or len(asked) == 1 else None

    with SampleWriter(tmp_path / "m", site(), usage) as samples:
        for now in (1.0, 2.0):
            samples.on_tick(now, {"human_distance": 3.0}, RobotChain())
    assert asked == [False, False, True]
    assert [line.get("modules") for line in lines(tmp_path / "m")] == [{"polish": 1}, None, {"polish": 3}]
    assert lines(tmp_path / "m")[-1] == {"time": 2.0, "state": {}, "modules": {"polish": 3}}
    samples.close()
    assert len(lines(tmp_path / "m")) == 3
