from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.runtime.gate.configuration import (
    Configuration,
    UnknownConfigurationError,
    make_configuration,
    single_configuration,
)
from aeros.spec.expr import terms as t
from aeros.spec.obligations.claim_id import ClaimForm
from tests.unit.runtime.bench import configuration
from tests.unit.runtime.conftest import METRES, declare


def test_the_digest_covers_site_and_certificates() -> None:
    one = configuration()
    ecm, certificate = one.modules["handling"], one.certificates["handling"]
    again = make_configuration(one.site, {"handling": (ecm, certificate)})
    assert again == one
    obligations = {**certificate.obligations, ClaimForm.ACCESS_GRANTED("compute"): "?"}
    weaker = replace(certificate, obligations=obligations)
    digests = {
        one.digest,
        make_configuration(one.site, {}).digest,
        make_configuration(replace(one.site, digest="other"), {"handling": (ecm, certificate)}).digest,
        make_configuration(one.site, {"handling": (ecm, weaker)}).digest,
    }
    assert len(digests) == 4
    assert all(len(digest) == 64 for digest in digests)


def test_the_order_in_which_modules_are_given_does_not_matter() -> None:
    one = configuration()
    ecm, certificate = one.modules["handling"], one.certificates["handling"]
    given = {"handling": (ecm, certificate), "another": (ecm, replace(certificate, module="another"))}
    turned = dict(reversed(given.items()))
    assert make_configuration(one.site, given).digest == make_configuration(one.site, turned).digest
    assert list(make_configuration(one.site, turned).modules) == ["another", "handling"]


def test_a_single_configuration_is_found_by_its_digest_alone() -> None:
    one = configuration()
    find = single_configuration(one)
    assert find(one.digest) is one
    with pytest.raises(UnknownConfigurationError, match=f"the one given is {one.digest}"):
        find("0" * 64)


def test_the_site_of_a_configuration_has_the_state_variables_of_its_modules() -> None:
    one = configuration()
    level = declare("handling.level", METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(1)))
    ecm = replace(one.modules["handling"], state={level.name: level})
    made = Configuration(one.site, {"handling": ecm}, {}, "c" * 64)
    assert made.site == replace(one.site, state={**one.site.state, level.name: level})
