"""Observations and every control tick have a topic's reading in place of the plant's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from aeros.runtime.bus.ros2.sensed_plant import SensedPlant
from aeros.runtime.bus.ros2.topic_sensors import TopicSensor
from aeros.runtime.ports import Reading, announce_stop


class Ticking:
    """Plant that measures a distance of 20 m at each tick, and stops by itself at the last."""

    def now(self) -> float:
        return 1.0

    def observe(self) -> Any:
        return {"d": Reading(20.0, 1.0), "q": Reading(0.5, 1.0)}

    def advance(self, monitor: Any, until: float) -> Any:
        self.answer = monitor(1.5, {"d": 20.0, "q": 0.5})
        announce_stop(monitor, "blocked", 2.0)
        return {}


class Recording:
    """Monitor that keeps its calls and always stops."""

    def __init__(self) -> None:
        self.calls: list[Any] = []

    def __call__(self, now: float, measured: Any) -> str | None:
        self.calls.append((now, measured))
        return "separation"

    def begin_stop(self, reason: str, now: float) -> None:
        self.calls.append((now, reason))


def sensed(plant: Any, sleep: Any = lambda _: None) -> SensedPlant:
    sensor = TopicSensor("d", "/d", "std_msgs/msg/Float64", lambda: 0.0)
    sensor.receive(SimpleNamespace(data=2.0), now=0.0)
    return SensedPlant(plant, [sensor], sleep)


def test_an_observation_has_the_reading_of_the_topic() -> None:
    assert sensed(Ticking()).observe() == {"d": Reading(2.0, 1.0), "q": Reading(0.5, 1.0)}


def test_the_monitor_gets_it_at_every_tick_and_its_answer_counts() -> None:
    plant, monitor = Ticking(), Recording()
    sensed(plant).advance(monitor, 2.0)
    assert monitor.calls == [(1.5, {"d": Reading(2.0, 1.5), "q": 0.5}), (2.0, "blocked")]
    assert plant.answer == "separation"


def test_a_simulator_waits_for_real_time_and_a_robot_does_not() -> None:
    waits: list[float] = []
    sensed(Ticking(), waits.append).advance(Recording(), 2.0)
    assert len(waits) == 1
    assert 0.4 < waits[0] <= 0.5
    robot = Ticking()
    robot.runs_in_real_time = True  # type: ignore[attr-defined]
    sensed(robot, waits.append).advance(Recording(), 2.0)
    assert len(waits) == 1


class Idling:
    """Plant in which nothing moves: time passes at once, without a tick."""

    def __init__(self) -> None:
        self.time = 1.0

    def now(self) -> float:
        return self.time

    def observe(self) -> Any:
        return {}

    def advance(self, _monitor: Any, until: float) -> Any:
        self.time = until
        return {}


def test_a_message_that_comes_while_nothing_moves_is_fresh_after_the_wait() -> None:
    sensor = TopicSensor("d", "/d", "std_msgs/msg/Float64", lambda: 0.0)
    sensor.receive(SimpleNamespace(data=2.0), now=0.0)
    waits: list[float] = []

    def sleep(seconds: float) -> None:
        waits.append(seconds)
        sensor.receive(SimpleNamespace(data=3.0), now=0.0)

    plant = SensedPlant(Idling(), [sensor], sleep)  # type: ignore[arg-type]
    assert plant.observe() == {"d": Reading(2.0, 1.0)}
    assert plant.observe() == {"d": Reading(2.0, 1.0)}
    plant.advance(Recording(), 2.0)
    assert len(waits) == 1
    assert 0.9 < waits[0] <= 1.0
    assert plant.observe() == {"d": Reading(3.0, 2.0)}
