"""Sessions as programs open them: one run at a time, and nothing left behind that was not asked for."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path

import pytest

import aeros
import aeros.api
from aeros.agent.errors import AgentError
from aeros.session.plant_factory import PlantSetupError
from aeros.sim.fake import FakePlant
from aeros.spec.diagnostics.errors import MisuseError
from tests.repo.tree import ROOT

_CLEAN = "clean the table"


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("api")
    shutil.copytree(ROOT / "ecms", folder / "ecms")
    return folder


@pytest.fixture(autouse=True)
def _where_modules_are(modules: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(modules)


def test_an_output_folder_that_holds_something_is_refused() -> None:
    with pytest.raises(PlantSetupError, match="`ecms` is not empty"), aeros.open_session("ecms", out="ecms"):
        pass


def test_leaving_the_events_early_stops_the_robot_for_good() -> None:
    before = threading.active_count()
    with aeros.open_session("ecms/clean_table") as session:
        for event in session.events(_CLEAN):
            if event.kind == "plan-accepted":
                break
        assert session.report is None
        result = session.run(_CLEAN)
        assert not result.reached
        assert "stopped by the operator" in str(result.reason)
    assert threading.active_count() == before


def test_one_run_at_a_time() -> None:
    with aeros.open_session("ecms/clean_table") as session:
        events = session.events(_CLEAN)
        next(events)
        with pytest.raises(MisuseError, match="a run is under way"):
            session.run(_CLEAN)
        assert [event.kind for event in events][-1] == "run-ended"
        assert session.report is not None
        assert session.report.reached


def test_the_agent_of_a_state_folder_remembers(tmp_path: Path) -> None:
    for sessions in (1, 2):
        with aeros.open_session(
            "ecms/clean_table", state=tmp_path / "state", out=tmp_path / f"{sessions}"
        ) as one:
            assert one.run(_CLEAN).reached
    assert '"sessions": 2' in (tmp_path / "state" / "identity.json").read_text()
    assert {path.name for path in (tmp_path / "1").iterdir()} == {
        "audit.jsonl",
        "trace.jsonl",
        "measured.jsonl",
    }


def test_nothing_is_left_where_no_folder_is_given() -> None:
    with aeros.open_session("ecms/clean_table") as session:
        session.run(_CLEAN)
        assert (session.out / "audit.jsonl").is_file()
    assert not session.out.exists()


def test_an_instruction_that_names_no_task_is_refused_before_the_plant_is_opened() -> None:
    with (
        aeros.open_session("ecms/clean_table", plant="physics") as session,
        pytest.raises(AgentError, match="no installed module provides `fly`"),
    ):
        session.run("fly")


def test_a_plant_that_was_given_is_not_closed() -> None:
    plant = FakePlant({"estop_pressed": True})
    with aeros.open_session("ecms/clean_table", plant=plant) as session:
        assert not session.run(_CLEAN, timeout=1.0).reached
    assert ("close",) not in plant.calls
