"""The bus in one process: nobody waits for another, only its type passes, nothing is lost unsaid."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import (
    ExecuteSkillFeedback,
    ExecuteSkillGoal,
    ExecuteSkillResult,
    JointState,
    Message,
    String,
    Time,
    TriggerRequest,
    TriggerResponse,
)
from aeros.runtime.bus.port import Bus, BusError, GoalStatus, NoServerError

TRIGGER = (TriggerRequest, TriggerResponse)
EXECUTE = (ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult)
_LONG = 5.0
MAYBE: Any = "maybe"


@pytest.fixture
def bus() -> Bus:
    return InProcessBus()


# Topics.


@given(st.lists(st.text(max_size=3), max_size=30), st.integers(1, 8))
def test_the_newest_are_kept_in_order_and_the_rest_is_counted(texts: list[str], depth: int) -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/a", String, depth=depth)
    say = bus.publisher("/a", String)
    for text in texts:
        say.publish(String(text))
    kept = []
    while (message := heard.receive()) is not None:
        kept.append(message.data)
    assert kept == texts[-depth:]
    assert heard.dropped_count == len(texts) - len(kept)


def test_all_subscriptions_receive_and_closed_ones_do_not(bus: Bus) -> None:
    one, other = bus.subscribe("/a", String), bus.subscribe("/a", String)
    say = bus.publisher("/a", String)
    say.publish(String("x"))
    other.close()
    other.close()
    say.publish(String("y"))
    assert [one.receive(), one.receive(), one.receive()] == [String("x"), String("y"), None]
    assert [other.receive(), other.receive()] == [String("x"), None]


def test_a_late_subscriber_receives_only_the_last_latched_message(bus: Bus) -> None:
    for topic, latched in (("/kept", True), ("/gone", False)):
        say = bus.publisher(topic, String, latched=latched)
        say.publish(String("x"))
        say.publish(String("y"))
    assert [bus.subscribe("/kept", String).receive(), bus.subscribe("/gone", String).receive()] == [
        String("y"),
        None,
    ]


def test_a_listener_waits_until_something_is_published(bus: Bus) -> None:
    heard = bus.subscribe("/a", String)
    threading.Timer(0.05, lambda: bus.publisher("/a", String).publish(String("x"))).start()
    assert heard.receive(_LONG) == String("x")
    began = time.monotonic()
    assert heard.receive(0.05) is None
    assert time.monotonic() - began >= 0.05


@pytest.mark.parametrize(
    "message",
    [
        Time(),
        JointState(position=("x",)),  # type: ignore[arg-type]
        JointState(name=["a"]),  # type: ignore[arg-type]
        JointState(header=None),  # type: ignore[arg-type]
        "text",
        None,
    ],
)
def test_messages_that_ros_could_not_carry_are_refused(bus: Bus, message: Any) -> None:
    heard = bus.subscribe("/a", JointState)
    if message == JointState(name=["a"]):  # type: ignore[arg-type]
        bus.publisher("/a", JointState).publish(message)
        found = heard.receive()
        assert found is not None
        assert found.name == ("a",)  # a list that somebody could change became a tuple
        return
    with pytest.raises(BusError):
        bus.publisher("/a", JointState).publish(message)
    assert heard.receive() is None


@pytest.mark.parametrize("message", [Time(2**31), Time(0, 10**9), Time(0, -1), Time(1.5)])  # type: ignore[arg-type]
def test_numbers_out_of_the_range_of_their_type_are_refused(bus: Bus, message: Time) -> None:
    with pytest.raises(BusError, match="not a valid builtin_interfaces/msg/Time"):
        bus.publisher("/a", Time).publish(message)


def test_a_name_has_one_type_and_follows_the_rules(bus: Bus) -> None:
    bus.subscribe("/a", String)
    with pytest.raises(BusError, match="is of type std_msgs/msg/String"):
        bus.publisher("/a", Time)
    with pytest.raises(BusError, match="not an absolute ROS 2 name"):
        bus.subscribe("a b", String)
    bus.serve("/b", TRIGGER, lambda _: TriggerResponse())
    assert bus.names() == {"/a": "std_msgs/msg/String", "/b": "std_srvs/srv/Trigger_Request"}


# Services.


def test_a_service_answers_until_it_is_withdrawn(bus: Bus) -> None:
    with pytest.raises(NoServerError):
        bus.call("/stop", TRIGGER, TriggerRequest())
    leave = bus.serve("/stop", TRIGGER, lambda _: TriggerResponse(True, "it stands"))
    assert bus.call("/stop", TRIGGER, TriggerRequest()) == TriggerResponse(True, "it stands")
    with pytest.raises(BusError, match="has a server already"):
        bus.serve("/stop", TRIGGER, lambda _: TriggerResponse())
    leave()
    leave()
    with pytest.raises(NoServerError):
        bus.call("/stop", TRIGGER, TriggerRequest())


@pytest.mark.parametrize("wrong", [lambda _: None, lambda _: TriggerResponse(MAYBE), lambda _: String()])
def test_an_answer_of_another_type_is_none(bus: Bus, wrong: Callable[[Any], Any]) -> None:
    bus.serve("/stop", TRIGGER, wrong)
    with pytest.raises(BusError, match="std_srvs/srv/Trigger_Response"):
        bus.call("/stop", TRIGGER, TriggerRequest())


# Actions.


def test_a_goal_is_accepted_gives_feedback_and_ends(bus: Bus) -> None:
    server = bus.serve_action("/do", EXECUTE)
    wanted = bus.send_goal("/do", EXECUTE, ExecuteSkillGoal("tidy", "rest"))
    stood = [wanted.status]
    taken = server.next_goal()
    assert taken is not None
    assert taken.goal.module == "tidy"
    stood += [taken.status, wanted.status]
    assert stood == [GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.EXECUTING]
    for allowed in (1, 2):
        taken.send_feedback(ExecuteSkillFeedback(allowed))
    assert [wanted.feedback(), wanted.feedback()] == [ExecuteSkillFeedback(2), None]
    with pytest.raises(NoServerError, match="EXECUTING"):
        wanted.result(0.01)
    taken.set_result(GoalStatus.SUCCEEDED, ExecuteSkillResult("finished"))
    assert (wanted.result(0), wanted.status) == (ExecuteSkillResult("finished"), GoalStatus.SUCCEEDED)
    with pytest.raises(BusError, match="already"):
        taken.set_result(GoalStatus.ABORTED, ExecuteSkillResult())
    wanted.cancel()
    assert wanted.result(0) == ExecuteSkillResult("finished")


def test_a_cancelled_goal_is_seen_to_be_so_and_ends_as_the_server_says(bus: Bus) -> None:
    server = bus.serve_action("/do", EXECUTE)
    wanted = bus.send_goal("/do", EXECUTE, ExecuteSkillGoal())
    wanted.cancel()
    taken = server.next_goal()
    assert taken is not None
    assert taken.status is GoalStatus.CANCELING
    with pytest.raises(BusError, match="does not end a goal"):
        taken.set_result(GoalStatus.EXECUTING, ExecuteSkillResult())
    taken.set_result(GoalStatus.CANCELED, ExecuteSkillResult("cancelled"))
    assert wanted.result(0).status == "cancelled"


def test_goals_wait_in_turn_and_too_many_are_refused(bus: Bus) -> None:
    server = bus.serve_action("/do", EXECUTE, waiting=2)
    for module in ("a", "b"):
        bus.send_goal("/do", EXECUTE, ExecuteSkillGoal(module))
    with pytest.raises(BusError, match="2 goals waiting"):
        bus.send_goal("/do", EXECUTE, ExecuteSkillGoal("c"))
    taken = [server.next_goal(), server.next_goal(), server.next_goal()]
    assert [one.goal.module if one else None for one in taken] == ["a", "b", None]


def test_closing_aborts_unfinished_goals(bus: Bus) -> None:
    server = bus.serve_action("/do", EXECUTE)
    goals = [bus.send_goal("/do", EXECUTE, ExecuteSkillGoal()) for _ in range(3)]
    ended = server.next_goal()
    assert ended is not None
    ended.set_result(GoalStatus.SUCCEEDED, ExecuteSkillResult("finished"))
    server.next_goal()
    server.close()
    server.close()
    assert [goal.status for goal in goals] == [GoalStatus.SUCCEEDED, *[GoalStatus.ABORTED] * 2]
    assert goals[1].result(0) == ExecuteSkillResult()
    with pytest.raises(NoServerError, match="no server offers the action"):
        bus.send_goal("/do", EXECUTE, ExecuteSkillGoal())


def test_many_threads_lose_nothing_unsaid(bus: Bus) -> None:
    heard = [bus.subscribe("/a", String, depth=10_000) for _ in range(2)]

    def speak(who: int) -> None:
        say = bus.publisher("/a", String)
        for number in range(200):
            say.publish(String(f"{who} {number}"))

    threads = [threading.Thread(target=speak, args=(who,)) for who in range(4)]
    for thread in threads:
        thread.start()
    got: list[list[Message]] = [[], []]
    for mine, listener in zip(got, heard, strict=True):
        while len(mine) < 800:
            message = listener.receive(_LONG)
            assert message is not None
            mine.append(message)
    for thread in threads:
        thread.join()
    assert got[0] == got[1]  # one order for all
    for who in range(4):
        expected = [one.data for one in got[0] if isinstance(one, String) and one.data.startswith(f"{who} ")]
        assert expected == [f"{who} {number}" for number in range(200)]
    assert [one.dropped_count for one in heard] == [0, 0]
