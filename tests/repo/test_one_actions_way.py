"""One action passes through few files on its way from a skill's `yield` to the motors and back.

A file counts if any of its code runs: of `aeros/` and of the skill, from the moment the skill is resumed,
through its `yield`, until it is resumed again. Generated code has no file. What is done once in a process, as
the compilation of checks, is not counted: the skill has run before. Nor are the files that simulate the
surroundings of the robot: a real robot meets the world there, and no code.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Final

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import StepRequest, StepStatus
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult, run_in_process
from aeros.session.assembly import build_executor
from aeros.sim.physics import make_plant
from aeros.skill import Action, Observation
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.shipped_scenes import shipped_scene

pytestmark = pytest.mark.physics

MOST_FILES: Final = 48
"""Greatest number of files on the way of one action; five lead pictures to perceivers, one binds names, and
one is the part of the simulated robot that is the same on both physics engines."""

_SURROUNDINGS: Final = (
    "aeros/perception/",
    "aeros/sim/bullet/renderer.py",
    "aeros/sim/geometry.py",
    "aeros/runtime/gate/value_check.py",
    "aeros/runtime/perception/active_perceiver.py",
    "aeros/runtime/perception/camera_places.py",
    "aeros/runtime/perception/perceiver_run.py",
    "aeros/runtime/perception/shared_pictures.py",
    "aeros/runtime/perception/value_check.py",
    "aeros/sim/layouts/",
    "aeros/sim/robot/odometry.py",
    "aeros/sim/sensors.py",
    "ecms/clean_table/bin.py",
    "ecms/clean_table/floor.py",
    "ecms/clean_table/lost_pieces.py",
    "ecms/clean_table/own_hand.py",
    "ecms/clean_table/perceivers.py",
    "ecms/clean_table/pieces.py",
    "ecms/clean_table/places.py",
    "ecms/clean_table/sponge.py",
    "ecms/clean_table/table.py",
    "ecms/fetch_object/parts.py",
    "ecms/fetch_object/perceivers.py",
    "ecms/fetch_object/slips.py",
    "ecms/make_dumplings/bench.py",
    "ecms/make_dumplings/choice.py",
    "ecms/make_dumplings/following.py",
    "ecms/make_dumplings/hand.py",
    "ecms/make_dumplings/perceivers.py",
    "ecms/make_dumplings/pictures.py",
    "ecms/make_dumplings/plates.py",
    "ecms/make_dumplings/room.py",
    "ecms/make_dumplings/values.py",
    "ecms/make_dumplings/wrappers.py",
    "aeros/sim/scenes/",
    "aeros/spec/scenes/",
)
"""Objects and their frames, coatings, instruments, pictures, perceivers, and errors of sensors."""

Way = tuple[str, set[str]]
"""An action's kind, and the files on its way."""


class _TracedRun:
    """A run of a skill, each resumption of which begins the way of another action."""

    def __init__(self, run: SkillRunProtocol, ways: list[Way], files: set[str]) -> None:
        self._run = run
        self._ways = ways
        self._files = files

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        if self._ways:
            self._ways[-1][1].update(self._files)
        self._files.clear()
        answer = self._run.resume(observation, seconds, denial)
        if isinstance(answer, Action):
            self._ways.append((answer.kind, set()))
        return answer

    def close(self) -> str | None:
        return self._run.close()


@contextmanager
def _traced(files: set[str]) -> Iterator[None]:
    """Note each file of which a function runs, also one that was called before and goes on."""

    def note(frame: FrameType, event: str, _: Any) -> Any:
        files.add(frame.f_code.co_filename)
        # The executor's own frame goes on throughout; all others are entered anew.
        return note if frame.f_code.co_name == "run_step" else None

    before = sys.gettrace()
    sys.settrace(note)
    try:
        yield
    finally:
        sys.settrace(before)


def _ways(module: str, skill: str, scene: str, folder: Path) -> list[Way]:
    """Run a skill on the physics plant twice; return the way of each action of the second run."""
    sink = Diagnostics()
    site = load_site(reference_site_path(), sink)
    assert site is not None
    loaded = load_ecm(ROOT / "ecms" / module, site, sink)
    assert loaded is not None, list(sink)
    configuration = Configuration(site, {module: loaded.ecm}, {}, "c" * 64)
    gate = CompiledGate(configuration)
    for at in gate._decider._fast_paths:
        gate._decider._fast_paths.compile(at)
    files: set[str] = set()
    request = StepRequest(module, skill, {})
    _run(configuration, gate, request, scene, folder / "before.jsonl", files)
    with _traced(files):
        ways = _run(configuration, gate, request, scene, folder / "counted.jsonl", files)
    return [(kind, _of_the_repository(names)) for kind, names in ways]


def _run(
    configuration: Configuration,
    gate: CompiledGate,
    request: StepRequest,
    scene: str,
    log: Path,
    files: set[str],
) -> list[Way]:
    ways: list[Way] = []

    def open_run(at: Site, ecm: Ecm, of: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        return _TracedRun(run_in_process(at, ecm, of, inputs), ways, files)

    plant = make_plant(shipped_scene(scene), 0)
    with (
        AuditLog(log) as audit,
        build_executor(configuration, plant, audit, open_run, gate=gate) as executor,
    ):
        result = executor.run_step(request)
    plant.close()
    assert result.status is StepStatus.FINISHED, result
    assert result.allowed == len(ways)
    return ways


def _of_the_repository(names: set[str]) -> set[str]:
    inside = {Path(name).relative_to(ROOT).as_posix() for name in names if Path(name).is_relative_to(ROOT)}
    ours = {path for path in inside if path.startswith(("aeros/", "ecms/"))}
    return {path for path in ours if not path.startswith(_SURROUNDINGS)}


@pytest.mark.parametrize(
    ("module", "skill", "scene"),
    [
        ("fetch_object", "detect", "fetch"),
        ("clean_table", "verify", "table"),
        pytest.param("clean_table", "wipe", "table", marks=pytest.mark.deep),
        pytest.param("make_dumplings", "wrap", "dumpling_bench", marks=pytest.mark.deep),
    ],
)
def test_each_action_passes_through_few_files(module: str, skill: str, scene: str, tmp_path: Path) -> None:
    ways = _ways(module, skill, scene, tmp_path)
    assert "move_tool" in dict(ways)
    for kind, files in ways:
        assert len(files) <= MOST_FILES, f"{kind}: {len(files)} files:\n" + "\n".join(sorted(files))
