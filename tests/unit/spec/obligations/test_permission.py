"""A module stays inside its permissions, and these inside what the site grants."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.missing_access import merge_missing_access
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.load import load_ecm
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.site_layers import read_site
from tests.unit.spec.obligations.data.tidier import Change, compare_reports, failed, module, site

TABLE_CASES = Path(__file__).parents[3] / "corpus" / "accepted"
GRANTED = "    actuators: [arm, turntable]\n    sensors: [panel, scanner, encoders, camera]\n"
PERMITTED = "  actuators: [arm, turntable]\n  sensors: [camera, scanner, encoders]\n"
ARM = "    actuators: [arm]\n    resources: [arm]\n    risk: medium\n    timeout: 30 s\n\n"
BLOCK = "    - {id: brush-lent, module: works_but_is_blocked, action: wipe"


def faults(*changes: Change, at: tuple[Change, ...] = ()) -> dict[str, str]:
    place = site(*at)
    claims = list(permission_obligations(module(*changes, at=place), place))
    compare_reports("permission_reports.txt", (*changes, *at), claims)
    found = failed(claims)
    return {name.removeprefix("permission/"): code for name, code in found.items()}


def failed_access(asked: Ecm, at: Site, title: str) -> dict[str, Diagnostic]:
    claims = [one for one in permission_obligations(asked, at) if isinstance(one, StaticClaim)]
    compare_reports("permission_reports.txt", title, claims)
    return {
        str(one.id).removeprefix("permission/"): one.diagnostic
        for one in claims
        if "permission/access/" in str(one.id) and one.diagnostic is not None
    }


def test_a_module_inside_its_permissions_is_proved() -> None:
    assert faults() == {}


def test_two_actuators_without_permission_are_two_errors() -> None:
    place = site()
    asked = module((PERMITTED, PERMITTED.replace("[arm, turntable]", "[]")), at=place)
    claims = permission_obligations(asked, place)
    found = [one.diagnostic for one in claims if isinstance(one, StaticClaim) and one.diagnostic is not None]
    merged = merge_missing_access(one for one in found if one.code == "AE402")
    assert {one.help[0].partition(" to ")[0] for one in merged} == {"add `arm`", "add `turntable`"}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        # Permissions for actions.
        (("reach: distance(hand, goal) <= 150 mm", "reach: distance(hand, goal) <= 90 mm"), {"fetch/reach": "AE403"}),
        (("reach: distance(hand, goal) <= 150 mm", "reach: distance(hand, goal) < 0 m"),
         {"reach/not-empty": "AE409", "fetch/reach": "AE403"}),
        (("    wipe: pressure <= 20 N\n", "    wipe: pressure <= 19 N\n"), {"scrub/wipe": "AE403"}),
        (("    sweep: true\n", ""), {"sweep_arm/sweep": "AE401"}),
        # Actuators of the skill and of the module.
        (("    actuators: [turntable]\n", ""), {"roll/spin/actuators": "AE402"}),
        ((PERMITTED, PERMITTED.replace(", turntable", "")), {"roll/actuators": "AE402"}),
        ((PERMITTED, PERMITTED.replace("turntable", "turntable, wheels")), {"access/actuators": "AE404"}),
        ((PERMITTED, PERMITTED.replace("turntable", "turntable, flipper")), {"access/actuators": "AE404"}),
        ((PERMITTED, PERMITTED.replace("camera,", "camera, lamp, nose,")), {"access/sensors": "AE404"}),
        ((ARM + "  roll:", ARM.replace("    resources: [arm]\n", "") + "  roll:"), {"sweep_arm/held": "AE410"}),
        # Risk.
        (("    risk: medium\n    timeout: 30 s\n\n  scrub:", "    risk: low\n    timeout: 30 s\n\n  scrub:"),
         {"fetch/risk-stated": "AE407"}),
        (("    risk: medium\n    timeout: 30 s\n\n  scrub:", "    risk: high\n    timeout: 30 s\n\n  scrub:"),
         {"fetch/risk-ceiling": "AE406"}),
        # Sensors of conditions, hold-conditions, envelopes, permissions, effects, tasks and compositions.
        (("    sweep: true\n", "    sweep: not stop_pressed\n"),
         {"access/sensors": "AE405", "sweep_arm/sweep": "AE403"}),
        (("    goal: table_tidy\n", "    goal: table_tidy\n    invariants: [{id: calm, require: not stop_pressed}]\n"),
         {"task/tidy_up/sensors": "AE405"}),
        ((PERMITTED, PERMITTED.replace(", encoders", "")), {"access/sensors": "AE405", "fetch/sensors": "AE405"}),
        ((PERMITTED, PERMITTED.replace("camera, ", "")),
         {"fetch/sensors": "AE405", "scrub/sensors": "AE405", "task/tidy_up/sensors": "AE405",
          "composition/clean/sensors": "AE405"}),
        (("precondition: fetched == sponge", "precondition: fetched == sponge and not stop_pressed"),
         {"scrub/sensors": "AE405"}),
        (("hold: dirt < 90 %", "hold: not stop_pressed"), {"scrub/sensors": "AE405"}),
        (("sweep: rate <= 0.2 rad/s", "sweep: stop_pressed or rate <= 0.2 rad/s"), {"sweep_arm/sensors": "AE405"}),
        (("goal: table_tidy", "goal: table_tidy and not stop_pressed"), {"task/tidy_up/sensors": "AE405"}),
        (("{unless: table_tidy, do: scrub", "{unless: table_tidy or stop_pressed, do: scrub"),
         {"task/tidy_up/sensors": "AE405"}),
        (("    precondition: not table_tidy\n    do:", "    precondition: not stop_pressed\n    do:"),
         {"composition/clean/sensors": "AE405"}),
        (("        - {skill: weigh}", "        - {if: stop_pressed, then: {skill: weigh}, else: {skill: weigh, id: w}}"),
         {"composition/clean/sensors": "AE405"}),
    ],
)  # fmt: skip
def test_a_change_of_the_module_fails_these_claims_alone(change: Change, expected: dict[str, str]) -> None:
    assert faults(change) == expected


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ((GRANTED, GRANTED.replace(", turntable", "")), {"access/actuators": "AE404"}),
        ((GRANTED, GRANTED.replace(", camera", "")), {"access/sensors": "AE404"}),
        (("risk_ceiling: medium", "risk_ceiling: low"),
         {f"{name}/risk-ceiling": "AE406" for name in ("fetch", "scrub", "sweep_arm", "roll")}),
        # An override of the module is reported, and refutes nothing.
        ((BLOCK, "    - {id: brush-lent, module: tidier, action: wipe"), {"unblocked/brush-lent": "AE408?"}),
        ((BLOCK, "    - {id: brush-lent, action: wipe"), {"unblocked/brush-lent": "AE408?"}),
        ((BLOCK, "    - {id: brush-lent, module: tidier, action: knock"), {}),
    ],
)  # fmt: skip
def test_a_change_of_the_site_fails_these_claims_alone(change: Change, expected: dict[str, str]) -> None:
    assert faults(at=(change,)) == expected


def _replacements(value: Any, reads: t.Term) -> Iterator[Any]:
    """Yield copies of a model in each of which one term is replaced by `reads`."""
    if isinstance(value, t.Term):
        yield reads
    elif is_dataclass(value) and not isinstance(value, type | SourceSpan | Declared | Conjunct):
        for field in fields(value):
            for inner in _replacements(getattr(value, field.name), reads):
                yield replace(value, **{field.name: inner})
    elif isinstance(value, Mapping):
        for key, old in value.items():
            for inner in _replacements(old, reads):
                yield {**value, key: inner}
    elif isinstance(value, tuple):
        for at, old in enumerate(value):
            for inner in _replacements(old, reads):
                yield (*value[:at], inner, *value[at + 1 :])


def test_a_sensor_without_permission_is_refused_wherever_a_condition_of_the_module_reads_it() -> None:
    place = site()
    whole = module(
        (
            "    goal: table_tidy\n",
            "    goal: table_tidy\n    invariants: [{id: calm, require: table_tidy}]\n",
        ),
        (
            "        - {skill: weigh}",
            "        - {if: table_tidy, then: {skill: weigh}, else: {skill: weigh, id: w}}",
        ),
        at=place,
    )
    changed = list(_replacements(whole, place.state["stop_pressed"].variable))
    assert len(changed) >= 15
    for one in changed:
        assert "AE405" in failed(permission_obligations(one, place)).values()


def test_a_thing_that_the_module_names_itself_is_reported_by_both_names() -> None:
    place = site((GRANTED, "    sensors: [panel, scanner]\n"))
    loaded = load_ecm(TABLE_CASES / "needs_with_one_choice_each", site(), Diagnostics())
    assert loaded is not None
    bare = replace(
        loaded.ecm,
        requested_access=replace(loaded.ecm.requested_access, actuators=frozenset(), sensors=frozenset()),
    )
    for title, one in (("names of its own", loaded.ecm), ("names of its own without permission", bare)):
        claims = list(permission_obligations(one, place))
        compare_reports("permission_reports.txt", title, claims)
        assert "AE404" in failed(claims).values() or "AE405" in failed(claims).values()


def test_access_to_channels_and_computing_devices_must_be_granted_too() -> None:
    asked = (PERMITTED, f"{PERMITTED}  channels: [announcements]\n  compute: [gpu]\n")
    granted = (GRANTED, f"{GRANTED}    channels: [announcements]\n    compute: [gpu]\n")
    device = ("\nresources: {arm: 1", "\ncompute: {gpu: /dev/nvidia0}\n\nresources: {arm: 1")
    assert faults(asked, at=(granted, device)) == {}
    assert faults(asked) == {"access/channels": "AE404", "access/compute": "AE404"}


def test_an_action_that_uses_a_channel_needs_a_permission_for_it() -> None:
    asked = (PERMITTED, f"{PERMITTED}  channels: [announcements]\n")
    place = site((GRANTED, f"{GRANTED}    channels: [announcements]\n"))
    waiting = replace(place.kinds["wait"], tool=cast("Any", SimpleNamespace(channel="announcements")))
    heard = replace(place, kinds={**place.kinds, "wait": waiting})
    claims = list(permission_obligations(module(at=place), heard))
    compare_reports("permission_reports.txt", "a channel", claims)
    channels = {"permission/weigh/wait/channels": "AE411", "permission/spend/wait/channels": "AE411"}
    assert failed(claims) == channels
    permitted = {str(one.id) for one in permission_obligations(module(asked, at=place), heard)}
    assert permitted >= channels.keys()
    assert failed(permission_obligations(module(asked, at=place), heard)) == {}


def test_a_refusal_names_all_that_is_missing_in_order() -> None:
    place = site((GRANTED, "    sensors: [panel, scanner, encoders, camera]\n"))
    claims = permission_obligations(module(at=place), place)
    (reported,) = [one.diagnostic for one in claims if str(one.id) == "permission/access/actuators"]  # type: ignore[union-attr]
    assert reported is not None
    assert reported.headline == "the site does not grant `tidier` the actuators `arm`, `turntable`"


def test_a_risk_is_reported_by_its_word() -> None:
    high = (
        "    risk: medium\n    timeout: 30 s\n\n  scrub:",
        "    risk: high\n    timeout: 30 s\n\n  scrub:",
    )
    low = (high[0], high[1].replace("high", "low"))
    reported = [
        one.diagnostic.headline
        for change in (high, low)
        for one in permission_obligations(module(change), site())
        if isinstance(one, StaticClaim) and one.diagnostic is not None
    ]
    assert reported == [
        "`fetch` is of high risk; this site allows medium at most",
        "`fetch` declares low risk, but `reach` carries more",
    ]


def test_a_refusal_says_the_lines_that_grant_everything_that_is_missing() -> None:
    asked = (PERMITTED, f"{PERMITTED}  channels: [announcements]\n")
    place = site((GRANTED, GRANTED.replace(", camera", "")))
    claims = failed_access(module(asked, at=site()), place, "a sensor and a channel that are not granted")
    assert sorted(claims) == ["access/channels", "access/sensors"]
    for one in claims.values():
        (cure,) = one.help
        assert "`tidier: {sensors: [camera], channels: [announcements]}` under `policy.grants`" in cure
    assert claims["access/sensors"].primary is not None
    assert claims["access/sensors"].primary.span.text == "camera"


def test_at_the_reference_site_a_refusal_says_the_whole_overlay() -> None:
    place = site((GRANTED, GRANTED.replace(", camera", "")))
    reference = read_site(reference_site_path()).span(0, 1)
    claims = failed_access(module(at=site()), replace(place, span=reference), "at the reference site")
    first, second = claims["access/sensors"].help
    assert "`schema: aeros/overlay/1` and `grants: {tidier: {sensors: [camera]}}`" in first
    assert "`aeros policy cell.yaml`" in second
