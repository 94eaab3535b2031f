"""A person walks up during each task: the robot slows down or stops in time, and goes on afterwards."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.exit_codes import Exit
from aeros.cli.main import main
from aeros.runtime.monitor import Monitors
from aeros.sim import physics
from aeros.sim.sensing import SensorModel
from tests.unit.sim.referee import Referee, of_the_site

pytestmark = pytest.mark.physics

REPOSITORY = Path(__file__).parents[3]

APPROACHES = (
    ("clean the table", "at_the_table", 18),
    ("fetch the object", "across_the_room", 16),
    ("make dumplings", "at_the_bench", 16),
)
"""An instruction, who walks up meanwhile, and by when they have been near, s."""

Run = Callable[..., tuple[int, Referee, list[dict[str, Any]]]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `aeros run`; its exit code, a referee who saw all of it, and the audit record."""
    make_plant = physics.make_plant

    def running(
        instruction: str, person: str, *arguments: str, sensors: Mapping[str, SensorModel] | None = None
    ) -> tuple[int, Referee, list[dict[str, Any]]]:
        referee = Referee()
        monkeypatch.setattr(physics, "make_plant", partial(make_plant, referee=referee, sensors=sensors))
        code = main(
            ["run", instruction, "--person", person, "--ecms", str(REPOSITORY / "ecms"), "--no-record",
             "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out"), *arguments]
        )  # fmt: skip
        records = [json.loads(line) for line in (tmp_path / "out" / "audit.jsonl").read_text().splitlines()]
        return code, referee, records

    return running


def stops(records: list[dict[str, Any]]) -> list[str]:
    """Why steps were stopped by the monitor."""
    ended = (record["details"] for record in records if record["event"] == "step-ended")
    return [one["reason"] for one in ended if one["reason"].startswith("monitor:")]


@pytest.mark.parametrize(("instruction", "person", "_"), APPROACHES)
def test_the_robot_stops_for_a_person_and_goes_on_to_its_goal(
    instruction: str, person: str, _: int, run: Run
) -> None:
    code, referee, records = run(instruction, person)
    assert referee.distances.min() < of_the_site("walking_speed") * of_the_site("arm_stopping_time") + 0.4
    assert any("separation" in reason for reason in stops(records))
    assert referee.breaches() == []
    assert code == Exit.PROVED


TWICE = """\
schema: aeros/people/1
description: Someone comes while the wrapper is carried, and again while the lid is held by its handle.
people:
  cook:
    floor: -750 mm
    path:
      - {at: [3 m, -1 m], stay: 8.5 s}
      - {at: [1.35 m, 0 m], speed: 1.4 m/s, stay: 3 s}
      - {at: [3 m, -1 m], speed: 1.4 m/s, stay: 22 s}
      - {at: [1.35 m, 0 m], speed: 1.4 m/s, stay: 3 s}
      - {at: [3 m, -1 m], speed: 1.4 m/s}
"""


def test_what_the_hand_holds_when_a_person_comes_is_not_let_go(run: Run, tmp_path: Path) -> None:
    people = tmp_path / "twice.yaml"
    people.write_text(TWICE)
    code, referee, records = run("make dumplings", str(people), "--seed", "101")
    ended = [record["details"] for record in records if record["event"] == "step-ended"]
    assert [one["skill"] for one in ended if one["reason"] == "monitor:arm-separation"] == ["prepare", "wrap"]
    assert referee.breaches() == []
    assert code == Exit.PROVED


def test_a_robot_that_is_looked_on_from_beside_drives_at_reduced_speed(run: Run) -> None:
    _, referee, records = run("fetch the object", "across_the_room", "--timeout", "5")
    verdicts = [record["details"]["verdict"] for record in records if record["event"] == "decision"]
    assert "ATTENUATE" in verdicts
    driving = referee.base_speeds()
    assert 0.9 * of_the_site("reduced_speed") < driving.max() <= of_the_site("reduced_speed")


@pytest.mark.parametrize(("instruction", "person", "until"), APPROACHES)
def test_without_the_monitor_the_robot_comes_too_near(
    instruction: str, person: str, until: int, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Monitors, "__call__", lambda *_: None)
    _, referee, records = run(instruction, person, "--timeout", str(until))
    assert stops(records) == []
    assert referee.breaches() != []


@pytest.mark.parametrize(("instruction", "person", "until"), APPROACHES)
def test_a_scanner_within_its_data_sheet_is_good_enough(
    instruction: str, person: str, until: int, run: Run
) -> None:
    scanner = SensorModel(noise=of_the_site("person_uncertainty") / 3.0, latency=0.08, dropout=0.2)
    _, referee, records = run(
        instruction, person, "--timeout", str(until), sensors={"human_distance": scanner}
    )
    assert stops(records) != []
    assert referee.breaches() == []


def test_a_scanner_that_is_later_than_it_may_be_stops_the_robot(run: Run) -> None:
    late = {"human_distance": SensorModel(latency=0.2)}
    _, referee, records = run("fetch the object", "across_the_room", "--timeout", "3", sensors=late)
    denied = [record["details"] for record in records if record["event"] == "decision"]
    assert {one["verdict"] for one in denied} == {"DENY"}
    assert referee.link_speeds().max() < 0.01
