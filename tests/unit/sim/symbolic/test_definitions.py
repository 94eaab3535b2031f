"""Predicates that follow from the base's position hold on the symbolic plant where the base is there."""

from __future__ import annotations

from dataclasses import replace

from aeros.sim.symbolic.definitions import PlaceDefinitions
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import act
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from tests.modules.robot import configuration_of
from tests.unit.sim.acting import allow, execute

DOCK = (0.0, -1.2, 0.0)
AT = "clean_table.robot_at_table"


def plant(base: tuple[float, float, float]) -> SymbolicPlant:
    """The reference site with `clean_table`, whose predicate is said to hold at the start."""
    around = configuration_of("clean_table")
    start = {"base_position": base, "clean_table.dock_position": DOCK, AT: True}
    return SymbolicPlant(around.site, around.modules, 0, start)


def test_at_the_start_it_is_what_its_definition_says() -> None:
    assert plant(DOCK).observe()[AT].value is True
    assert plant((0.0, 0.0, 0.0)).observe()[AT].value is False


def test_it_follows_the_base() -> None:
    one = plant(DOCK)
    for y, is_there in ((-1.0, False), (-1.181, True), (-1.179, False), (-1.2, True)):
        assert execute(one, act("move_base", x=0.0, y=y, speed=0.4), allow, 1e9).completed
        assert one.observe()[AT].value is is_there


def test_a_definition_that_reads_what_pictures_show_is_left_to_the_outcomes() -> None:
    around = configuration_of("clean_table")
    ecm = around.modules["clean_table"]
    site = replace(around.site, state={**ecm.state, **around.site.state})
    (seen,) = (name for name in ecm.state if name.endswith("sponge_position"))
    definition = ecm.definitions[AT]
    reading = replace(ecm, definitions={AT: definition, "other": replace(definition, term=_also(ecm, seen))})
    values = {
        "base_position": DOCK,
        "clean_table.dock_position": DOCK,
        seen: DOCK,
        AT: False,
        "other": False,
    }
    PlaceDefinitions(site, [reading]).update(values)
    assert (values[AT], values["other"]) == (True, False)


def _also(ecm: Ecm, name: str) -> t.Term:
    height = t.Component(ecm.state[name].variable, 2)
    return t.And((ecm.definitions[AT].term, t.Compare("<=", height, height)))
