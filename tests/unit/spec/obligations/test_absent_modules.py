"""Settings of modules: a claim for each, and a problem for those of a module that is not there."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Severity
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.summary import ModuleSummary, SiteSummary
from aeros.spec.obligations.absent_modules import (
    absent_settings,
    policy_name_obligations,
    settings_obligations,
)
from tests.unit.agent.dumplings import build

SPAN = Source("site.yaml", "polish: {}").span(0, 6)


def test_settings_of_modules_that_are_there_are_claims_without_a_problem() -> None:
    claims = list(settings_obligations({"polish": SPAN, "serve": None}, {"polish", "serve"}))
    assert [str(one.id) for one in claims] == [
        "configuration/settings/polish",
        "configuration/settings/serve",
    ]
    assert [one.diagnostic for one in claims] == [None, None]


def test_settings_of_a_site_file_are_a_warning_and_those_of_the_operator_an_error() -> None:
    claims = settings_obligations({"polish": SPAN, "serve": None}, {"polsh"})
    warning, error = (one.diagnostic for one in claims)
    assert warning is not None
    assert error is not None
    assert (warning.severity, error.severity) == (Severity.WARNING, Severity.ERROR)
    assert (warning.primary and warning.primary.span, error.primary) == (SPAN, None)
    assert (warning.help, error.help) == (("did you mean `polsh`?",), ("the modules are `polsh`",))


def test_without_any_module_none_is_suggested() -> None:
    assert absent_settings("polish", None, ()).help == ("there is no module",)


def test_grants_of_several_absent_modules_are_one_warning() -> None:
    grants = dict.fromkeys(("polish", "serve", "brew"), SPAN)
    site = build(SiteSummary, grants=grants, shared={}, blocks=())
    claims = list(policy_name_obligations([build(ModuleSummary, id="serve")], site))
    assert [str(one.id).rpartition("/")[2] for one in claims] == ["polish", "serve", "brew"]
    found = [one.diagnostic for one in claims]
    assert found[1:] == [None, None]
    assert found[0] is not None
    assert found[0].headline == (
        "the site grants further access to `polish`, `brew`, which are not in this set"
    )
    assert len(found[0].secondary) == 1
