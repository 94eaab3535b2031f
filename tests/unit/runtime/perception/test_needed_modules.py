"""The modules whose perceivers run are the attended ones, and those that they may need."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.needed_modules import needed_modules
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import PerceptionPolicy
from tests.unit.runtime.perception.kettle import kettle, site


def module(name: str, *, requires: str = "", provides: str = "", wants: str = "") -> Ecm:
    return replace(
        kettle(),
        id=name,
        required_modules=dict.fromkeys(requires.split(), ">=1"),
        capabilities=dict.fromkeys(provides.split(), ()),
        required_capabilities=dict.fromkeys(wants.split(), ">=1"),
    )


CAFE = {
    one.id: one
    for one in (
        module("serve", requires="brew", wants="heating"),
        module("brew", requires="grind"),
        module("grind"),
        module("boil", provides="heating"),
        module("toast", provides="heating browning"),
        module("sweep"),
    )
}


@pytest.mark.parametrize(
    ("attended", "needed"),
    [
        (None, "boil brew grind serve sweep toast"),
        ("", ""),
        ("sweep", "sweep"),
        ("brew", "brew grind"),
        ("grind", "grind"),
        ("serve", "boil brew grind serve toast"),
        # Another module may do what one provides.
        ("boil", "boil toast"),
        ("sweep absent", "sweep"),
    ],
)
def test_needed_modules_are_required_or_provide_the_same(attended: str | None, needed: str) -> None:
    asked = None if attended is None else frozenset(attended.split())
    found = needed_modules(Configuration(site(), CAFE, {}, ""), asked)
    assert " ".join(sorted(found)) == needed


def test_modules_with_variables_that_the_site_shares_are_always_needed() -> None:
    variable = next(iter(kettle().state.values()))
    shared = PerceptionPolicy(shared=MappingProxyType({"sweep.floor_wet": variable}))
    watched = PerceptionPolicy(in_invariants=frozenset({"sweep.floor_wet"}))
    for policy in (shared, watched):
        around = Configuration(replace(site(), perception=policy), CAFE, {}, "")
        assert needed_modules(around, frozenset({"grind"})) == {"grind", "sweep"}
