"""Measurements of true values: bit for bit, or with noise, late, or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan
from statistics import fmean, pstdev
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import CameraPicture, CameraView, Reading
from aeros.sim.clock import TICK
from aeros.sim.physics import make_plant
from aeros.sim.sensor_model import SensorModel
from aeros.sim.sensors import GroundTruth, Sensors
from aeros.skill import act
from aeros.spec.diagnostics.errors import MisuseError
from tests.shipped_scenes import SHIPPED, shipped_scene
from tests.unit.sim.acting import allow, execute, recording


def truth(tick: int, **more: Any) -> GroundTruth:
    """Something that changes from tick to tick."""
    return GroundTruth(tick, {"joint": float(tick), "flag": tick % 2 == 0, **more})


def followed(model: SensorModel, ticks: int = 2000, seed: int = 0) -> list[Reading | None]:
    """Return the reading of `joint` at each tick."""
    sensors = Sensors(seed, {"joint": model})
    return [sensors.read(truth(tick)).get("joint") for tick in range(ticks)]


def test_without_a_model_a_quantity_is_measured_as_it_is() -> None:
    sensors = Sensors(0, {"other": SensorModel(noise=1.0)})
    now = truth(7)
    assert sensors.read(now) == {name: Reading(value, 7 * TICK) for name, value in now.values.items()}
    assert sensors.monitor_values(now) is now.values


def test_noise_has_the_declared_deviation_and_no_bias() -> None:
    read = followed(SensorModel(noise=0.5))
    errors = [one.value - tick for tick, one in enumerate(read) if one is not None]
    assert len(errors) == 2000
    assert abs(fmean(errors)) < 4 * 0.5 / 2000**0.5
    assert pstdev(errors) == pytest.approx(0.5, rel=0.1)


def test_noise_is_of_each_number_and_not_of_truth_values() -> None:
    sensors = Sensors(0, {name: SensorModel(noise=0.1) for name in ("place", "flag", "word")})
    values = sensors.monitor_values(GroundTruth(3, {"place": (1.0, 2.0, 3.0), "flag": True, "word": "mast"}))
    assert (values["flag"], values["word"]) == (True, "mast")
    off = [a - b for a, b in zip(values["place"], (1.0, 2.0, 3.0), strict=True)]
    assert len(set(off)) == 3
    assert all(0.0 < abs(one) < 0.5 for one in off)


def test_readings_are_multiples_of_the_step() -> None:
    sensors = Sensors(0, {"length": SensorModel(resolution=0.25)})
    assert sensors.monitor_values(GroundTruth(0, {"length": 1.13}))["length"] == 1.25


def test_a_range_finder_shows_neither_negative_distances_nor_more_than_its_range() -> None:
    sensors = Sensors(1, {"human_distance": SensorModel(noise=5.0)})
    shown = [
        sensors.monitor_values(GroundTruth(tick, {"human_distance": 20.0 * (tick % 2)}))
        for tick in range(100)
    ]
    assert {0.0, 20.0} <= {one["human_distance"] for one in shown}
    assert all(0.0 <= one["human_distance"] <= 20.0 for one in shown)


def test_a_late_reading_carries_the_time_at_which_it_was_true() -> None:
    read = followed(SensorModel(latency=0.05), 40)
    assert read[30] == Reading(18.0, 18 * TICK)
    assert read[0] == Reading(0.0, -12 * TICK)  # at rest before the clock began


def test_the_monitor_gets_an_old_value_as_a_reading() -> None:
    sensors = Sensors(0, {"joint": SensorModel(latency=TICK)})
    sensors.monitor_values(truth(4))
    assert sensors.monitor_values(truth(5)) == {"joint": Reading(4.0, 4 * TICK), "flag": False}


def test_a_dropped_reading_leaves_the_previous_one_which_ages() -> None:
    read = followed(SensorModel(dropout=0.3))
    ages = [tick - round(one.time / TICK) for tick, one in enumerate(read) if one is not None]
    assert 0.27 < sum(age > 0 for age in ages) / len(ages) < 0.33
    assert max(ages) > 2
    assert all(one is None or one.value == round(one.time / TICK) for one in read)


def test_models_change_while_running_and_a_dead_sensor_keeps_its_last_word() -> None:
    sensors = Sensors(0)
    for tick in range(3):
        sensors.sample(truth(tick))
    sensors.models["joint"] = SensorModel(dropout=1.0)
    for tick in range(3, 6):
        assert sensors.read(truth(tick))["joint"] == Reading(2.0, 2 * TICK)
    del sensors.models["joint"]
    assert sensors.read(truth(6))["joint"] == Reading(6.0, 6 * TICK)
    sensors.models["joint"] = SensorModel(latency=2 * TICK)
    times = [round(sensors.read(truth(tick))["joint"].time / TICK) for tick in range(7, 12)]
    assert times == [6, 6, 7, 8, 9]


def test_a_longer_latency_takes_no_reading_back() -> None:
    sensors = Sensors(0, {"joint": SensorModel(latency=TICK)})
    for tick in range(5):
        sensors.sample(truth(tick))
    sensors.models["joint"] = SensorModel(latency=4 * TICK)
    times = [round(sensors.read(truth(tick))["joint"].time / TICK) for tick in range(5, 10)]
    assert times == [3, 3, 3, 4, 5]


def test_readings_depend_on_the_seed_and_not_on_how_often_they_are_read() -> None:
    model = SensorModel(noise=0.2, latency=0.02, dropout=0.2)
    often = Sensors(5, {"joint": model})
    looked = []
    for tick in range(200):
        often.read(truth(tick))
        often.monitor_values(truth(tick))
        looked.append(often.read(truth(tick)).get("joint"))
    assert looked == followed(model, 200, seed=5)
    assert looked != followed(model, 200, seed=6)


def test_a_cameras_depth_is_noisy_and_its_pictures_come_late_or_never() -> None:
    view = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 50.0)
    depth = np.full(100, 1.0, np.float32)
    picture = CameraPicture("mast", 0.1, 10, 10, b"\x80" * 300, depth.tobytes(), view)
    sensors = Sensors(0, {"mast": SensorModel(noise=0.01, latency=0.1)})
    seen = sensors.deliver(picture, 24)
    assert seen is not None
    assert (seen.time, seen.rgb, seen.view) == (picture.time, picture.rgb, view)
    errors = np.frombuffer(seen.depth or b"", np.float32) - depth
    assert 0.005 < errors.std() < 0.015
    assert seen == sensors.deliver(picture, 24) != sensors.deliver(picture, 25)
    assert (sensors.delay("mast"), sensors.delay("hand")) == (24, 0)
    assert sensors.deliver(replace(picture, camera="hand"), 24) == replace(picture, camera="hand")
    without = replace(picture, depth=None)
    assert sensors.deliver(without, 24) == without
    sensors.models["mast"] = SensorModel(dropout=1.0)
    assert sensors.deliver(picture, 24) is None


@pytest.mark.parametrize(
    "wrong", [{"noise": -1.0}, {"resolution": inf}, {"latency": nan}, {"dropout": 1.5}, {"dropout": -0.1}]
)
def test_there_is_no_sensor_like_that(wrong: dict[str, float]) -> None:
    with pytest.raises(MisuseError, match="invalid sensor model"):
        SensorModel(**wrong)


@pytest.mark.physics
@pytest.mark.parametrize("scene", SHIPPED)
def test_no_truth_goes_past_the_sensors(scene: str) -> None:
    named = make_plant(shipped_scene(scene), 0)
    dead = dict.fromkeys(named.observe(), SensorModel(dropout=1.0))
    named_base = named.observe()["base_position"].value
    named.close()
    assert len(dead) >= 11
    plant = make_plant(shipped_scene(scene), 0, sensors=dead)
    monitored: list[Mapping[str, Any]] = []
    _, y, _ = named_base
    reach = act("move_tool", target=(0.5, y + 0.1, 0.6), yaw=0.0, speed=0.3)
    execute(plant, reach, recording(monitored), 1.0)
    assert plant.observe() == {}
    assert len(monitored) > 200
    assert not any(monitored)
    plant.close()


@pytest.mark.physics
def test_a_late_load_cell_is_late_however_seldom_it_is_asked() -> None:
    plant = make_plant(
        shipped_scene("dumpling_bench"), 0, sensors={"make_dumplings.press_force": SensorModel(latency=0.1)}
    )
    execute(plant, act("wait", duration=0.5), allow, 9.0)
    reading = plant.observe()["make_dumplings.press_force"]
    assert plant.now() - reading.time == pytest.approx(0.1)
    plant.close()


@pytest.mark.physics
def test_a_camera_that_sees_nothing_measures_nothing() -> None:
    plant = make_plant(shipped_scene("fetch"), 0, sensors={"object_position": SensorModel(dropout=1.0)})
    for action in (act("move_base", x=1.21, y=0.16, speed=0.6), act("look", camera="hand")):
        assert execute(plant, action, allow, 99.0).completed
    assert "object_position" not in plant.observe()
    plant.close()


# A sensor with a clock of its own.


def own_clock(tick: int, value: float, age: int) -> GroundTruth:
    return GroundTruth(tick, {"gap": Reading(value, (tick - age) * TICK)})


def test_a_reading_of_its_own_clock_keeps_its_time() -> None:
    sensors = Sensors(0)
    assert sensors.read(own_clock(9, 2.0, 4)) == {"gap": Reading(2.0, 5 * TICK)}
    assert sensors.monitor_values(own_clock(9, 2.0, 4)) == {"gap": Reading(2.0, 5 * TICK)}


def test_noise_and_latency_add_to_a_reading_of_its_own_clock() -> None:
    sensors = Sensors(0, {"gap": SensorModel(noise=0.5)})
    seen = sensors.read(own_clock(9, 2.0, 4))["gap"]
    assert seen.time == 5 * TICK
    assert seen.value != 2.0
    late = Sensors(0, {"gap": SensorModel(latency=3 * TICK)})
    assert late.read(own_clock(0, 1.0, 4))["gap"] == Reading(1.0, -7 * TICK)
    for tick in range(1, 6):
        late.sample(own_clock(tick, 1.0 + tick, 4))
    assert late.read(own_clock(6, 7.0, 4))["gap"] == Reading(4.0, -1 * TICK)
