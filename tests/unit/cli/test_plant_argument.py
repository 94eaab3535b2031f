"""The option `--plant` accepts shipped plants, and those that installed distributions provide."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError
from importlib.util import find_spec

import pytest

from aeros.cli.plant_argument import add_plant_argument, best_plant, plant_name
from aeros.session import plant_factory
from aeros.session.plant_factory import PLANTS


def test_shipped_plants_are_accepted_and_others_refused_with_the_nearest_name() -> None:
    assert [plant_name(one) for one in PLANTS] == list(PLANTS)
    with pytest.raises(ArgumentTypeError, match="no plant is called `mujocco`: did you mean `mujoco`"):
        plant_name("mujocco")
    with pytest.raises(ArgumentTypeError, match="no plant is called `pybullet`: `physics` runs on it"):
        plant_name("pybullet")


@pytest.mark.parametrize(
    ("installed", "plant"),
    [
        ({"pybullet", "mujoco", "numpy"}, "physics"),
        ({"mujoco", "numpy"}, "mujoco"),
        ({"numpy"}, "kinematic"),
        (set(), "symbolic"),
    ],
)
def test_the_best_plant_is_the_nearest_to_a_robot_that_is_installed(
    installed: set[str], plant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plant_factory, "find_spec", lambda name: name if name in installed else None)
    assert best_plant() == plant
    parser = ArgumentParser()
    add_plant_argument(parser)
    assert parser.parse_args([]).plant == plant


@pytest.mark.skipif(find_spec("pybullet") is None, reason="PyBullet is not installed")
def test_physics_is_the_default() -> None:
    parser = ArgumentParser()
    add_plant_argument(parser)
    assert parser.parse_args([]).plant == "physics"
    assert parser.parse_args(["--plant", "symbolic"]).plant == "symbolic"
