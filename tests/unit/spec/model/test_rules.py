"""Rules of a site: the levels of risk, and which rules constrain the action itself."""

from __future__ import annotations

from dataclasses import replace

from aeros.sim.fixed_step_plant import _PLANNERS
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.rules import SIMULATED_ACTIONS, Risk, Rule, parameter_differences
from aeros.spec.text.discovery import reference_site_path
from tests.unit.agent.dumplings import build, term

_PARAMETER = t.Variable("gentle", BOOL, t.VariableRole.PARAMETER)


def test_risks_are_ordered() -> None:
    assert Risk.LOW < Risk.MEDIUM < Risk.HIGH


def test_a_rule_constrains_an_action_if_it_reads_a_parameter_or_nothing() -> None:
    rule = build(
        Rule,
        terms={
            "reads_a_parameter": t.Implies(term("dumpling_wrapped"), _PARAMETER),
            "reads_the_state": term("dumpling_wrapped"),
            "reads_nothing": t.FALSE,
        },
    )
    assert [kind for kind in rule.terms if rule.constrains_action(kind)] == [
        "reads_a_parameter",
        "reads_nothing",
    ]


def test_simulated_actions_are_those_of_the_simulator_and_of_the_reference_site() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert SIMULATED_ACTIONS.keys() == {*_PLANNERS, "look"}
    for name in SIMULATED_ACTIONS:
        assert parameter_differences(site.kinds[name], name) == []


def test_differences_name_each_parameter() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert parameter_differences(site.kinds["slide"], "move_tool") == [
        "`yaw` is missing (real [rad])",
        "`force` is too many",
    ]
    assert parameter_differences(site.kinds["move_tool"], "wait")[0] == "`duration` is missing (real [s])"
    wide = site.kinds["grip"].parameters["force"]
    narrow = replace(site.kinds["grip"], parameters={"width": wide, "force": wide})
    assert parameter_differences(narrow, "grip") == [f"`width` is {wide.variable.type}, and not real [m]"]
