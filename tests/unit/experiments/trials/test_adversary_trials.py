"""Modules that mean harm do it where nothing is in their way, and behind each layer they do not."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.experiments.catalogue import Row, catalogue
from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.adversaries import KIND
from aeros.spec.expr.semantics import is_true
from tests.unit.experiments.common import premises

ROWS = {row.id: row for row in catalogue("physics")[9].rows}
MODULES = tuple(dict.fromkeys(row.variant for row in ROWS.values()))


def trial(row: Row, **changed: object) -> Findings:
    condition = TrialCondition.create(
        row.condition.kind, row.condition.plant, {**row.condition.settings, **changed}
    )
    with KIND.open(condition, premises()) as one:
        return one(0)


@pytest.mark.physics
@pytest.mark.parametrize("module", MODULES)
def test_only_where_nothing_is_in_its_way_does_a_module_do_harm(module: str) -> None:
    open_, gate, both = (ROWS[f"9/{module}/{layer}"] for layer in ("open", "gate", "both"))
    settings = open_.condition.settings
    found = trial(open_)
    assert found["violated"] is settings["violates"]
    assert not settings["violates"] or found["violations"][0] == settings["watched"]
    for row in (gate, both):
        behind = trial(row)
        assert (behind["violated"], behind["reached"]) == (False, True)
        if settings["violates"]:
            assert behind["told"]
            assert not behind.get("installed", True) or behind["denied"] + behind["stopped"] > 0


@pytest.mark.parametrize("module", MODULES)
def test_refusals_have_the_expected_codes(module: str) -> None:
    row = ROWS[f"9/{module}/both"]
    refused = row.condition.settings["refused"]
    expected = KIND.expected_values(row.condition, premises())
    assert expected == {"violated": 0.0, "installed": float(not refused)}
    if refused:
        # Nothing of a plant is needed: nothing runs.
        found = trial(row, scene="there is none")
        assert (found["installed"], found["told"], found["actions"]) == (False, refused, 0)


@pytest.mark.physics
def test_another_modules_skill_is_refused_even_where_its_actions_are_not() -> None:
    found = trial(ROWS["9/other_access/open"])
    assert found["told"] == ["step refused"]
    assert (found["actions"], found["violations"]) == (1, ["distance off the floor"])


@pytest.mark.physics
@pytest.mark.parametrize("module", ["benign", "apart"])
def test_a_control_is_not_in_anybodys_way(module: str) -> None:
    found = [trial(ROWS[f"9/{module}/{layer}"]) for layer in ("open", "both")]
    assert [one["denied"] + one["stopped"] + one["attenuated"] for one in found] == [0, 0]
    assert found[0]["actions"] == found[1]["actions"] > 0
    assert found[0]["worst"] == found[1]["worst"] > 0


@pytest.mark.parametrize(
    ("rule", "kind", "parameter", "limit"),
    [
        ("cell-speed", "move_tool", "speed", "tool_speed"),
        ("contact-force", "slide", "force", "contact_force"),
    ],
)
def test_the_limits_that_are_written_again_are_those_of_the_rules(
    rule: str, kind: str, parameter: str, limit: str
) -> None:
    (term,) = (one.terms[kind] for one in premises().configuration.site.rules if one.id == rule)
    bound = Fraction(str(ROWS["9/knife/open"].condition.settings["limits"][limit]))
    assert is_true(term, {parameter: bound})
    assert not is_true(term, {parameter: bound + Fraction(1, 1000)})
