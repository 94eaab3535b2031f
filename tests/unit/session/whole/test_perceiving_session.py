"""Whole sessions of a module with perceivers of its own: from a picture to a goal, and with hostile code."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.perception import perceiving_plant
from aeros.runtime.perception.open_perceiver import open_by_policy
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.session.assembly import SessionSetup, build_executor, open_agent, open_recorded_plant
from aeros.session.plant_factory import open_plant
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.perception.kettle import CameraPlant, Scripted, configuration, kettle

MODULE = Path(__file__).parents[1] / "data" / "point_at_cube"


def proved(folder: Path) -> Configuration:
    return prove_configuration([folder], reference_site_path(), certified=False)[0]


def records(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


DEFINED = """\
  hand_over_cube:
    type: bool
    max_age: 60 s
    definition: >-
      abs(tool_position.x - cube_position.x) < 8 mm and abs(tool_position.y - cube_position.y) < 8 mm
      and tool_position.z - cube_position.z > 50 mm and tool_position.z - cube_position.z < 150 mm
"""
"""The predicate of `hand_view`, as a condition in place of a perceiver."""


def module_with_a_definition(folder: Path) -> Path:
    """The module without `hand_view`."""
    shutil.copytree(MODULE, folder)
    manifest = folder / "ecm.yaml"
    lines = manifest.read_text().splitlines(keepends=True)
    first, last = (lines.index(line) for line in ("  hand_view:\n", "capabilities:\n"))
    text = "".join([*lines[:first], "\n", *lines[last:]])
    (declared,) = (line for line in lines if line.startswith("  hand_over_cube:"))
    manifest.write_text(text.replace(declared, DEFINED))
    return folder


@pytest.mark.physics
@pytest.mark.parametrize("is_defined", [False, True])
def test_a_predicate_that_a_module_sees_is_its_precondition_and_its_goal(
    *, is_defined: bool, tmp_path: Path
) -> None:
    folder = module_with_a_definition(tmp_path / "point_at_cube") if is_defined else MODULE
    configured = proved(folder)
    assert set(configured.modules["point_at_cube"].perceivers) == (
        {"cube_view"} if is_defined else {"cube_view", "hand_view"}
    )
    task = configured.modules["point_at_cube"].tasks["point"]
    setup = SessionSetup(
        configuration=configured,
        open_plant=lambda observe: open_plant("physics", configured, task, 0),
        out=tmp_path,
        state=None,
        warn=lambda text: None,
        gate_mode=GateMode.COMPILED,
    )
    with (
        open_recorded_plant(setup) as recorded,
        open_agent(setup, recorded, FixedGovernor(configured)) as session,
    ):
        assert session.agent.run("point at the cube").reached
        seen = session.executor.observe()["point_at_cube.hand_over_cube"]
    assert seen.value is True
    assert verify_log(tmp_path / "audit.jsonl").is_sound
    text = (tmp_path / "audit.jsonl").read_text()
    assert '"point_at_cube.cube_seen":[true,0.0]' in text
    assert "perceiver-failed" not in text
    assert "point_at_cube.hand_over_cube" in (tmp_path / "measured.jsonl").read_text()


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("while True:\n        pass\n    yield {}", "did not answer within"),
        ("view = yield {'cube_position': estimate((9.0, 0.0, 0.0), 0.001)}", "is outside -2 m to 2 m"),
        ("view = yield {'cube_seen': True, 'human' + '_distance': 9.0}", "which it does not provide"),
        ("view = yield {str(n): 1.0 for n in range(300)}", "yielded 300 values; at most 256"),
    ],
)  # fmt: skip
def test_values_of_a_hostile_perceiver_are_unknown_and_the_record_says_why(
    body: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(perceiving_plant, "SIMULATED_TIMEOUT_S", 1.0)
    folder = tmp_path / "point_at_cube"
    shutil.copytree(MODULE, folder)
    code = f"from aeros.perception import estimate\n\n\ndef see_cube(view):\n    {body}\n"
    others = "\n\ndef see_hand(view):\n    while True:\n        view = yield {'hand_over_cube': True}\n"
    (folder / "perceivers.py").write_text(code + others)
    configured = proved(folder)
    plant = CameraPlant()
    plant.take()
    with (
        SkillRunFactory(configured.site, configured.modules.values()) as skills,
        AuditLog(tmp_path / "audit.jsonl") as audit,
        build_executor(configured, plant, audit, skills, open_perceiver=open_by_policy(skills)) as executor,
    ):
        observed = executor.observe()
    # The other perceiver of the module is not disturbed.
    assert observed["point_at_cube.hand_over_cube"] == Reading(True, 0.0)
    assert {"point_at_cube.cube_seen", "point_at_cube.cube_position"}.isdisjoint(observed)
    (failure,) = [one for one in records(tmp_path / "audit.jsonl") if one["event"] == "perceiver-failed"]
    assert why in failure["details"]["reason"]
    assert failure["details"]["perceiver"] == "cube_view"
    assert verify_log(tmp_path / "audit.jsonl").is_sound


def test_perceivers_end_with_the_executor_and_without_them_the_plant_is_not_wrapped(tmp_path: Path) -> None:
    plant, runs = CameraPlant(), Scripted({"water_hot": True})
    plant.take()
    with_one = configuration(kettle())
    for configured, opened in ((with_one, 1), (replace(with_one, modules={}), 0)):
        runs.opened = runs.closed = 0
        with (
            AuditLog(tmp_path / f"{opened}.jsonl") as audit,
            build_executor(configured, plant, audit, run_in_process, open_perceiver=runs) as executor,
        ):
            assert ("kettle.water_hot" in executor.observe()) == bool(opened)
            assert (executor._plant is plant) == (not opened)
        assert (runs.opened, runs.closed) == (opened, opened)
