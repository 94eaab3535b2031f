"""Resources: what is in force, and refusals; reading moves nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.mcp.resources import RESOURCES, ResourceError, Resources
from aeros.spec.text.discovery import reference_site_path
from tests.unit.apps.mcp.cells import FREE, Cell, cell, dumplings


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    with cell(dumplings(), tmp_path_factory.mktemp("cell"), FREE) as made:
        yield made


@pytest.fixture
def resources(one: Cell) -> Resources:
    return Resources(one.tools, one.folder / "audit.jsonl")


def json_of(resources: Resources, uri: str) -> Any:
    media_type, text = resources.read(uri)
    assert media_type == "application/json"
    return json.loads(text)


def test_every_listed_resource_can_be_read_and_none_moves_anything(one: Cell, resources: Resources) -> None:
    for entry in resources.entries():
        media_type, text = resources.read(entry.uri)
        assert (media_type, bool(text)) == (entry.media_type, True)
    assert len(resources.entries()) == len(RESOURCES) + 1
    assert one.decisions() == 0


def test_reading_is_no_change_that_subscribers_would_hear_of(resources: Resources) -> None:
    before = resources.states()
    for uri in before:
        resources.read(uri)
    assert resources.states() == before


def test_site_and_manifest_are_the_texts_that_were_proved(one: Cell, resources: Resources) -> None:
    assert resources.read("aeros://site")[1] == reference_site_path().read_text(encoding="utf-8")
    manifest = resources.read("aeros://modules/make_dumplings")[1]
    digest = json_of(resources, "aeros://modules")["make_dumplings"]["manifest_digest"]
    assert sha256(manifest.encode()).hexdigest() == digest


def test_the_policy_names_limits_and_invariants(one: Cell, resources: Resources) -> None:
    policy = json_of(resources, "aeros://policy")
    assert policy["mcp"] == {"execute": "allowed", "most_steps": 20, "skills": None}
    assert [rule["id"] for rule in policy["invariants"]] == [rule.id for rule in one.tools.site.rules]
    assert all(rule["require"] for rule in policy["invariants"])


def test_the_newest_records_are_the_end_of_the_log(one: Cell, resources: Resources) -> None:
    one.call("propose_plan", steps=[{"skill": "make_dumplings.boil"}])
    records = one.records()
    assert json_of(resources, "aeros://records/2") == records[-2:]
    assert json_of(resources, "aeros://records") == records[-50:]
    assert json_of(resources, "aeros://records/0") == []
    assert json_of(resources, "aeros://records/9999") == records[-500:]


def test_a_record_that_is_being_written_and_a_huge_log_do_no_harm(one: Cell, tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    line = json.dumps({"sequence": 1, "padding": "x" * 1000})
    log.write_text("\n".join([line] * 6000) + '\n{"sequence": 2, "de')
    found = json_of(Resources(one.tools, log), "aeros://records/500")
    assert len(found) == 499
    assert found[0] == json.loads(line)


def test_world_and_plan_are_those_of_state(one: Cell, resources: Resources) -> None:
    assert json_of(resources, "aeros://plan") is None
    assert json_of(resources, "aeros://world")["state"]["human_distance"]["value"] == 20.0


@pytest.mark.parametrize(
    "uri",
    [
        "aeros://nothing", "aeros://modules/nothing", "aeros://modules/../../etc/passwd", "aeros://records/-1",
        "aeros://records/99999", "aeros://records/x", "aeros://policy/x", "file:///etc/passwd", "site", "",
    ],
)  # fmt: skip
def test_an_unknown_resource_is_refused_and_the_known_ones_are_named(uri: str, resources: Resources) -> None:
    with pytest.raises(ResourceError, match="there are aeros://site, aeros://policy"):
        resources.read(uri)
