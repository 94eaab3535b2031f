"""The plant of a run: its extras, its viewers, and whether another process serves it."""

from __future__ import annotations

import tempfile
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.agent.identity import lock_folder
from aeros.cli.run import run_plant
from aeros.cli.run.run_plant import (
    SceneExtras,
    is_remote,
    load_scene_extras,
    lost_poses,
    open_outputs,
    open_run_plant,
    serve_plant,
)
from aeros.exit_codes import Exit
from aeros.session import plant_factory
from aeros.session.plant_factory import PlantSetupError
from aeros.sim.hosting.remote import RemotePlant
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.scenes.load import load_scene
from tests.unit.cli.staged import options, proved, staged
from tests.unit.sim.hosting.hosted import Hosting, once_it_listens


@pytest.fixture
def socket() -> Iterator[Path]:
    """A path that is short enough for a socket."""
    with tempfile.TemporaryDirectory(prefix="aeros-") as folder:
        yield Path(folder) / "plant" / "plant.sock"


@pytest.mark.parametrize(
    ("plant_at", "serves", "remote"),
    [(None, False, False), (None, True, False), ("plant.sock", False, True), ("plant.sock", True, False)],
)
def test_a_plant_is_remote_to_all_but_who_serves_it(
    plant_at: str | None, *, serves: bool, remote: bool
) -> None:
    assert is_remote(Namespace(plant_at=plant_at, serve_plant=serves)) is remote


def test_without_options_the_scene_has_no_extras(tmp_path: Path) -> None:
    setup = staged(options(tmp_path))
    found = load_scene_extras(setup.arguments, setup.configuration, [setup.task.task])
    assert found == SceneExtras((), (), None)


def test_a_plant_whose_package_is_missing_is_refused_before_the_run_has_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plant_factory, "find_spec", lambda name: None)
    setup = staged(options(tmp_path, "--plant", "kinematic"))
    with pytest.raises(PlantSetupError, match=r"\(numpy is missing\); plants that can run here: symbolic$"):
        load_scene_extras(setup.arguments, setup.configuration, [setup.task.task])


def test_a_variable_that_the_scene_does_not_give_is_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = staged(options(tmp_path))
    (tidy,) = setup.configuration.modules.values()
    tap = replace(next(iter(setup.configuration.site.state.values())), sensor="survey")
    configuration = replace(setup.configuration, modules={tidy.id: replace(tidy, state={"tidy.tap": tap})})
    monkeypatch.setattr(run_plant, "load_run_scene", lambda *_: load_scene("bare"))
    load_scene_extras(setup.arguments, configuration, [setup.task.task])
    assert "the scene has no place or instrument for `tidy.tap`" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--people", "--faults", "--scene"])
def test_extras_need_the_physics_plant(option: str, tmp_path: Path) -> None:
    setup = staged(options(tmp_path, option, "x"))
    with pytest.raises(PlantSetupError, match=rf"`{option}` needs"):
        load_scene_extras(setup.arguments, setup.configuration, [setup.task.task])


def test_a_plant_without_a_scene_cannot_be_randomised(tmp_path: Path) -> None:
    setup = staged(options(tmp_path, "--randomise"))
    with pytest.raises(PlantSetupError, match="the symbolic plant has none"):
        load_scene_extras(setup.arguments, setup.configuration, [setup.task.task])


def test_a_scene_without_ranges_cannot_be_randomised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setup = staged(options(tmp_path, "--randomise"))
    setup.arguments.plant = "kinematic"
    monkeypatch.setattr(run_plant, "load_run_scene", lambda *_: load_scene("bare"))
    with pytest.raises(PlantSetupError, match="the scene `bare` declares no ranges"):
        load_scene_extras(setup.arguments, setup.configuration, [setup.task.task])


def test_the_plant_server_alone_loads_the_extras_of_a_plant(tmp_path: Path) -> None:
    setup = staged(options(tmp_path, "--faults", "none-such"))
    setup.arguments.plant_at = tmp_path / "plant.sock"
    assert load_scene_extras(setup.arguments, setup.configuration, [setup.task.task]) == SceneExtras(
        (), (), None
    )


# Outputs.


class Viewer:
    """Keeps in mind what was opened and closed."""

    def __init__(self, name: str, seen: list[str]) -> None:
        self.name, self.seen = name, seen
        seen.append(f"open {name}")

    def close(self) -> None:
        self.seen.append(f"close {self.name}")


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The viewers that are opened in place of PyBullet's."""
    seen: list[str] = []
    place = "aeros.cli.run.run_plant"
    monkeypatch.setattr(f"{place}.open_viewer", lambda plant: Viewer(f"window of {plant}", seen))
    monkeypatch.setattr(f"{place}.open_recorder", lambda plant, path: Viewer(f"{path.name} of {plant}", seen))
    return seen


