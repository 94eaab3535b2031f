"""Pause, resume and stop on the bus do to a run what the commands of those names do."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditError
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import TriggerRequest, TriggerResponse
from aeros.runtime.bus.operator_services import (
    OPERATOR_REQUEST,
    TRIGGER,
    OperatorRequests,
    serve_operator_commands,
)
from aeros.runtime.bus.port import NoServerError, Requester
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry import control_page as module
from aeros.runtime.registry.control_page import ControlPage, request_command
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from tests.unit.runtime.registry.support.fixed_modules import FixedModules
from tests.unit.runtime.together import Cart, asking, configuration, move

_LONG = 10.0


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[InProcessBus]:
    bus = InProcessBus()
    with serve_operator_commands(bus, OperatorRequests(tmp_path)):
        yield bus


def ask(bus: InProcessBus, what: str) -> TriggerResponse:
    return bus.call(f"/aeros/{what}", TRIGGER, TriggerRequest())


@pytest.mark.parametrize(
    ("what", "command"),
    [("pause", OperatorCommand.PAUSE), ("resume", OperatorCommand.RUN), ("stop", OperatorCommand.STOP)],
)
def test_each_service_has_the_effect_of_its_command(
    what: str, command: OperatorCommand, bus: InProcessBus, tmp_path: Path
) -> None:
    with ControlPage(tmp_path) as live:
        assert ask(bus, what).success
        assert live.command is command


def test_while_something_moves_no_rest_is_reported(
    bus: InProcessBus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_WAIT_TIMEOUT_S", 0.05)
    with ControlPage(tmp_path) as live, live.hold_generation(live.generation):
        response = ask(bus, "stop")
        assert not response.success
        assert response.message == "still moving after 0.05 s; use the robot's emergency stop"
        assert not ask(bus, "resume").success


def test_a_run_that_cannot_be_reached_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    bus = InProcessBus()
    with serve_operator_commands(bus, OperatorRequests(tmp_path / "file")):
        response = ask(bus, "stop")
    assert not response.success
    assert response.message.startswith("the run cannot be reached")


def test_services_are_withdrawn_after_the_block(tmp_path: Path) -> None:
    bus = InProcessBus()
    with serve_operator_commands(bus, OperatorRequests(tmp_path)):
        pass
    with pytest.raises(NoServerError):
        ask(bus, "stop")


def test_a_run_pauses_resumes_and_stops(tmp_path: Path) -> None:
    registry = Registry(tmp_path / "state")
    bus = InProcessBus()
    with (
        RegistryGovernor(registry, FixedModules(configuration())) as governor,
        serve_operator_commands(bus, OperatorRequests(registry.folder)),
    ):
        cart = Cart(tmp_path / "audit.jsonl", {"reach": asking(move(), move())}, governor=governor)
        step = cart.start("reach")
        assert ask(bus, "pause").success
        ended: list[str] = []
        thread = threading.Thread(target=lambda: ended.append(cart.ends(1)[step].reason))
        thread.start()
        thread.join(0.1)
        assert (cart.started_kinds(), ended) == ([], [])
        assert ask(bus, "stop").success
        thread.join(_LONG)
        assert (cart.started_kinds(), ended) == ([], ["stopped by the operator"])
        assert not ask(bus, "resume").success
        request_command(registry.folder, OperatorCommand.RUN)
        cart.start("reach")
        assert [one.status.value for one in cart.ends(1).values()] == ["finished"]
        assert [len(cart.records(name)) for name in ("paused", "resumed")] == [1, 1]
        cart.audit.close()


PLANNER = Requester("/planner", "01ff")


def clients() -> tuple[Requester, ...]:
    return (PLANNER,)


def test_a_resume_is_recorded_before_it_is_given_and_a_pause_after(tmp_path: Path) -> None:
    requests = OperatorRequests(tmp_path)
    recorded: list[tuple[str, Mapping[str, Any], OperatorCommand]] = []
    with ControlPage(tmp_path) as live:
        requests.open_record(lambda event, details: recorded.append((event, details, live.command)))
        assert requests.request(OperatorCommand.PAUSE, "/aeros/pause", clients) is None
        assert live.command.name == "PAUSE"
        assert requests.request(OperatorCommand.RUN, "/aeros/resume", tuple) is None
        assert live.command.name == "RUN"
    details = {
        "command": "pause",
        "service": "/aeros/pause",
        "clients": [{"node": "/planner", "guid": "01ff"}],
    }
    lifted = {"command": "run", "service": "/aeros/resume", "clients": []}
    assert recorded == [
        (OPERATOR_REQUEST, details, OperatorCommand.PAUSE),
        (OPERATOR_REQUEST, lifted, OperatorCommand.PAUSE),
    ]


def test_a_log_that_cannot_be_written_keeps_no_stop_back_and_lets_nothing_start(tmp_path: Path) -> None:
    def broken(event: str, details: Mapping[str, Any]) -> None:
        raise AuditError("the disk is full")

    requests = OperatorRequests(tmp_path)
    requests.open_record(broken)
    with ControlPage(tmp_path) as live:
        assert requests.request(OperatorCommand.PAUSE, "/aeros/pause", clients) is None
        refused = requests.request(OperatorCommand.RUN, "/aeros/resume", clients)
        assert refused == "it cannot be recorded: the disk is full"
        assert live.command.name == "PAUSE"
        assert requests.request(OperatorCommand.STOP, "/aeros/stop", clients) is None
        assert live.command.name == "STOP"


def test_a_stop_wins_over_every_later_resume_of_a_peer(tmp_path: Path) -> None:
    requests = OperatorRequests(tmp_path)
    with ControlPage(tmp_path) as live:
        assert requests.request(OperatorCommand.STOP, "/aeros/stop", clients) is None
        for _ in range(3):
            refused = requests.request(OperatorCommand.RUN, "/aeros/resume", clients)
            assert refused == "a stop stands: `aeros resume` at the robot lifts it"
        assert live.command.name == "STOP"


def test_a_request_before_the_log_is_open_is_recorded_once_it_is(tmp_path: Path) -> None:
    requests = OperatorRequests(tmp_path)
    recorded: list[str] = []
    assert requests.request(OperatorCommand.STOP, "/aeros/stop", clients) is None
    requests.open_record(lambda _, details: recorded.append(details["service"]))
    requests.open_record(lambda _, details: recorded.append(details["service"]))
    assert recorded == ["/aeros/stop"]


def test_a_stop_after_the_log_is_closed_is_still_obeyed(tmp_path: Path) -> None:
    requests = OperatorRequests(tmp_path)
    recorded: list[str] = []
    requests.open_record(lambda event, _: recorded.append(event))
    requests.close_record()
    with ControlPage(tmp_path) as live:
        assert requests.request(OperatorCommand.STOP, "/aeros/stop", clients) is None
        assert live.command.name == "STOP"
    assert recorded == []
