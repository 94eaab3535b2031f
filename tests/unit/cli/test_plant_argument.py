"""The option `--plant` accepts shipped plants, and those that installed distributions provide."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError

import pytest

from aeros.cli.plant_argument import add_plant_argument, plant_name
from aeros.session.plant_factory import PLANTS


def test_shipped_plants_are_accepted_and_others_refused_with_the_nearest_name() -> None:
    assert [plant_name(one) for one in PLANTS] == list(PLANTS)
    with pytest.raises(ArgumentTypeError, match="no plant is called `mujocco`: did you mean `mujoco`"):
        plant_name("mujocco")


def test_physics_is_the_default() -> None:
    parser = ArgumentParser()
    add_plant_argument(parser)
    assert parser.parse_args([]).plant == "physics"
    assert parser.parse_args(["--plant", "symbolic"]).plant == "symbolic"
