"""The operator's commands reach every run on a state folder, however it was started.

Each command is given while a skill moves, and again before a run starts.  The plant is slow in real time.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.registry import Registry
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.session.setup import open_governor
from aeros.sim.symbolic.state import initial_values
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import BASE
from tests.unit.runtime.registry.together.test_revocation import SlowPlant

_PATIENCE = 60.0  # s
_STATE = Path("robot")

STARTS: dict[str, tuple[list[Path] | None, Path | None]] = {
    "registry": (None, None),
    "--ecms": ([Path("ecms")], None),
    "--site": (None, Path("site.yaml")),
    "--ecms --site": ([Path("ecms/tidy")], Path("site.yaml")),
    "default folder": (None, None),
}
_BLOCK = ("block", "--id", "one", "--reason", "why")
COMMANDS = {
    "block module": (*_BLOCK, "--module", "tidy"),
    "block skill": (*_BLOCK, "--module", "tidy", "--skill", "rest"),
    "block action": (*_BLOCK, "--action", "wait"),
    "block version": (*_BLOCK, "--module", "tidy", "--version", "<2"),
    "block digest": (*_BLOCK, "--digest", f"sha256:{bundle_digest(module_files(BASE / 'tidy'))}"),
    "deactivate": ("deactivate", "tidy"),
    "policy": ("policy", "other.yaml"),
    "stop": ("stop",),
}


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a module with its certificate, two sites, and the state of a robot that has the module."""
    made = tmp_path_factory.mktemp("template")
    shutil.copytree(BASE / "tidy", made / "ecms" / "tidy")
    shutil.copy(BASE / "site.yaml", made)
    (made / "other.yaml").write_text((BASE / "site.yaml").read_text() + "# another\n")
    assert main(["verify", str(made / "ecms"), "--site", str(made / "site.yaml")]) == 0
    for state in ("bare", "robot"):
        Registry(made / state).set_policy(made / "site.yaml")
    robot = Registry(made / "robot")
    robot.install(made / "ecms" / "tidy")
    robot.configure("tidy")
    robot.activate("tidy")
    return made


