"""Two skills under the reference site, of which one drives and one moves the arm, at the same time."""

from __future__ import annotations

from collections.abc import Mapping
from math import dist
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration, single_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Plant, StepHandle, StepRequest, StepResult, StepStatus
from aeros.runtime.records.replay import LogReplay
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunProtocol
from aeros.sim.physics import make_plant
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.runtime.together import asking

pytestmark = pytest.mark.physics

DRIVE = act("move_base", x=0.0, y=0.3, speed=0.2)
STOW = act("move_tool", target=(0.42, 0.3, 0.4), yaw=0.0, speed=0.45)


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    sink = Diagnostics()
    site = load_site(reference_site_path(), sink)
    assert site is not None
    loaded = load_ecm(Path(__file__).parent / "data" / "arm_and_base", site, sink)
    assert loaded is not None, list(sink)
    return Configuration(site, {"fetch_object": loaded.ecm}, {}, "c" * 64)


def run(
    configuration: Configuration, plant: Plant, log: Path, bodies: Mapping[str, list[Action]]
) -> dict[str, StepResult]:
    """Run the skills, all started at once, and check that the record replays."""

    def open_run(site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        return InProcessRun(asking(*bodies[skill.id]), inputs)

    audit = AuditLog(log)
    executor = Executor(configuration, CompiledGate(configuration, GateMode.COMPILED), plant, audit, open_run)
    names: dict[StepHandle, str] = {}
    for skill in bodies:
        started = executor.start(StepRequest("fetch_object", skill, {}))
        assert not isinstance(started, StepResult), started
        names[started] = skill
    results = {}
    for _ in bodies:
        ended = executor.wait()
        assert ended is not None
        results[names[ended.step]] = ended.result
    audit.close()
    replay = LogReplay(single_configuration(configuration))
    assert verify_log(log, lambda record, _: replay.replay_record(record)).is_sound
    assert replay.mismatches == []
    assert replay.matching_count > 0
    return results


def plant_of(kind: str, configuration: Configuration) -> Plant:
    if kind == "physics":
        return make_plant(shipped_scene("fetch"), 0)
    here = {"tool_position": (0.3, 0.0, 0.48), "base_position": (0.0, 0.0, 0.0)}
    return SymbolicPlant(configuration.site, configuration.modules, 0, here)


@pytest.mark.parametrize("kind", ["physics", "symbolic"])
def test_the_arm_is_stowed_while_the_base_drives(
    kind: str, configuration: Configuration, tmp_path: Path
) -> None:
    plant = plant_of(kind, configuration)
    bodies = {"drive": [DRIVE], "stow": [act("wait", duration=0.5), STOW]}
    results = run(configuration, plant, tmp_path / "audit.jsonl", bodies)
    assert [one.reason for one in results.values()] == ["", ""]
    assert {one.status for one in results.values()} == {StepStatus.FINISHED}
    values = plant.observe()
    assert dist(values["base_position"].value, (0.0, 0.3, 0.0)) < 1e-3
    assert dist(values["tool_position"].value, (0.42, 0.3, 0.4)) < 2e-3
    # One after the other, they would take a second more.
    assert plant.now() < 3.6
    plant.close()


def test_a_drive_that_would_carry_the_tool_off_is_denied_and_the_arm_goes_on(
    configuration: Configuration, tmp_path: Path
) -> None:
    plant = plant_of("physics", configuration)
    here = act("move_tool", target=(0.5, 0.1, 0.4), yaw=0.0, speed=0.2)
    results = run(configuration, plant, tmp_path / "audit.jsonl", {"stow": [here], "drive": [DRIVE]})
    assert results["stow"].status is StepStatus.FINISHED
    assert results["drive"].status is StepStatus.DENIED
    assert results["drive"].reason.startswith("AE761 target: the `move_tool` under way would end 300 mm from")
    plant.close()


def test_nobody_may_be_as_near_to_both_as_to_each(configuration: Configuration, tmp_path: Path) -> None:
    slow = {
        "drive": [act("move_base", x=0.0, y=0.3, speed=0.1)],
        "stow": [act("move_tool", target=(0.42, 0.3, 0.4), yaw=0.0, speed=0.1)],
    }
    near = {"tool_position": (0.3, 0.0, 0.48), "human_distance": 0.9}
    plant = SymbolicPlant(configuration.site, configuration.modules, 0, near)
    for skill, actions in slow.items():
        alone = run(configuration, plant, tmp_path / f"{skill}.jsonl", {skill: actions})
        assert alone[skill].status is StepStatus.FINISHED
    both = run(configuration, plant, tmp_path / "both.jsonl", slow)
    assert both["drive"].status is StepStatus.FINISHED
    assert both["stow"].reason.startswith("AE751 separation-of-both")
