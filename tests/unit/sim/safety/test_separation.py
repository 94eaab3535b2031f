"""A person walks up during each task: the robot slows down or stops in time, and goes on afterwards."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import Reading, Readings
from aeros.sim import physics
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.sensor_model import SensorModel
from aeros.sim.sensors import GroundTruth, Sensors
from tests.unit.sim.referee import Referee, of_the_site

pytestmark = pytest.mark.physics

REPOSITORY = Path(__file__).parents[4]

APPROACHES = (
    ("clean the table", "at_the_table", 26),
    ("fetch the object", "across_the_room", 16),
    ("make dumplings", "at_the_bench", 30),
)
"""An instruction, who walks up meanwhile, and by when they have been near, s."""


def fetch_each_push(rows: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Rows of which those of other tasks than fetching are left to `make deep`."""
    return [
        pytest.param(*row, marks=() if row[0] == "fetch the object" else pytest.mark.deep, id=row[0])
        for row in rows
    ]


NEARBY = (
    ("clean the table", ("at: [3 m, -1.2 m]", "at: [1.95 m, -1.2 m], speed: 1.2 m/s"), "-300 mm", 18),
    ("fetch the object", ("at: [-3 m, 0.05 m]", "at: [-1.64 m, 0.05 m], speed: 1.2 m/s"), "-300 mm", 14),
    ("make dumplings", ("at: [4 m, 0 m]", "at: [1.85 m, 0 m], speed: 1.2 m/s"), "-300 mm", 10),
)
"""An instruction, the way of somebody who stays where the robot may work slowly, their floor, until when."""


def staying(folder: Path, way: tuple[str, ...], floor: str) -> str:
    """A people file."""
    places = "".join(f"      - {{{place}}}\n" for place in way)
    path = folder / "people.yaml"
    path.write_text(
        "schema: aeros/people/1\ndescription: Somebody stays.\n"
        f"people:\n  guest:\n    floor: {floor}\n    path:\n{places}"
    )
    return str(path)


class Blind(Sensors):
    """The scanner sees nobody."""

    def read(self, truth: GroundTruth) -> Readings:
        return {**super().read(truth), "human_distance": Reading(SCANNER_RANGE, truth.time)}

    def monitor_values(self, truth: GroundTruth) -> Mapping[str, Any]:
        return {**super().monitor_values(truth), "human_distance": SCANNER_RANGE}


