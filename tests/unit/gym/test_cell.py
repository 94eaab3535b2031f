"""A request in the name of a skill takes the place of its code once, and of nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from aeros.gym.cell import RequestingRuns
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult
from aeros.skill import act
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site


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
