"""Setups of runs of the module in docs/codes on the symbolic plant, as `aeros run` makes them."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from functools import cache
from pathlib import Path

from aeros.agent.instructions.understand import understand
from aeros.cli.run import run
from aeros.cli.run.run_plant import PlantSetup, SceneExtras
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.verification.reports import Report
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"


@cache
def proved() -> tuple[Configuration, Report]:
    """The module proved, and trusted to run in this process: no processes are started for it."""
    configuration, report = prove_configuration([BASE / "tidy"], BASE / "site.yaml", certified=False)
    trusting = IsolationPolicy(trusted_modules=frozenset({"tidy"}))
    return replace(configuration, site=replace(configuration.site, isolation=trusting)), report


def options(folder: Path, *more: str) -> Namespace:
    """The parsed options of `aeros run "clean it" --plant symbolic`, with its folders in `folder`."""
    parser = ArgumentParser()
    run.add_to(parser.add_subparsers())
    return parser.parse_args(
        [
            "run",
            "clean it",
            "--plant",
            "symbolic",
            "--state",
            str(folder / "state"),
            "--out",
            str(folder / "out"),
            *more,
        ]
    )


def staged(arguments: Namespace) -> PlantSetup:
    """The setup of its plant, with an output folder that is there."""
    configuration = proved()[0]
    task = understand("clean it", configuration.modules).first
    arguments.out.mkdir(parents=True, exist_ok=True)
    return PlantSetup(arguments, configuration, task, SceneExtras((), (), None), (), arguments.out)
