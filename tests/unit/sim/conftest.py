"""Driving a plant from tests: no gate, no agent, a monitor that allows."""

from __future__ import annotations

import importlib.util
import runpy
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest

from aeros.runtime.ports import MotionCompletion, Plant
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute

if TYPE_CHECKING:
    from aeros.sim.physics import PhysicsPlant

Skills = Callable[[Plant, str], list[MotionCompletion]]


def _observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


@pytest.fixture
def plant(request: pytest.FixtureRequest) -> Iterator[PhysicsPlant]:
    """The physics plant of the module's `SCENE`, of seed 0."""
    # PyBullet is imported only where it is asked for.
    from aeros.sim.physics import make_plant

    made = make_plant(shipped_scene(request.module.SCENE), 0)
    yield made
    made.close()


@pytest.fixture
def dumpling_skills() -> ModuleType:
    """The skills of ecms/make_dumplings, as a module."""
    path = Path(__file__).parents[3] / "ecms" / "make_dumplings" / "skills.py"
    spec = importlib.util.spec_from_file_location("dumpling_skills", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def run_dumpling_skill(dumpling_skills: ModuleType) -> Skills:
    """Runs one skill to its end, or to the first action that does not complete."""

    def run(plant: Plant, skill: str) -> list[MotionCompletion]:
        body = getattr(dumpling_skills, skill)(_observed(plant), {})
        ended: list[MotionCompletion] = []
        action = next(body, None)
        while action is not None:
            ended.append(execute(plant, action, allow, plant.now() + 60.0))
            if not ended[-1].completed:
                break
            try:
                action = body.send(_observed(plant))
            except StopIteration:
                action = None
        return ended

    return run


@pytest.fixture
def run_skill() -> Callable[..., str | None]:
    """Runs a skill of an ECM, at most `actions` of its actions; None, or why one did not complete."""

    def run(plant: Plant, ecm: str, skill: str, actions: int = 1000) -> str | None:
        skills = runpy.run_path(str(Path(__file__).parents[3] / "ecms" / ecm / "skills.py"))
        body = skills[skill](_observed(plant), {})
        try:
            action = next(body)
            for _ in range(actions):
                ended = execute(plant, action, allow, plant.now() + 60.0)
                if not ended.completed:
                    return ended.reason
                action = body.send(_observed(plant))
        except StopIteration:
            pass
        return None

    return run
