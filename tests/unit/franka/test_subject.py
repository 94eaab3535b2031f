from pathlib import Path

import pytest

from aeros.franka.subject import franka_subject
from aeros.sim.conformance.suite import CHECKS, Check
from aeros.wired_arm.process import ProcessError
from tests.unit.franka.stub.arms import use_stub
from tests.unit.franka.test_settings import CELL

BOUND = "period: 5 ms, in_a_row: 3, longest: 20 ms"


def patient_cell(folder: Path) -> Path:
    """The cell with a monitor that may be late by half a second, as other tests run meanwhile."""
    file = folder / "patient_cell.yaml"
    text = CELL.read_text().replace(BOUND, "period: 500 ms, in_a_row: 3, longest: 500 ms")
    file.write_text(text.replace("missing: refuse", "missing: warn"), encoding="utf-8")
    return file


@pytest.fixture(autouse=True)
def _stub(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    use_stub(monkeypatch)
    monkeypatch.setenv("AEROS_FRANKA", "stub")
    monkeypatch.setenv("AEROS_FRANKA_REALTIME", "ignore")
    monkeypatch.setenv("AEROS_FRANKA_SITE", str(patient_cell(tmp_path)))


@pytest.mark.parametrize("check", [one for one in CHECKS if one.__name__ == "close_is_idempotent"])
def test_a_promise_is_kept(check: Check) -> None:
    check(franka_subject())


@pytest.mark.deep
@pytest.mark.parametrize("check", CHECKS, ids=lambda one: one.__name__)
def test_every_promise_is_kept(check: Check) -> None:
    check(franka_subject())


def test_without_a_robot_the_subject_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    use_stub(monkeypatch, refuses="libfranka: Connection timeout")
    with pytest.raises(ProcessError, match="Connection timeout"):
        franka_subject().make_plant()
