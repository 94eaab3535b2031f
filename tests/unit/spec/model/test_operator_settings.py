"""Settings of an operator, applied to a site."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.text.discovery import reference_site_path

BLOCK = OperatorOverride("worn", "worn out", None, None, "grip")
BOUND = {"tidy": ModuleConfiguration({"surface": "bench"})}


def test_blocks_change_the_digest_and_configurations_do_not() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert NO_SETTINGS.applied_to(site) is site
    assert OperatorSettings((BLOCK,)).applied_to(site).digest != site.digest
    configured = OperatorSettings(configurations=BOUND).applied_to(site)
    assert configured.digest == site.digest
    assert configured.configurations == BOUND


def test_different_settings_have_different_identities() -> None:
    different = [
        NO_SETTINGS,
        OperatorSettings((BLOCK,)),
        OperatorSettings(configurations=BOUND),
        OperatorSettings(configurations={"tidy": ModuleConfiguration(parameters={"surface": "bench"})}),
        OperatorSettings(configurations={"wipe": ModuleConfiguration({"surface": "bench"})}),
    ]
    assert all((one.identity == other.identity) == (one is other) for one in different for other in different)
    assert OperatorSettings(configurations={"tidy": ModuleConfiguration()}).identity == NO_SETTINGS.identity