@pytest.fixture
def start(
    request: pytest.FixtureRequest, template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> str:
    """Way to start a run; the current folder is one that it can be started from."""
    folder = tmp_path / "work"
    shutil.copytree(template, folder)
    monkeypatch.chdir(folder)
    if request.param == "default folder":
        shutil.rmtree(_STATE)
        Path("bare").rename(_STATE)
    return str(request.param)


class Run:
    """A run on the robot: its executor, and the results of its steps."""

    def __init__(self, executor: Executor, plant: SlowPlant) -> None:
        self.executor = executor
        self.plant = plant
        self.results: list[StepResult] = []

    def begin(self) -> threading.Thread:
        def run() -> None:
            self.results.append(self.executor.run_step(StepRequest("tidy", "rest", {})))

        thread = threading.Thread(target=run)
        thread.start()
        return thread


@contextmanager
def started(start: str) -> Iterator[Run]:
    modules, site = STARTS[start]
    governor, configuration, _ = open_governor(_STATE, modules, site)
    with governor, AuditLog(Path("audit.jsonl")) as audit:
        plant = SlowPlant(initial_values(configuration.site, {}))
        plant.moving = threading.Event()
        gate = CompiledGate(configuration)
        yield Run(Executor(configuration, gate, plant, audit, run_in_process, governor), plant)


def run_command(*command: str) -> int:
    return main([*command, "--state", str(_STATE)])


def is_for_the_installed(command: str, start: str) -> bool:
    """Nothing is installed on a robot that runs the default folder."""
    return command == "deactivate" and start == "default folder"


@pytest.mark.parametrize("start", STARTS, indirect=True)
@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_that_is_revoked_moves_after_the_command(start: str, command: str) -> None:
    with started(start) as run:
        thread = run.begin()
        assert run.plant.moving.wait(_PATIENCE)
        code = run_command(*COMMANDS[command])
        returned = time.monotonic()
        if is_for_the_installed(command, start):
            assert code == 1
            run.plant.may_end = True
            thread.join(_PATIENCE)
            return
        assert code == 0
        thread.join(_PATIENCE)
        assert run.plant.ticked < returned
        (result,) = run.results
        assert result.status is (StepStatus.HALTED if command == "stop" else StepStatus.STOPPED)
        # What the run asks for next is decided under the changed registry.
        run.plant.may_end = True
        if command == "policy" and "--site" in start:
            with pytest.raises(UserError, match="is not the policy that is in force on this robot"):
                run.executor.run_step(StepRequest("tidy", "rest", {}))
            return
        after = run.executor.run_step(StepRequest("tidy", "rest", {})).status
        assert (after is StepStatus.FINISHED) == (command == "policy")


@pytest.mark.parametrize("start", STARTS, indirect=True)
@pytest.mark.parametrize("command", [one for one in COMMANDS if one != "stop"])
def test_a_run_that_starts_after_the_command_is_bound_by_it(start: str, command: str) -> None:
    code = run_command(*COMMANDS[command])
    if is_for_the_installed(command, start):
        assert code == 1
        return
    assert code == 0
    if command == "policy":
        refused = "is not the policy" if "--site" in start else None
    elif command == "deactivate":
        refused = "no longer active"
    else:
        refused = None
    if refused is not None and start != "registry":
        with pytest.raises(UserError, match=refused):
            open_governor(_STATE, *STARTS[start])
        return
    with started(start) as run:
        run.plant.may_end = True
        status = run.executor.run_step(StepRequest("tidy", "rest", {})).status
        assert (status is StepStatus.FINISHED) == (command == "policy")


@pytest.mark.parametrize("start", STARTS, indirect=True)
def test_a_block_that_is_removed_blocks_no_run(start: str) -> None:
    with started(start) as run:
        run.plant.may_end = True
        for command, allowed in ((COMMANDS["block module"], False), (("unblock", "one"), True)):
            assert run_command(*command) == 0
            status = run.executor.run_step(StepRequest("tidy", "rest", {})).status
            assert (status is StepStatus.FINISHED) == allowed


@pytest.mark.parametrize("start", STARTS, indirect=True)
def test_a_pause_holds_every_run_until_it_is_resumed(start: str) -> None:
    with started(start) as run:
        assert run_command("pause") == 0
        thread = run.begin()
        assert not run.plant.moving.wait(0.05)
        run.plant.may_end = True
        assert run_command("resume") == 0
        thread.join(_PATIENCE)
        assert run.results[0].status is StepStatus.FINISHED


@pytest.mark.parametrize("start", ["--ecms", "--ecms --site"], indirect=True)
def test_a_removed_module_is_used_from_no_folder_until_it_is_active_again(start: str) -> None:
    assert run_command("deactivate", "tidy") == 0
    for command in (("remove", "tidy"), ("install", "ecms/tidy"), ("configure", "tidy")):
        assert run_command(*command) == 0
        with pytest.raises(UserError, match="`tidy` is no longer active on this robot"):
            open_governor(_STATE, *STARTS[start])
    assert run_command("activate", "tidy") == 0
    with started(start) as run:
        run.plant.may_end = True
        assert run.executor.run_step(StepRequest("tidy", "rest", {})).status is StepStatus.FINISHED


@pytest.mark.parametrize("start", ["--ecms", "--site"], indirect=True)
def test_another_version_that_becomes_active_ends_runs_of_the_old_one(start: str) -> None:
    shutil.copytree("ecms/tidy", "newer/tidy")
    manifest = Path("newer/tidy/ecm.yaml")
    manifest.write_text(manifest.read_text().replace("version: 1.0.0", "version: 1.1.0"))
    with started(start) as run:
        thread = run.begin()
        assert run.plant.moving.wait(_PATIENCE)
        assert run_command("install", "newer/tidy") == 0
        returned = time.monotonic()
        thread.join(_PATIENCE)
        assert run.plant.ticked < returned
        assert "now has another version" in run.results[0].reason
        assert run.executor.active_modules() == {}
    with pytest.raises(UserError, match="now has another version on this robot"):
        open_governor(_STATE, *STARTS[start])


@pytest.mark.parametrize("start", ["--site"], indirect=True)
def test_the_first_block_on_a_robot_without_a_registry_reaches_the_run(start: str) -> None:
    shutil.rmtree(_STATE)
    with started(start) as run:
        thread = run.begin()
        assert run.plant.moving.wait(_PATIENCE)
        assert run_command(*COMMANDS["block action"]) == 0
        returned = time.monotonic()
        thread.join(_PATIENCE)
        assert run.plant.ticked < returned
        run.plant.may_end = True
        assert run.executor.run_step(StepRequest("tidy", "rest", {})).status is StepStatus.DENIED


@pytest.mark.parametrize("start", ["--ecms"], indirect=True)
def test_a_block_of_other_versions_and_contents_blocks_nothing(start: str) -> None:
    for number, part in enumerate((("--module", "tidy", "--version", ">1.0.0"), ("--digest", "0" * 64))):
        assert run_command("block", "--id", f"b{number}", "--reason", "why", *part) == 0
    with started(start) as run:
        run.plant.may_end = True
        assert run.executor.run_step(StepRequest("tidy", "rest", {})).status is StepStatus.FINISHED


@pytest.mark.parametrize("start", ["--ecms"], indirect=True)
def test_a_run_whose_state_folder_is_deleted_stops(start: str) -> None:
    with started(start) as run:
        thread = run.begin()
        assert run.plant.moving.wait(_PATIENCE)
        shutil.rmtree(_STATE)
        thread.join(_PATIENCE)
        assert run.results[0].status is StepStatus.HALTED