def outputs(arguments: Namespace) -> tuple[Path, list[Any]]:
    with open_outputs(arguments, "clean_up") as (out, viewers):
        return out, list(viewers)


def test_a_run_has_a_new_folder_and_nothing_to_be_seen(tmp_path: Path, seen: list[str]) -> None:
    assert outputs(options(tmp_path)) == (tmp_path / "out", [])
    assert (tmp_path / "out").is_dir()
    assert seen == []


def test_physics_is_recorded_into_the_folder_unless_it_is_forbidden(tmp_path: Path, seen: list[str]) -> None:
    assert len(outputs(options(tmp_path, "--plant", "physics"))[1]) == 1
    assert outputs(options(tmp_path / "2", "--plant", "physics", "--no-film"))[1] == []
    assert seen == ["open poses.jsonl of physics"]


def test_a_film_is_refused_where_it_cannot_be_made(tmp_path: Path, seen: list[str]) -> None:
    film = tmp_path / "film.gif"
    with pytest.raises(PlantSetupError, match="`--film` needs the physics plant"):
        outputs(options(tmp_path, "--film", str(film)))
    film.write_bytes(b"mine")
    with pytest.raises(PlantSetupError, match=r"`.*film\.gif` exists already; give another file with --film"):
        outputs(options(tmp_path / "2", "--plant", "physics", "--film", str(film)))
    assert seen == []


def test_a_window_is_closed_with_the_run(tmp_path: Path, seen: list[str]) -> None:
    outputs(options(tmp_path, "--plant", "physics", "--view"))
    assert seen == ["open window of physics", "open poses.jsonl of physics", "close window of physics"]


def test_the_plant_server_films_it_and_leaves_the_folder_to_the_agent(
    tmp_path: Path, seen: list[str]
) -> None:
    arguments = options(tmp_path, "--plant", "physics", "--serve-plant")
    arguments.plant_at = tmp_path / "plant.sock"
    assert outputs(arguments)[0] == tmp_path / "out"
    assert not (tmp_path / "out").exists()
    assert seen == ["open poses.jsonl of physics"]


def test_of_a_plant_that_another_serves_nothing_is_opened(tmp_path: Path, seen: list[str]) -> None:
    arguments = options(tmp_path, "--plant", "physics", "--view")
    arguments.plant_at = tmp_path / "plant.sock"
    assert outputs(arguments) == (tmp_path / "out", [])
    assert not (tmp_path / "out").exists()
    assert seen == []


# The plant itself.


def test_the_plant_is_opened_here_with_its_seed(tmp_path: Path) -> None:
    with open_run_plant(staged(options(tmp_path, "--seed", "3")), lambda _: None) as plant:
        assert isinstance(plant, SymbolicPlant)
        assert plant.observe()["bench_clean"].value is False


def _symbolic() -> SymbolicPlant:
    configuration = proved()[0]
    return SymbolicPlant(configuration.site, configuration.modules, 0, {"bench_clean": True})


def test_a_plant_that_another_process_serves_is_connected_to(tmp_path: Path) -> None:
    hosting = Hosting(_symbolic(), linger=0.2)
    once_it_listens(lambda: RemotePlant(hosting.path)).close()
    arguments = options(tmp_path)
    arguments.plant_at = hosting.path
    with open_run_plant(staged(arguments), lambda _: None) as plant:
        assert isinstance(plant, RemotePlant)
        assert plant.observe()["bench_clean"].value is True
    hosting.thread.join(20.0)


def test_a_served_plant_lives_until_it_is_shut_down_and_leaves_a_log(tmp_path: Path, socket: Path) -> None:
    arguments = options(tmp_path, "--serve-plant")
    arguments.plant_at = socket
    codes: list[Exit] = []
    serving = Thread(target=lambda: codes.append(serve_plant(staged(arguments))))
    serving.start()
    plant = once_it_listens(lambda: RemotePlant(socket))
    assert plant.observe()["bench_clean"].value is False
    plant.shut_down_host()
    plant.close()
    serving.join(20.0)
    assert codes == [Exit.SUCCESS]
    assert not socket.parent.exists()
    assert '"agent-connected"' in (tmp_path / "out" / "plant.jsonl").read_text()


def test_a_plant_that_is_served_already_is_not_served_twice(tmp_path: Path, socket: Path) -> None:
    arguments = options(tmp_path, "--serve-plant")
    arguments.plant_at = socket
    with lock_folder(tmp_path / "state" / "plant"):
        assert serve_plant(staged(arguments)) is Exit.SUCCESS
    assert not socket.parent.exists()


def test_lost_lines_of_a_recording_are_counted() -> None:
    assert lost_poses(()) == 0
    viewers: Any = (object(), SimpleNamespace(lost=3))
    assert lost_poses(viewers) == 3
