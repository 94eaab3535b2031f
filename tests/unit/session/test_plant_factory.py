"""Plants by name: which extras each has, which scene it needs, and how another process's is reached."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.session import plant_factory
from aeros.session.plant_factory import (
    PLANTS,
    PlantSetupError,
    connect_plant,
    load_faults,
    load_people,
    load_run_scene,
    open_plant,
    open_viewer,
    require_new_film,
    surroundings_of,
)
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.diagnostics.errors import UserError
from tests.shipped_scenes import shipped_scene
from tests.unit.cli.staged import proved
from tests.unit.sim.hosting.hosted import Hosting, once_it_listens

TIDY = proved()[0].modules["tidy"].tasks["clean_up"]
BARE = replace(TIDY, scene="bare")


def test_the_plants_are_these() -> None:
    assert PLANTS == ("physics", "mujoco", "kinematic", "symbolic")


def test_options_not_given_are_empty_on_every_plant() -> None:
    for plant in PLANTS:
        assert load_people(plant, None) == ()
        assert list(load_faults(plant, None, proved()[0], None)) == []
        scene = load_run_scene(plant, None, proved()[0], [BARE], 0)
        assert scene == (None if plant == "symbolic" else shipped_scene("bare"))


@pytest.mark.parametrize("plant", ["kinematic", "symbolic"])
def test_extras_and_images_are_of_the_physics_plant_alone(plant: str, tmp_path: Path) -> None:
    with pytest.raises(PlantSetupError, match=f"`--people` needs the physics plant: the {plant} plant"):
        load_people(plant, "walker")
    with pytest.raises(PlantSetupError, match="`--faults` needs `--plant physics`"):
        load_faults(plant, "slips", proved()[0], None)
    with pytest.raises(PlantSetupError, match=f"`--scene` needs the physics plant: the {plant} plant"):
        load_run_scene(plant, "clutter", proved()[0], [TIDY], 0)
    with pytest.raises(PlantSetupError, match=f"`--film` needs the physics plant: the {plant} plant"):
        require_new_film(plant, tmp_path / "run.gif")
    with pytest.raises(PlantSetupError, match=f"`--view` needs the physics plant: the {plant} plant"):
        open_viewer(plant)


def test_the_symbolic_plant_begins_where_the_task_does_and_needs_no_scene() -> None:
    with open_plant("symbolic", proved()[0], TIDY, 0) as plant:
        assert isinstance(plant, SymbolicPlant)
        assert plant.observe()["bench_clean"].value is False
        assert plant.now() == 0.0


def test_the_kinematic_plant_is_opened_in_a_scene_that_it_has() -> None:
    with open_plant("kinematic", proved()[0], BARE, 0) as plant:
        assert isinstance(plant, KinematicPlant)


@pytest.mark.parametrize("scene", [None, "attic"])
def test_an_unknown_scene_is_reported_with_the_known_ones(scene: str | None) -> None:
    with (
        pytest.raises(UserError, match=f"the scene of `clean_up` is `{scene}`, but there is only .*bare"),
        open_plant("kinematic", proved()[0], replace(TIDY, scene=scene), 0),
    ):
        pass


class Closing:
    """A plant that is closed, and may fail then."""

    def __init__(self, failure: Exception | None = None) -> None:
        self.failure, self.closed = failure, 0

    def close(self) -> None:
        self.closed += 1
        if self.failure is not None:
            raise self.failure


def test_a_plant_is_closed_however_the_block_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Closing()
    monkeypatch.setattr(plant_factory, "_build_symbolic", lambda *_: made)
    with open_plant("symbolic", proved()[0], TIDY, 0):
        assert made.closed == 0
    with pytest.raises(ZeroDivisionError), open_plant("symbolic", proved()[0], TIDY, 0):
        raise ZeroDivisionError
    assert made.closed == 2


def test_a_recording_that_cannot_be_completed_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plant_factory, "_build_symbolic", lambda *_: Closing(OSError("disk full")))
    with (
        pytest.raises(PlantSetupError, match="the recording cannot be completed: disk full"),
        open_plant("symbolic", proved()[0], TIDY, 0),
    ):
        pass


def test_faults_may_name_what_the_scene_and_the_modules_have() -> None:
    found = surroundings_of(proved()[0], shipped_scene("table"))
    assert set(found.skills) == {"tidy.pick_cloth", "tidy.wipe", "tidy.rest"}
    assert (found.things, found.cameras) == (
        ("sponge", "cube", "can"),
        ("aisle_top", "table_side", "table_top"),
    )
    assert found.quantities == proved()[0].site.state


def test_without_its_library_a_plant_names_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "aeros.sim.kinematic.plant", None)
    with (
        pytest.raises(PlantSetupError, match=r"kinematic plant needs `pip install '\.\[kinematic\]'`"),
        open_plant("kinematic", proved()[0], BARE, 0),
    ):
        pass
    monkeypatch.setitem(sys.modules, "aeros.sim.engine.people_file", None)
    with pytest.raises(
        PlantSetupError, match=r"physics plant needs (`pip install '\.\[sim\]'`|Python 3\.11)"
    ):
        load_people("physics", "walker")
    monkeypatch.setitem(sys.modules, "aeros.sim.mujoco.engine", None)
    with (
        pytest.raises(
            PlantSetupError,
            match=r"mujoco plant needs `pip install '\.\[mujoco\]'.*; plants that can run here: .*symbolic$",
        ),
        open_plant("mujoco", proved()[0], BARE, 0),
    ):
        pass


@pytest.mark.physics
def test_the_plant_on_mujoco_is_opened_and_has_no_window() -> None:
    with open_plant("mujoco", proved()[0], BARE, 0) as plant:
        assert plant.now() == 0.0
        assert "human_distance" in plant.observe()
    with pytest.raises(PlantSetupError, match="a window shows PyBullet alone"):
        open_viewer("mujoco")


def test_a_people_file_that_is_not_there_is_the_users_error() -> None:
    pytest.importorskip("pybullet", reason="PyBullet has no wheel for this Python")
    with pytest.raises(UserError):
        load_people("physics", "no-such-people")


def test_an_added_scene_is_built_once_with_that_of_the_task(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pybullet", reason="PyBullet has no wheel for this Python")
    plant = Closing()
    asked: list[Any] = []

    def make(*given: Any, **_: Any) -> Closing:
        asked.append(given[:2])
        return plant

    monkeypatch.setattr("aeros.sim.physics.make_plant", make)
    scene = load_run_scene("physics", "shelf_behind", proved()[0], [BARE], 5)
    assert scene is not None
    assert list(scene.bodies) == ["table", "shelf", "crate", "bottle"]
    assert asked == [(scene, 5)]
    assert plant.closed == 1
    with pytest.raises(UserError, match="the scene of `clean_up` is `None`"):
        load_run_scene("physics", "shelf_behind", proved()[0], [TIDY], 5)
    whole = load_run_scene("physics", "bare", proved()[0], [TIDY], 5)
    assert whole is not None
    assert (whole.name, whole.robot is None) == ("bare", False)


# Plants of other processes.


def test_a_plant_that_is_served_is_connected_to() -> None:
    hosting = Hosting(
        SymbolicPlant(proved()[0].site, proved()[0].modules, 0, {"bench_clean": True}), linger=0.2
    )
    plant = once_it_listens(lambda: connect_plant(hosting.path))
    assert plant.observe()["bench_clean"].value is True
    plant.close()
    hosting.thread.join(20.0)


class Clock:
    """Time that passes while one sleeps, and no other."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.mark.parametrize(
    ("failure", "waited"),
    [(FileNotFoundError(2, "No such file"), 60.0), (ConnectionRefusedError(111, "refused"), 1.0)],
)
def test_a_plant_that_does_not_come_is_waited_for_and_then_given_up(
    failure: OSError, waited: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock()

    def refuse(_: Any) -> None:
        raise failure

    monkeypatch.setattr(plant_factory, "time", clock)
    monkeypatch.setattr(plant_factory, "RemotePlant", refuse)
    with pytest.raises(
        PlantSetupError, match=rf"no plant at `/x` \({failure.strerror}\); the simulated plant"
    ):
        connect_plant(Path("/x"))
    assert clock.now - 100.0 == pytest.approx(waited, abs=0.021)


def test_a_plant_that_is_there_later_is_connected_to(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, plant = Clock(), object()

    def come(_: Path) -> object:
        if clock.now < 103.0:
            raise FileNotFoundError(2, "No such file")
        return plant

    monkeypatch.setattr(plant_factory, "time", clock)
    monkeypatch.setattr(plant_factory, "RemotePlant", come)
    assert connect_plant(Path("/x")) is plant


def test_a_robot_that_cannot_be_used_is_refused_with_the_scene() -> None:
    configuration = proved()[0]
    other = replace(configuration, site=replace(configuration.site, robot="nobody"))
    assert load_run_scene("symbolic", None, other, [BARE], 0) is None
    for plant in ("physics", "mujoco", "kinematic"):
        with pytest.raises(UserError, match="nobody"):
            load_run_scene(plant, None, other, [BARE], 0)
