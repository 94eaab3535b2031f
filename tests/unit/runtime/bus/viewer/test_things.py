"""Things: which variables say where something is, and which cameras see it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.runtime.bus.viewer.things import cameras_of_perceivers, seen_by, things_of
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.unit.runtime.conftest import declare

BOX = AxisAlignedBox((Fraction(-1),) * 3, (Fraction(1),) * 3)


def with_variables(site: Site) -> Site:
    def place(name: str, sensor: str, box: AxisAlignedBox | None = None) -> None:
        state[name] = declare(
            name,
            VectorType(LENGTH),
            t.VariableRole.STATE,
            sensor=sensor,
            max_age=Fraction(5),
            occupies=box,
        )

    state = dict(site.state)
    place("m.red_cube_position", "m.look", BOX)
    place("m.push_place", "m.look")
    place("m.push_way", "m.look")
    place("m.dock_position", "survey")
    place("m.shift_by_replace", "m.look")
    place("m.decomposition", "m.look")
    place("m.lump", "m.look", BOX)
    return replace(site, state=state)


def test_a_place_has_a_space_or_a_name_that_says_so(site: Site) -> None:
    things = {one.variable: one for one in things_of(with_variables(site))}
    assert list(things) == ["m.red_cube_position", "m.push_place", "m.dock_position", "m.lump"]
    cube = things["m.red_cube_position"]
    assert (cube.label, cube.perceiver, cube.max_age) == ("red cube", "m.look", 5.0)
    assert cube.box == ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    assert things["m.dock_position"].perceiver == ""
    assert things["m.push_place"].box is None


def test_a_thing_is_seen_by_the_cameras_of_its_perceiver(site: Site) -> None:
    things = things_of(with_variables(site))
    found = seen_by(things, {"m.look": frozenset({"top", "side"}), "m.other": frozenset({"hand"})})
    assert {camera: [one.label for one in there] for camera, there in found.items()} == {
        "side": ["red cube", "push place", "lump"],
        "top": ["red cube", "push place", "lump"],
    }


def test_cameras_have_the_names_of_the_site() -> None:
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    loaded = None if site is None else load_ecm(ROOT / "ecms" / "clean_table", site, diagnostics)
    assert loaded is not None
    cameras = cameras_of_perceivers([loaded.ecm])
    assert cameras["clean_table.see_table"] == {"table_top"}
