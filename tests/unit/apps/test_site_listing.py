"""The listing of a site has each of its names, with the numbers of the file."""

from __future__ import annotations

import json
from collections.abc import Iterable

from aeros.apps.site_listing import ListedNames, as_json, as_markdown, as_text, site_tables
from aeros.spec.elaborate.load import decode_site
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.fields import TextField
from tests.repo.tree import ROOT


def tables(path: str = "tests/corpus/overlay/table.yaml") -> dict[str, ListedNames]:
    site = decode_site(ROOT / path)
    assert site is not None
    return {one.title: one for one in site_tables(site)}


def test_every_name_of_the_reference_site_is_listed_once() -> None:
    site = decode_site(reference_site_path())
    assert site is not None
    listed = {one.title: [row[0].partition("[")[0] for row in one.rows] for one in site_tables(site)}
    declared: dict[str, Iterable[tuple[TextField, object]]] = {
        "volumes": site.volumes,
        "cameras": site.cameras,
        "state variables": site.state,
        "actions": site.actions,
        "constants": site.constants,
        "enums": site.enums,
        "objects": site.objects,
        "resources": site.resources,
        "sensors whose quantities modules declare": site.sensors,
        "movers of sensors": site.moved_by,
    }
    for title, names in declared.items():
        assert listed.pop(title) == [name.value for name, _ in names]
    assert listed.pop("invariants") == [rule.id.value for rule in site.invariants]
    assert listed == {"access": ["all modules", *(name.value for name, _ in site.policy.grants)]}


def test_numbers_and_limits_are_those_of_the_file() -> None:
    found = tables("aeros/sites/panda_cell.yaml")
    rows = {row[0]: row[1:] for one in found.values() for row in one.rows}
    assert rows["bench_area"][:3] == ("280 mm, -360 mm, 12 mm", "620 mm, 370 mm, 500 mm", "work_area")
    assert "speed: real, " in rows["move_tool"][0]
    assert "workspace" in rows["move_tool"][3].split(", ")
    assert rows["overhead"][0] == "table_area" or "bench_area" in rows["overhead"][0]


def test_definitions_are_listed_with_their_conditions() -> None:
    found = tables("tests/corpus/accepted/site_that_defines_predicates/site.yaml")["definitions"]
    assert found.rows[0] == ("person_is_near", "person_distance < 2 m")


def test_movers_of_sensors_and_actions_under_another_word_are_listed() -> None:
    found = tables("aeros/sites/panda_cell.yaml")
    movers = {row[0]: row[1] for row in found["movers of sensors"].rows}
    assert (movers["wheel_odometry"], movers["cell_survey"]) == ("base", "no actuator")
    other = tables("tests/corpus/rejected/site/action_that_means_another/site.yaml")["actions"]
    column = other.columns.index("action of the simulators")
    assert {row[column] for row in other.rows} == {"", "move_tool"}


def test_access_that_an_overlay_grants_is_listed() -> None:
    rows = {row[0]: row[1:] for row in tables()["access"].rows}
    assert rows["actuator_not_granted_by_the_site"] == ("wheels", "", "", "")


def test_tables_are_written_as_text_markdown_and_json() -> None:
    table = ListedNames("cameras", ("camera", "sees", "offers"), (("top", "a | b", ""), ("side", "", "view")))
    assert as_text([table]) == "cameras\n  top\n      sees: a | b\n  side\n      offers: view"
    assert as_markdown([table]) == (
        "## Cameras\n\n| camera | sees | offers |\n| --- | --- | --- |\n"
        "| `top` | a \\| b |  |\n| `side` |  | view |\n"
    )
    assert json.loads(json.dumps(as_json([table]))) == {
        "cameras": {"top": {"sees": "a | b", "offers": ""}, "side": {"sees": "", "offers": "view"}}
    }
