"""The option `--plant`: a plant that comes with AEROS, or one that an installed distribution provides."""

from __future__ import annotations

import argparse
from typing import Final

from aeros.session.plant_factory import PLANTS, runnable_plants
from aeros.session.plant_provider import PlantProviderError, load_provider

HELP: Final = f"{', '.join(PLANTS)}, or a plant that an installed distribution provides"


def plant_name(text: str) -> str:
    """Parse the name of a plant.

    Args:
        text: The argument.

    Returns:
        The name.

    Raises:
        argparse.ArgumentTypeError: There is no such plant, or it cannot be imported.
    """
    if text not in PLANTS:
        if text == "pybullet":
            raise argparse.ArgumentTypeError("no plant is called `pybullet`: `physics` runs on it")
        try:
            load_provider(text, PLANTS)
        except PlantProviderError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
    return text


def best_plant() -> str:
    """Choose the plant that is nearest to a robot, of those that can run here.

    Returns:
        Its name.
    """
    return runnable_plants()[0]


def add_plant_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option `--plant`, whose default is the best plant that is installed.

    Args:
        parser: Parser of a command.
    """
    parser.add_argument(
        "--plant",
        type=plant_name,
        default=best_plant(),
        metavar="NAME",
        help=f"{HELP} (default: {best_plant()}, the first of {', '.join(PLANTS[:-1])} that is installed)",
    )
