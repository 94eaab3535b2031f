"""An overlay adds grants, blocks and settings to a site, and changes nothing else of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.declared import site as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import decode_site, load_site
from aeros.spec.text.fields import MappingField
from tests.repo.tree import ROOT

SITE = ROOT / "tests" / "corpus" / "site" / "table.yaml"
OVERLAY = ROOT / "tests" / "corpus" / "overlay" / "table.yaml"
HEAD = f"schema: aeros/overlay/1\nbase: {SITE}\n"


def overlay(folder: Path, text: str, name: str = "cell.yaml", head: str = HEAD) -> Path:
    path = folder / name
    path.write_text(head + text)
    return path


def stripped(site: declared.Site | None) -> declared.Site:
    """Return a site without what an overlay can add."""
    assert site is not None
    policy = replace(site.policy, grants=MappingField(), blocks=())
    return replace(site, policy=policy, modules=MappingField())


def test_an_overlay_changes_grants_blocks_and_settings_alone() -> None:
    assert stripped(decode_site(OVERLAY)) == stripped(decode_site(SITE))
    plain, both = load_site(SITE, Diagnostics()), load_site(OVERLAY, Diagnostics())
    assert plain is not None
    assert both is not None
    assert both.rules == plain.rules
    assert both.joint_rules == plain.joint_rules
    assert both.digest != plain.digest


def test_grants_and_blocks_are_added_to_those_below(tmp_path: Path) -> None:
    lower = overlay(tmp_path, "grants: {a: {actuators: [arm]}, b: {sensors: [camera]}}\n")
    head = f"schema: aeros/overlay/1\nbase: {lower.name}\n"
    text = "grants: {a: {actuators: [wheels, arm], sensors: [scanner]}}\n"
    text += "blocks: [{id: x, action: wipe, reason: y}]\n"
    upper = overlay(tmp_path, text, "upper.yaml", head)
    plain, site = load_site(SITE, Diagnostics()), load_site(upper, Diagnostics())
    assert plain is not None
    assert site is not None
    assert site.grants["a"].actuators == {"arm", "wheels"}
    assert site.grants["a"].sensors == {"scanner"}
    assert site.grants["b"].sensors == {"camera"}
    assert [one.id for one in site.blocks] == [*(one.id for one in plain.blocks), "x"]
    assert (site.grant_spans["a"].source.path, site.grant_spans["b"].source.path) == (str(upper), str(lower))


def test_a_setting_replaces_one_of_the_same_name_below(tmp_path: Path) -> None:
    lower = overlay(tmp_path, "modules: {tidier: {bind: {one: a}, set: {force: 5 N, time: 2 s}}}\n")
    head = f"schema: aeros/overlay/1\nbase: {lower.name}\n"
    upper = overlay(tmp_path, "modules: {tidier: {set: {force: 6 N}}}\n", "upper.yaml", head)
    site = load_site(upper, Diagnostics())
    assert site is not None
    assert site.configurations["tidier"].parameters == {"force": "6 N", "time": "2 s"}
    assert site.configurations["tidier"].bindings == {"one": "a"}


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("invariants: []\n", "AE101"),
        ("policy: {}\n", "AE101"),
        ("grants: {a: {actuators: [whels]}}\n", "AE122"),
        ("blocks: [{id: x, action: wipe, reason: y}, {id: x, action: wipe, reason: y}]\n", "AE120"),
        ("--- # more.yaml\nid: x\n", "AE002"),
    ],
)
def test_a_faulty_overlay_is_no_site(tmp_path: Path, text: str, code: str) -> None:
    sink = Diagnostics()
    assert load_site(overlay(tmp_path, text), sink) is None
    assert code in [one.code for one in sink]
