"""The things of the corpus's site that suit a need."""

from __future__ import annotations

import pytest

from aeros.spec.declared.configuration import Need
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import elaborate_source
from aeros.spec.elaborate.module.suitable_things import suitable_things, things_of_sort, wanted_thing
from aeros.spec.model.site import Site
from aeros.spec.text.yaml_reader import read_yaml
from tests.unit.spec.faults import TABLE

OFFERING = (
    ("tabletop: {", "tabletop: {offers: [surface], "),
    ("hand: {", "hand: {offers: [tool_point], "),
    ("slow: {", "slow: {offers: [pace], "),
    ("  overhead: {sensor: camera, ", "  overhead: {sensor: camera, sees: [tabletop], "),
)


@pytest.fixture
def site() -> Site:
    text = TABLE.read_text()
    for old, new in OFFERING:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    found = elaborate_source(Source("site.yaml", text), Diagnostics())
    assert found is not None
    return found


def need(text: str) -> Need:
    node = read_yaml(Source("need.yaml", text), Diagnostics())
    assert node is not None
    decoded = decode(node, Need, Diagnostics())
    assert decoded is not None
    return decoded


@pytest.mark.parametrize(
    ("text", "seen", "found"),
    [
        ("is: volume", "", ["tabletop", "camera_mast"]),
        ("{is: volume, offers: surface}", "", ["tabletop"]),
        ("{is: volume, offers: fridge}", "", []),
        ("{is: constant, unit: mm/s}", "", ["slow"]),
        ("{is: constant, unit: deg}", "", []),  # a table of constants is none
        ("{is: constant, unit: N}", "", ["hard"]),
        ("{is: constant, unit: N, offers: pace}", "", []),
        ("{is: variable, type: vec3, unit: mm}", "", ["hand"]),
        ("{is: variable, type: vec3, unit: m/s}", "", []),
        ("{is: variable, unit: g}", "", ["load"]),
        ("{is: variable, type: tools}", "", ["fetched"]),
        ("{is: variable, type: bool}", "", ["stop_pressed", "person_near", "table_tidy"]),
        ("{is: action, parameters: [speed, target]}", "", ["move"]),
        ("{is: action, parameters: [target, fly]}", "", []),
        ("is: camera", "", ["overhead", "underneath"]),
        ("{is: camera, sees: tabletop}", "tabletop", ["overhead"]),
        ("{is: camera, sees: camera_mast}", "camera_mast", []),
        ("is: resource", "", ["arm", "camera"]),
        ("is: actuator", "", ["arm", "turntable", "wheels"]),
    ],
)
def test_a_suitable_thing_is_of_the_sort_and_the_type_and_offers_the_use(
    site: Site, text: str, seen: str, found: list[str]
) -> None:
    text = text if text.startswith("{") else f"{{{text}}}"
    assert suitable_things(site, need(text), seen, Diagnostics()) == found


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("{is: volume, unit: m}", "AE112"),
        ("{is: volume, sees: tabletop}", "AE112"),
        ("{is: action, offers: surface}", "AE112"),
        ("{is: resource, type: bool}", "AE112"),
        ("{is: variable, type: vec}", "AE122"),
        ("{is: variable, unit: furlong}", "AE207"),
    ],
)
def test_a_need_with_a_fault_is_reported(site: Site, text: str, code: str) -> None:
    sink = Diagnostics()
    assert suitable_things(site, need(text), "", sink) is None
    assert [one.code for one in sink] == [code]


def test_every_sort_of_thing_is_listed_without_things_of_modules(site: Site) -> None:
    assert list(things_of_sort(site, "sensor"))[:2] == ["panel", "scanner"]
    assert all("." not in name for name in things_of_sort(site, "variable"))
    assert things_of_sort(site, "action").keys() == site.kinds.keys()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{is: volume, offers: surface}", "a volume that offers `surface`"),
        ("{is: camera, offers: top_view, sees: area}", "a camera that offers `top_view` and sees `area`"),
        ("{is: camera, sees: area}", "a camera that sees `area`"),
        ("{is: variable, type: vec3, unit: mm}", "a variable of type vec3 in mm"),
        ("{is: constant, unit: N}", "a constant in N"),
        ("{is: action, parameters: [a, b]}", "an action kind with `a`, `b`"),
        ("{is: actuator}", "an actuator"),
    ],
)
def test_a_need_is_described_in_words(text: str, words: str) -> None:
    assert wanted_thing(need(text)) == words