Run = Callable[..., tuple[int, Referee, list[dict[str, Any]]]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `aeros run`; its exit code, a referee who saw all of it, and the audit record."""
    make_plant = physics.make_plant

    def running(
        instruction: str, person: str, *arguments: str, sensors: Mapping[str, SensorModel] | None = None
    ) -> tuple[int, Referee, list[dict[str, Any]]]:
        referee = Referee()

        def watched(*scene: Any, **options: Any) -> physics.PhysicsPlant:
            models = {**options.pop("sensors", {}), **(sensors or {})}
            return make_plant(*scene, **options, referee=referee, sensors=models)

        monkeypatch.setattr(physics, "make_plant", watched)
        code = main(
            ["run", instruction, "--people", person, "--ecms", str(REPOSITORY / "ecms"), "--no-film",
             "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out"), *arguments]
        )  # fmt: skip
        records = [json.loads(line) for line in (tmp_path / "out" / "audit.jsonl").read_text().splitlines()]
        return code, referee, records

    return running


def stops(records: list[dict[str, Any]]) -> list[str]:
    """List the reasons for which the monitor stopped steps."""
    ended = (record["details"] for record in records if record["event"] == "step-ended")
    return [one["reason"] for one in ended if one["reason"].startswith("monitor:")]


@pytest.mark.parametrize(("instruction", "person", "until"), fetch_each_push(APPROACHES))
def test_the_robot_stops_for_a_person_and_goes_on_to_its_goal(
    instruction: str, person: str, until: int, run: Run
) -> None:
    # Beside what each scanner errs and is late itself: with it, a reading is nearly as old as it may be.
    scanner = SensorModel(noise=of_the_site("person_uncertainty") / 3.0, latency=0.02, dropout=0.1)
    code, referee, records = run(instruction, person, sensors={"human_distance": scanner})
    assert referee.distances.min() < of_the_site("walking_speed") * of_the_site("arm_stopping_time") + 0.4
    assert any("separation" in reason for reason in stops(records))
    assert referee.breaches() == []
    assert code == Exit.SUCCESS


TWICE = """\
schema: aeros/people/1
description: Someone comes while the wrapper is carried, and again while the lid is held by its handle.
people:
  cook:
    floor: -300 mm
    path:
      - {at: [3 m, -1 m], stay: 5.6 s}
      - {at: [1.35 m, 0 m], speed: 1.4 m/s, stay: 3 s}
      - {at: [3 m, -1 m], speed: 1.4 m/s, stay: 40 s}
      - {at: [1.35 m, 0 m], speed: 1.4 m/s, stay: 3 s}
      - {at: [3 m, -1 m], speed: 1.4 m/s}
"""


@pytest.mark.deep
def test_a_held_object_is_not_dropped_when_a_person_comes(run: Run, tmp_path: Path) -> None:
    people = tmp_path / "twice.yaml"
    people.write_text(TWICE)
    code, referee, records = run("make dumplings", str(people), "--seed", "101")
    ended = [record["details"] for record in records if record["event"] == "step-ended"]
    assert {one["skill"] for one in ended if one["reason"].startswith("monitor:")} == {"prepare", "wrap"}
    assert referee.breaches() == []
    assert code == Exit.SUCCESS


@pytest.mark.deep
def test_a_robot_with_a_bystander_drives_at_reduced_speed(run: Run, tmp_path: Path) -> None:
    instruction, way, floor, _ = NEARBY[1]
    _, referee, records = run(instruction, staying(tmp_path, way, floor), "--timeout", "22")
    verdicts = [record["details"]["verdict"] for record in records if record["event"] == "decision"]
    assert "ATTENUATE" in verdicts
    driving = referee.base_speeds()
    assert 0.9 * of_the_site("reduced_driving_speed") < driving.max() <= of_the_site("driving_contact_speed")


@pytest.mark.deep
@pytest.mark.parametrize(("instruction", "way", "floor", "until"), NEARBY)
def test_the_robot_works_slowly_next_to_a_person_who_stays(
    instruction: str, way: tuple[str, ...], floor: str, until: int, run: Run, tmp_path: Path
) -> None:
    _, referee, records = run(instruction, staying(tmp_path, way, floor), "--timeout", str(until))
    verdicts = [record["details"]["verdict"] for record in records if record["event"] == "decision"]
    assert "ATTENUATE" in verdicts
    assert "DENY" not in verdicts
    assert referee.breaches() == []
    near = referee.link_speeds()[referee.distances < of_the_site("warning_distance")]
    assert near.max() <= of_the_site("reduced_speed")
    # It goes on; scanners take people to be nearer than they are, by up to 150 mm.
    about = referee.link_speeds()[referee.distances < of_the_site("warning_distance") + 0.15]
    assert np.mean(about > 0.05) > 0.25


@pytest.mark.deep
@pytest.mark.parametrize(("instruction", "person", "until"), APPROACHES)
def test_a_robot_whose_scanner_sees_nobody_comes_too_near(
    instruction: str, person: str, until: int, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(physics, "Sensors", Blind)
    _, referee, records = run(instruction, person, "--timeout", str(until))
    verdicts = {record["details"]["verdict"] for record in records if record["event"] == "decision"}
    assert verdicts == {"ALLOW"}
    assert referee.breaches() != []


def test_a_carriage_is_slowed_as_far_as_separation_needs(run: Run, tmp_path: Path) -> None:
    instruction, way, floor, _ = NEARBY[1]
    _, referee, records = run(instruction, staying(tmp_path, way, floor), "--timeout", "9")
    slowed = [
        record["details"]["decided"]["parameters"]["speed"]
        for record in records
        if record["event"] == "decision"
        and record["details"]["verdict"] == "ATTENUATE"
        and "drive-separation" in {rule for _, rule, _ in record["details"]["reasons"]}
    ]
    assert slowed
    assert all(
        of_the_site("creeping_speed") <= speed <= of_the_site("reduced_tool_speed") for speed in slowed
    )
    assert referee.breaches() == []


# Cleaning is left out: who comes to the table comes between two actions, and the gate denies the next one.
@pytest.mark.parametrize(("instruction", "person", "until"), fetch_each_push(APPROACHES[1:]))
def test_without_the_monitor_the_robot_comes_too_near(
    instruction: str, person: str, until: int, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RuntimeMonitor, "__call__", lambda *_: None)
    _, referee, records = run(instruction, person, "--timeout", str(until), "--seed", "0")
    assert stops(records) == []
    assert referee.breaches() != []


@pytest.mark.deep
@pytest.mark.parametrize(("instruction", "person", "until"), APPROACHES)
def test_so_it_does_with_a_scanner_that_is_better(
    instruction: str, person: str, until: int, run: Run
) -> None:
    code, referee, records = run(instruction, person)
    assert stops(records) != []
    assert referee.breaches() == []
    assert code == Exit.SUCCESS


def test_a_scanner_that_is_later_than_it_may_be_stops_the_robot(run: Run) -> None:
    late = {"human_distance": SensorModel(latency=0.2)}
    _, referee, records = run("fetch the object", "across_the_room", "--timeout", "3", sensors=late)
    denied = [record["details"] for record in records if record["event"] == "decision"]
    assert {one["verdict"] for one in denied} == {"DENY"}
    assert referee.link_speeds().max() < 0.01
