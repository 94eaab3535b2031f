"""Settings of modules: a claim for each, and a problem for those of a module that is not there."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Severity
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.summary import BlockSummary, ModuleSummary, SiteSummary
from aeros.spec.obligations.absent_modules import (
    absent_settings,
    misspelt_policy_names,
    names_near,
    policy_name_obligations,
    settings_obligations,
)
from aeros.spec.text.discovery import reference_site_path
from tests.reports_in_full import claim_lines, compare_with_file
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
    claims = list(policy_name_obligations({"serve": ()}, site))
    assert [str(one.id).rpartition("/")[2] for one in claims] == ["polish", "serve", "brew"]
    found = [one.diagnostic for one in claims]
    assert found[1:] == [None, None]
    assert found[0] is not None
    assert found[0].headline == (
        "the site grants further access to `polish`, `brew`, which are not in this set"
    )
    assert len(found[0].secondary) == 1


def blocked(module: str, skill: str | None = None) -> BlockSummary:
    return BlockSummary("one", module, skill, SPAN)


@pytest.mark.parametrize(
    ("block", "others", "help_"),
    [
        (blocked("polish", "rub"), (), None),
        (blocked("polish"), (), None),
        (blocked("polish", "rubb"), (), "did you mean `polish.rub`?"),
        (blocked("polish", "zzz"), (), "correct the name if something is meant to be blocked"),
        (blocked("polsh"), (), "did you mean `polish`?"),
        (blocked("polsh"), ("polsh",), None),
        (blocked("serve"), (), None),
    ],
)
def test_a_block_that_nearly_names_the_one_module_is_a_warning(
    block: BlockSummary, others: tuple[str, ...], help_: str | None
) -> None:
    site = build(SiteSummary, grants={}, shared={}, blocks=(block,), settings={})
    polish = build(ModuleSummary, id="polish", skills=frozenset({"rub", "shine"}))
    found = [one.diagnostic for one in misspelt_policy_names(polish, site, others)]
    assert [one.help for one in found if one is not None] == ([] if help_ is None else [(help_,)])
    assert len(found) == (help_ is not None)


def test_names_are_near_if_a_slip_makes_them_equal() -> None:
    shipped = Source(str(reference_site_path()), "grants").span(0, 6)
    grants = {"polsh": SPAN, "polisch": shipped, "brew": SPAN, "polish": SPAN}
    site = build(SiteSummary, grants=grants, blocks=(blocked("pollish"),))
    assert names_near({"polish"}, site) == {"polsh", "pollish"}


def test_the_reports_on_names_of_absent_modules_in_full() -> None:
    blocks = (blocked("polish", "rubb"), blocked("polish", "zzz"), blocked("polsh"), blocked("serve"))
    polish = {"polish": ("rub", "shine")}
    lines: list[str] = []
    shared = {"polish.gloss": SPAN, "serve.tray": SPAN}
    for grants, more in ((("serve",), {"shared": shared, "blocks": blocks}), (("serve", "brew", "pour"), {})):
        given = {"shared": {}, "blocks": (), **more}
        site = build(SiteSummary, grants=dict.fromkeys(grants, SPAN), **given)
        lines += [line for one in policy_name_obligations(polish, site) for line in claim_lines(one)]
    for settings, names in (({"polish": SPAN, "serve": None}, ("polsh", "serv")), ({"brew": SPAN}, ())):
        lines += [line for one in settings_obligations(settings, names) for line in claim_lines(one)]
    data = Path(__file__).with_name("data")
    compare_with_file(data / "absent_module_reports.txt", "\n".join(lines) + "\n")
