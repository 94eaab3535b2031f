"""A hosted plant stops whenever nobody commands it, and serves the next client."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import Plant, RobotBody, Trajectory
from aeros.sim.fake import FakePlant
from aeros.sim.hosting.host import HostLog, PlantHost
from aeros.sim.hosting.remote import RemotePlant
from aeros.sim.hosting.wire import ConnectionLostError
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.hosting.hosted import Hosting, once_it_listens

REACH = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)

MOVING = """
import sys, time
from pathlib import Path
from aeros.sim.hosting.remote import RemotePlant
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
plant = RemotePlant(Path(sys.argv[1]))
action = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)
ticks = 0
def monitor(now, measured):
    global ticks
    ticks += 1
    if ticks == 60:
        print("moving", max(map(abs, measured["joint_velocity"])), flush=True)
        time.sleep(float(sys.argv[2]))
    return None
plant.skill_began("module.skill")
plant.begin(action, plant.plan(action))
plant.advance(monitor, 100.0)
print("ended", flush=True)
"""


def kinematic() -> Plant:
    return make_plant(shipped_scene("bare"), 0)


def mover(hosting: Hosting, sleeps: float) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", MOVING, str(hosting.path), str(sleeps)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def speed(measured: Mapping[str, Any]) -> float:
    return float(max(map(abs, measured["joint_velocity"])))


def test_kill_9_amid_a_motion_brings_it_to_rest_within_its_limits() -> None:
    hosting = Hosting(kinematic())
    with mover(hosting, 60.0) as agent:
        assert agent.stdout is not None
        word, moving_at = agent.stdout.readline().split()
        assert (word, float(moving_at) > 0.05) == ("moving", True)
        os.kill(agent.pid, signal.SIGKILL)
        let_go = hosting.until("agent-disconnected")
    assert let_go["amid_motion"]
    assert speed(let_go["measured"]) == 0.0
    # The next client finds it as it was left, and nothing has moved since.
    plant = hosting.join()
    assert plant.now() == let_go["time"]
    assert plant.observe()["joint_position"].value == tuple(let_go["measured"]["joint_position"])
    moved = plant.begin(REACH, plant.plan(REACH))
    assert isinstance(moved, int)
    assert plant.advance(lambda now, measured: None, 100.0)[moved].completed
    plant.shut_down_host()
    hosting.thread.join(20.0)
    assert hosting.events() == [
        "agent-connected",
        "skill-began",
        "agent-disconnected",
        "agent-connected",
        "host-ended",
    ]


def test_an_agent_that_hangs_is_given_up_and_cannot_go_on() -> None:
    hosting = Hosting(kinematic(), patience=0.3)
    with mover(hosting, 2.0) as agent:
        assert agent.stdout is not None
        assert agent.stdout.readline().startswith("moving")
        let_go = hosting.until("agent-disconnected")
        assert speed(let_go["measured"]) == 0.0
        rest = agent.stdout.read()
    assert "ended" not in rest
    assert agent.returncode == 1
    plant = hosting.join()
    assert plant.now() == let_go["time"]
    plant.shut_down_host()


def test_between_two_actions_an_agent_may_think() -> None:
    hosting = Hosting(kinematic(), patience=0.05)
    plant = hosting.join()
    time.sleep(0.3)
    before = plant.now()
    time.sleep(0.3)
    assert plant.now() == before
    plant.shut_down_host()


def test_an_agent_that_hangs_without_a_watchdog_is_given_up_and_the_host_ends(tmp_path: Path) -> None:
    events: list[Mapping[str, Any]] = []
    watched = [True, True, False]
    host = PlantHost(FakePlant(), events.append, 5.0, 0.05, lambda: watched.pop(0))
    serving = threading.Thread(target=host.serve, args=(tmp_path / "plant",))
    serving.start()
    plant = once_it_listens(lambda: RemotePlant(tmp_path / "plant"))
    serving.join(20.0)
    assert not serving.is_alive()
    assert watched == []
    whys = [one["why"] for one in events if one["event"] == "agent-disconnected"]
    assert whys == ["the agent was silent for 0.05 s, and no watchdog is left to end it"]
    plant.close()


def test_a_host_is_watched_as_long_as_the_process_that_started_it_lives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    host = PlantHost(FakePlant(), lambda _: None)
    assert host._is_watched()
    monkeypatch.setattr(os, "getppid", lambda: 1)
    assert not host._is_watched()


def test_a_malformed_message_ends_the_connection_and_not_the_plant() -> None:
    hosting = Hosting(kinematic())
    for message in ({"do": "explode"}, {"do": "plan"}, {"do": "halt", "motion": 99}, {"no": "thing"}):
        plant = hosting.join()
        plant._channel.send(message)
        with pytest.raises(ConnectionLostError):
            plant.now()
        plant.close()
    plant = hosting.join()
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    plant.shut_down_host()
    hosting.thread.join(20.0)
    assert hosting.events().count("agent-disconnected") == 4


def test_a_host_without_clients_ends() -> None:
    hosting = Hosting(kinematic(), linger=0.1)
    hosting.thread.join(20.0)
    assert not hosting.thread.is_alive()
    assert not hosting.path.exists()


# On a plant with scripted answers.


def ask(plant: RemotePlant, **message: Any) -> Any:
    plant._channel.send(message)
    return plant._channel.receive()["is"]


def test_skills_that_are_under_way_end_with_their_agent_and_others_do_not() -> None:
    fake = FakePlant({"near": 1.5})
    hosting = Hosting(fake)
    plant = hosting.join()
    plant.skill_began("m.a")
    plant.skill_began("m.b")
    plant.skill_ended("m.a", finished=True)
    plant.close()
    let_go = hosting.until("agent-disconnected")
    assert (let_go["why"], let_go["amid_motion"]) == ("connection closed by peer", False)
    assert let_go["measured"] == {"near": 1.5}
    assert fake.calls[-2:] == [("stop",), ("skill_ended", "m.b", False)]
    other = hosting.join()
    other.close()
    hosting.until("agent-disconnected")
    last = hosting.join()
    last.shut_down_host()
    hosting.thread.join(20.0)
    assert fake.call_count("skill_ended") == 2
    assert fake.calls[-1] == ("close",)


def test_events_are_reported_with_their_measurements() -> None:
    fake = FakePlant({"near": 1.5})
    fake.time = 4.0
    hosting = Hosting(fake)
    plant = hosting.join()
    plant.skill_began("m.a")
    fake.values["near"] = 0.5
    plant.skill_ended("m.a", finished=True)
    plant.shut_down_host()
    hosting.thread.join(20.0)
    assert hosting.notes == [
        {"event": "agent-connected", "time": 4.0, "measured": {"near": 1.5}},
        {"event": "skill-began", "time": 4.0, "skill": "m.a", "measured": {"near": 1.5}},
        {"event": "skill-ended", "time": 4.0, "skill": "m.a", "finished": True, "measured": {"near": 0.5}},
        {"event": "host-ended", "time": 4.0, "measured": {"near": 0.5}},
    ]
    assert fake.calls[-2:] == [("stop",), ("close",)]


def test_plans_have_numbers_and_a_body_is_sent_when_it_changes() -> None:
    fake = FakePlant()
    body = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.0), ())
    fake.planned = Trajectory(body, ((((0.0,),) * 4,),), (0.0,) * 3, (0.0,) * 3, 1.0)
    hosting = Hosting(fake)
    plant = hosting.join()
    first = ask(plant, do="plan", kind="move", parameters={})
    assert (first["number"], first["body"]["tool"]) == (1, [0.5, 0.0, 0.0])
    second = ask(plant, do="plan", kind="move", parameters={})
    assert (second["number"], "body" in second) == (2, False)
    assert ask(plant, do="begin", plan=1, kind="move", parameters={})["completed"] is False
    assert ask(plant, do="begin", plan=2, kind="move", parameters={}) == 1
    plant.close()
    again = hosting.join()
    assert "body" in ask(again, do="plan", kind="move", parameters={})
    again.shut_down_host()


def test_a_second_tick_after_the_agent_is_lost_is_not_asked_for() -> None:
    fake = FakePlant()
    fake.during = [{}, {}]
    hosting = Hosting(fake, patience=0.05)
    plant = hosting.join()
    plant.begin(REACH)
    plant._channel.send({"do": "advance", "until": 9.0})
    assert "tick" in plant._channel.receive()
    let_go = hosting.until("agent-disconnected")
    assert (let_go["why"], let_go["amid_motion"]) == ("the agent did not confirm a tick in time", True)
    plant.close()
    hosting.join().shut_down_host()


def test_a_log_is_a_line_of_json_for_each_event(tmp_path: Path) -> None:
    log = HostLog(tmp_path / "host.jsonl")
    log({"event": "agent-connected", "measured": {"q": (1.0, np.float64(0.5))}})
    log({"event": "host-ended"})
    lines = (tmp_path / "host.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == [
        {"schema": "aeros/plant-log/2", "event": "agent-connected", "measured": {"q": [1.0, 0.5]}},
        {"schema": "aeros/plant-log/2", "event": "host-ended"},
    ]


def test_a_socket_that_was_left_behind_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "plant.sock"
    path.write_text("left behind")
    PlantHost(FakePlant(), lambda event: None, linger=0.01).serve(path)
    assert not path.exists()
