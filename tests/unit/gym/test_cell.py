"""A request in the name of a skill replaces its code once, and nothing else; robots are refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import pytest

from aeros.gym.cell import RequestingRuns, TaskCell
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult
from aeros.session.module_settings import read_module_settings
from aeros.session.plant_factory import PlantSetupError
from aeros.skill import act
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT


def test_a_request_replaces_the_code_of_the_skills_in_its_block_alone() -> None:
    opened: list[str] = []

    def open_run(site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        opened.append("code")
        return cast(SkillRunProtocol, None)

    runs = RequestingRuns(open_run)
    nothing: Any = None
    look = act("look", camera="overhead")
    with runs.requesting(look):
        run = runs(nothing, nothing, nothing, {})
    assert run.resume({}, 1.0) == look
    assert run.resume({}, 1.0) == SkillRunResult(StepStatus.FINISHED, "")
    assert run.close() is None
    assert opened == []
    runs(nothing, nothing, nothing, {})
    with runs.requesting(None):
        runs(nothing, nothing, nothing, {})
    assert opened == ["code", "code"]


def open_cell(plant: str) -> TaskCell:
    modules, site = [ROOT / "ecms/make_dumplings"], reference_site_path()
    settings = read_module_settings(None, None)
    gate = GateMode.COMPILED
    return TaskCell(modules, site, settings, None, plant, gate, None, ideal_sensors=False, randomise=False)


def test_a_provided_robot_is_refused_before_it_is_opened() -> None:
    with pytest.raises(MisuseError, match="the plant `franka` runs in real time, as a robot does"):
        open_cell("franka")


def test_a_plant_that_nobody_provides_is_refused() -> None:
    with pytest.raises(PlantSetupError, match="no plant is called `frank`: did you mean `franka`"):
        open_cell("frank")
