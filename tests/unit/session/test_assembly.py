"""A whole session on the symbolic plant: who hears of what, and in which order things are closed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.execution.journal import AgentEvent, Observer
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Plant, Readings
from aeros.runtime.proving import prove_configuration
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.session.assembly import SessionSetup, build_executor, open_agent, open_recorded_plant
from aeros.session.plant_factory import open_plant
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.unit.runtime.perception.kettle import CameraPlant, Scripted, kettle
from tests.unit.runtime.perception.kettle import configuration as kettle_configuration


class Ear:
    """A listener that counts."""

    def __init__(self) -> None:
        self.ticks = self.observations = 0

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        self.ticks += 1

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        self.observations += 1


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return prove_configuration([ROOT / "ecms" / "clean_table"], reference_site_path(), certified=True)[0]


def test_every_listener_hears_the_same_and_all_is_closed_in_order(
    configuration: Configuration, tmp_path: Path
) -> None:
    task = configuration.modules["clean_table"].tasks["clean_table"]
    steps: list[str] = []
    events: list[AgentEvent] = []

    @contextmanager
    def opened(observe: Observer) -> Iterator[Plant]:
        observe(AgentEvent("fault-started", "", {}, 0.0))
        with open_plant("symbolic", configuration, task, 0) as plant:
            yield plant
        steps.append(f"plant closed, {verify_log(tmp_path / 'audit.jsonl').records > 0}")

    ears = Ear(), Ear()
    setup = SessionSetup(
        configuration=configuration,
        open_plant=opened,
        out=tmp_path,
        state=None,
        warn=steps.append,
        on_event=events.append,
        listeners=ears,
    )
    with open_recorded_plant(setup) as recorded:
        with open_agent(setup, recorded, FixedGovernor(configuration)) as (executor, agent, _):
            assert agent.run("clean the table").reached
            assert executor.site == configuration.site
        steps.append("agent closed")
    assert steps == ["agent closed", "plant closed, True"]
    assert ears[0].ticks == ears[1].ticks > 0
    assert ears[0].observations == ears[1].observations > 0
    assert [events[0].kind, events[-1].kind] == ["fault-started", "run-ended"]
    assert len((tmp_path / "trace.jsonl").read_text().splitlines()) == len(events)
    assert (tmp_path / "measured.jsonl").stat().st_size > 0
    report = verify_log(tmp_path / "audit.jsonl")
    assert report.is_sound
    assert '"event":"isolation"' in (tmp_path / "audit.jsonl").read_text()


def test_a_lost_memory_is_reported(configuration: Configuration, tmp_path: Path) -> None:
    message: list[str] = []
    state = tmp_path / "state"
    for number in range(4):
        setup = SessionSetup(
            configuration=configuration,
            open_plant=lambda _: open_plant(
                "symbolic", configuration, configuration.modules["clean_table"].tasks["clean_table"], 0
            ),
            out=tmp_path / str(number),
            state=state,
            warn=message.append,
        )
        setup.out.mkdir()
        with (
            open_recorded_plant(setup) as recorded,
            open_agent(setup, recorded, FixedGovernor(configuration)),
        ):
            pass
        if number != 1:
            (state / "memory.sqlite3").unlink()
    assert message == [
        f"the agent's memory {state}/memory.sqlite3 is gone, with what it learned in its earlier {lost}: "
        "a new one begins"
        for lost in ("session", "3 sessions")
    ]


@pytest.mark.parametrize("perceives_all", [False, True])
def test_an_agent_attends_to_some_modules_unless_a_recording_or_client_may_read_all(
    tmp_path: Path, *, perceives_all: bool
) -> None:
    plant = CameraPlant()
    plant.take()
    kettles = kettle_configuration(kettle())
    opened = Scripted({"water_hot": True})
    with (
        AuditLog(tmp_path / "audit.jsonl") as audit,
        build_executor(
            kettles, plant, audit, run_in_process, open_perceiver=opened, perceives_all=perceives_all
        ) as executor,
    ):
        assert "kettle.water_hot" in executor.observe()
        executor.attend(frozenset())
        assert ("kettle.water_hot" in executor.observe()) == perceives_all
        executor.attend(None)
        assert "kettle.water_hot" in executor.observe()
