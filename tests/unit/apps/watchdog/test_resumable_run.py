"""A run's options are kept in the state folder and come back, except those of this command."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path
from threading import Thread

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import lock_folder
from aeros.apps.watchdog.resumable_run import (
    delete_run_options,
    end_plant,
    end_task,
    load_run_options,
    save_run_options,
)
from aeros.cli.parsers import parse
from aeros.sim.kinematic.plant import make_plant
from aeros.spec.migrations.formats import RUN
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.hosting.hosted import Hosting


def asked(state: Path, **changed: object) -> Namespace:
    given = {
        "instruction": "fetch",
        "seed": 3,
        "ecms": [],
        "out": Path("out"),
        "resume": False,
        "max_crashes": 5,
    }
    return Namespace(state=state, **{**given, **changed})


def test_the_instruction_comes_back_wherever_it_is_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = tmp_path / "new" / "state"
    monkeypatch.chdir(tmp_path)
    save_run_options(asked(state))
    assert state.stat().st_mode & 0o777 == 0o700
    monkeypatch.chdir("/")
    restored = load_run_options(asked(state, instruction=None, seed=0, resume=True, max_crashes=9))
    assert vars(restored) == {
        "instruction": "fetch",
        "seed": 3,
        "ecms": [],
        "out": tmp_path / "out",
        "state": state,
        # Of a release that saved neither: signed, and without an anchor.
        "anchor": [],
        "unsigned": False,
        # This command's own.
        "resume": True,
        "max_crashes": 9,
    }


@pytest.mark.parametrize("one", [True, False])
def test_one_folder_of_an_older_release_is_a_list_now(tmp_path: Path, one: bool) -> None:
    folder = tmp_path / "ecms"
    save_run_options(asked(tmp_path, ecms=folder if one else [folder, folder]))
    assert load_run_options(asked(tmp_path)).ecms == ([folder] if one else [folder, folder])


def test_a_deleted_task_cannot_be_resumed(tmp_path: Path) -> None:
    save_run_options(asked(tmp_path))
    delete_run_options(tmp_path)
    delete_run_options(tmp_path)
    with pytest.raises(AgentError, match="there is nothing to resume"):
        load_run_options(asked(tmp_path))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("", "cannot read run options from"),
        ("{", "cannot read run options from"),
        (b"\xff", "cannot read run options from"),
        (f'{{"schema": "{RUN.schema}", "state": {{}}}}', "cannot read run options from"),
        (f'{{"schema": "{RUN.schema}", "state": {{"path": 1}}}}', "cannot read run options from"),
        (f'{{"schema": "{RUN.schema}"}}', "it has no `instruction`; start the task again"),
        (f'{{"schema": "{RUN.schema}", "instruction": "fetch"}}', "it has no `state`"),
        ("[]", "is an older format"),
        ('"x"', "is an older format"),
        ('{"state": {}}', "is an older format"),
    ],
)
def test_unreadable_input_is_refused(content: str | bytes, why: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(AgentError, match=why):
        load_run_options(asked(tmp_path))


def test_a_state_folder_that_cannot_be_written_is_refused_before_the_task_begins(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in its place")
    with pytest.raises(AgentError, match="cannot be written to"):
        save_run_options(asked(tmp_path / "file"))
    (tmp_path / "state" / "run.json").mkdir(parents=True)
    with pytest.raises(AgentError, match="cannot be written to"):
        save_run_options(asked(tmp_path / "state"))


def test_a_task_that_has_ended_ends_its_plant(tmp_path: Path) -> None:
    save_run_options(asked(tmp_path))
    hosting = Hosting(make_plant(shipped_scene("bare"), 0))
    hosting.join().close()
    end_task(tmp_path, hosting.path)
    hosting.thread.join(20.0)
    assert hosting.events()[-1] == "host-ended"
    assert not (tmp_path / "run.json").exists()
    # Where none is there any more, nothing is left to end.
    end_task(tmp_path, hosting.path)


def test_the_end_of_a_plant_is_waited_for(tmp_path: Path) -> None:
    hosting = Hosting(make_plant(shipped_scene("bare"), 0))
    order: list[str] = []

    def wait() -> None:
        end_plant(hosting.join(), tmp_path)
        order.append("waited")

    with lock_folder(tmp_path / "plant"):
        waiting = Thread(target=wait)
        waiting.start()
        hosting.until("host-ended")
        waiting.join(0.2)
        order.append("film written")
    waiting.join(20.0)
    assert order == ["film written", "waited"]
    assert json.loads((tmp_path / "plant" / "agent.lock").read_text() or "{}") == {}


def test_the_options_of_the_command_line_are_saved_and_come_back(tmp_path: Path) -> None:
    given = parse(["run", "make tea", "--state", str(tmp_path), "--out", "out", "--watchdog", "--seed", "3"])
    save_run_options(given)
    restored = load_run_options(parse(["run", "--resume", "--state", str(tmp_path)]))
    assert (restored.instruction, restored.seed, restored.out.name) == ("make tea", 3, "out")
