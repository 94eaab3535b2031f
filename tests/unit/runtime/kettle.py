"""A module that measures predicates of its own, under the reference site, beside one of the site's words."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import ColumnNames, Reading, Readings, Snapshot
from aeros.runtime.proving import prove_configuration
from aeros.sim.symbolic.state import initial_values
from aeros.skill import Action
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime import bench

KETTLE = Path(__file__).parent / "data" / "kettle"
DUMPLINGS = Path(__file__).parents[3] / "ecms" / "make_dumplings"
NOW = 100.0
OWN: Mapping[str, Any] = {"kettle.water_hot": False, "kettle.filled": True, "kettle.water_level": 0.125}


@cache
def configuration(*, alone: bool = False) -> Configuration:
    """The kettle and the dumplings; or the dumplings alone."""
    folders = [DUMPLINGS] if alone else [KETTLE, DUMPLINGS]
    return prove_configuration(folders, reference_site_path(), certified=False)[0]


@cache
def gate(mode: GateMode, *, alone: bool = False) -> CompiledGate:
    return CompiledGate(configuration(alone=alone), mode)


@cache
def of_the_site() -> Mapping[str, Any]:
    """Values of the site's own state variables under which much is allowed."""
    return initial_values(configuration(alone=True).site, {})


def one_by_one(own: Mapping[str, Any]) -> dict[str, Reading]:
    return bench.measured({**of_the_site(), **own}, NOW)


def of_one_moment(own: Mapping[str, Any]) -> Snapshot:
    values = {**of_the_site(), **own}
    order = ColumnNames(values)
    return Snapshot(order, tuple(values[name] for name in order.names), NOW)


WAIT = (Caller("kettle", "heat", {}), Action("wait", {"duration": 5.0}))
LOOK = (Caller("make_dumplings", "prepare", {}), Action("look", {"camera": "overhead"}))


def decide(
    asked: tuple[Caller, Action],
    readings: Readings,
    mode: GateMode = GateMode.COMPILED,
    *,
    alone: bool = False,
) -> Decision:
    usage = {quota.id: 0 for quota in configuration().site.quotas}
    return gate(mode, alone=alone).decide(asked[0], readings, asked[1], NOW, usage)
