"""Claims about a site alone: its rules agree, none is idle, and the protective stop is always allowed."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.policy import action_space, policy_obligations
from aeros.spec.text.discovery import reference_site_path
from tests.reports_in_full import claim_lines, compare_with_section
from tests.unit.spec.obligations.data.tidier import Change, failed, site

ATTENUATE = 'attenuate: {pace: "min(pace, slow)"}'
WAITS = "require: duration <= 30 s"


def rule(id_: str, on: str, require: str) -> Change:
    """A further rule."""
    text = (
        f"  - id: {id_}\n    on: [{on}]\n    require: {require}\n    rationale: a test\n    source: a test\n"
    )
    return "invariants:\n", f"invariants:\n{text}"


def faults(*changes: Change) -> dict[str, str]:
    found = failed(policy_obligations(site(*changes)))
    return {name.removeprefix("policy/"): code for name, code in found.items()}


def test_the_table_s_policy_is_proved() -> None:
    assert faults() == {}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        # Where no wait is ever allowed, the stop button denies none alone.
        (rule("long-waits", "wait", "duration >= 31 s"),
         {"wait/satisfiable": "AE601", "wait/unshadowed/stop-button": "AE604"}),
        (rule("any-wait", "wait", "duration <= 600 s"),
         {"wait/effective/any-wait": "AE603", "wait/unshadowed/any-wait": "AE604"}),
        (rule("most-waits", "wait", "duration <= 100 s"), {"wait/unshadowed/most-waits": "AE604"}),
        (rule("few-waits", "wait", "duration <= 10 s"), {"wait/unshadowed/short-waits": "AE604"}),
        (rule("same-waits", "wait", "duration <= 30 s"),
         {"wait/unshadowed/short-waits": "AE604", "wait/unshadowed/same-waits": "AE604"}),
        # The protective stop.
        (rule("no-stop-near", "stop", "not person_near"), {"stop/allowed/no-stop-near": "AE602"}),
        (rule("stop", "stop", "person_near or not person_near"), {}),
        (("module: works_but_is_blocked, action: wipe", "action: stop"), {"stop/unblocked/brush-lent": "AE602"}),
        # Attenuation.
        ((ATTENUATE, 'attenuate: {pace: "min(pace, 2 * slow)"}'),
         {"approach/attenuation-allowed/slow-near-person": "AE605"}),
        ((ATTENUATE, 'attenuate: {pace: "slow"}'), {}),
        ((ATTENUATE, 'attenuate: {pace: "min(pace, slow) - slow * 2"}'),
         {"approach/attenuation-shrinks/slow-near-person": "AE606"}),
        ((ATTENUATE, 'attenuate: {pace: "-pace"}'), {"approach/attenuation-shrinks/slow-near-person": "AE606"}),
        ((ATTENUATE, ""), {}),
    ],
)  # fmt: skip
def test_a_change_of_the_site_fails_these_claims_alone(change: Change, expected: dict[str, str]) -> None:
    assert faults(change) == expected


def test_an_attenuation_may_not_enlarge_a_parameter_on_either_side_of_zero() -> None:
    swing = (
        "    on: [turn]\n    require: abs(angle) < 90 deg\n",
        "    on: [turn]\n    require: person_near implies abs(angle) <= 1 rad\n    attenuate: {angle: ATTENUATED}\n",
    )

    def shrinks(text: str) -> dict[str, str]:
        return faults((swing[0], swing[1].replace("ATTENUATED", f'"{text}"')))

    assert shrinks("clamp(angle, -1 rad, 1 rad)") == {}
    assert shrinks("angle * 0") == {}
    assert list(shrinks("clamp(-angle, -1 rad, 1 rad)")) == ["turn/attenuation-shrinks/quarter-turn"]
    assert list(shrinks("1 rad")) == ["turn/attenuation-shrinks/quarter-turn"]
    assert list(shrinks("-1 rad")) == ["turn/attenuation-shrinks/quarter-turn"]


def test_the_space_of_an_action_is_every_state_and_parameter() -> None:
    place = site()
    space = action_space(place, place.kinds["wipe"])
    assert [one.name for one in space.variables] == [*place.observed_variables, "tool", "pressure"]
    assert space.assumptions == ()


def test_quotas_are_claimed_with_the_policy() -> None:
    assert any("wipe-rate" in str(one.id) for one in policy_obligations(site()))


def test_the_report_of_an_idle_rule_points_at_the_rule_alone() -> None:
    claims = [one for one in policy_obligations(site()) if isinstance(one, Obligation)]
    alone = {str(one.id).split("/")[2] for one in claims if one.primary_alone}
    assert alone == {"effective", "unshadowed"}


CONTACT = Path(__file__).parents[3] / "corpus/rejected/site/contact_speed_that_no_rule_keeps/site.yaml"


@pytest.mark.parametrize("distance_mm", [0, 1199, 1200, 2000])
@pytest.mark.parametrize("speed_mm_s", [0, 323, 324])
def test_a_contact_is_refused_exactly_where_the_rules_allow_a_faster_one(
    tmp_path: Path, distance_mm: int, speed_mm_s: int
) -> None:
    """The contact is within 1200 mm, and at most at 323 mm/s."""
    text = CONTACT.read_text()
    rule_text = "human_distance < 1 m implies link_speed <= 250 mm/s"
    assert text.count(rule_text) == 1
    rule_now = f"human_distance < {distance_mm} mm implies link_speed <= {speed_mm_s} mm/s"
    path = tmp_path / "site.yaml"
    path.write_text(text.replace(rule_text, rule_now))
    loaded = load_site(path, Diagnostics())
    assert loaded is not None
    found = failed(one for one in policy_obligations(loaded) if str(one.id).endswith("/contact-speed"))
    keeps = distance_mm >= 1200 and speed_mm_s <= 323
    assert found == ({} if keeps else {"policy/move/contact-speed": "AE612"})


@pytest.mark.parametrize("cell", ["iiwa_cell", "panda_cell"])
def test_a_contact_is_with_the_arm_with_the_base_or_with_both(cell: str) -> None:
    loaded = load_site(reference_site_path().with_name(f"{cell}.yaml"), Diagnostics())
    assert loaded is not None
    lines: list[str] = []
    for one in policy_obligations(loaded):
        if isinstance(one, Obligation) and one.id.form is ClaimForm.CONTACT_SPEED_KEPT:
            lines += [line for line in claim_lines(one) if not line.startswith(("    assumes", "    over"))]
    file = Path(__file__).with_name("data") / "contact_claims.txt"
    compare_with_section(file, cell, "".join(f"{line}\n" for line in lines))
