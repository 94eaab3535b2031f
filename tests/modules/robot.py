"""A plant with the perceivers of a shipped module, driven without gate or agent."""

from __future__ import annotations

import runpy
from functools import cache
from typing import Any

from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.execution.step import ObservationFilter
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.open_perceiver import open_in_process
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import MotionCompletion
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Skill
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import ECMS
from tests.unit.sim.acting import allow, execute


@cache
def configuration_of(module: str) -> Configuration:
    """The reference site with one shipped module, which nobody has proved."""
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    loaded = load_ecm(ECMS / module, site, diagnostics)
    assert loaded is not None
    return Configuration(site, {module: loaded.ecm}, {}, "")


def default_inputs(skill: Skill) -> dict[str, Any]:
    """The value that each of its inputs has if nobody gives one; only numbers are there."""
    return {name: float(one.default_value) for name, one in skill.inputs.items() if one.default_value}


class Robot:
    """A robot that perceives as a module does.

    Attributes:
        plant: the plant, with the perceivers of the module.
        failures: events of perceivers that failed.
    """

    def __init__(self, module: str, plant: Any) -> None:
        configuration = configuration_of(module)
        self._skills = configuration.modules[module].skills
        self.failures: list[Any] = []
        self._module = module
        self._cameras = configuration.modules[module].names.cameras
        self._sees = ObservationFilter(configuration.modules[module], configuration.site)
        self.plant = PerceivingPlant(
            plant, FixedGovernor(configuration), open_in_process, lambda *event: self.failures.append(event)
        )

    def observed(self) -> dict[str, Any]:
        """All that the module's skills see, by its names."""
        seen = self._sees.observe(self.plant.observe(), self.plant.now())
        assert not self.failures, self.failures
        return seen

    def do(self, kind: str, **parameters: Any) -> MotionCompletion:
        """Do one action; a camera is named as the module names it."""
        return self._execute(act(kind, **parameters))

    def _execute(self, action: Action) -> MotionCompletion:
        camera = action.parameters.get("camera")
        named = {} if camera is None else {"camera": self._cameras.get(camera, camera)}
        action = act(action.kind, **{**action.parameters, **named})
        return execute(self.plant, action, allow, self.plant.now() + 60.0)

    def run(self, skill: str, actions: int = 1000) -> str | None:
        """Run a skill, at most `actions` of its actions; None, or why one did not complete."""
        inputs = default_inputs(self._skills[skill])
        body = runpy.run_module(f"ecms.{self._module}.skills")[skill](self.observed(), inputs)
        try:
            action: Action = next(body)
            for _ in range(actions):
                ended = self._execute(action)
                if not ended.completed:
                    return ended.reason
                action = body.send(self.observed())
        except StopIteration:
            pass
        return None
