from __future__ import annotations

from dataclasses import replace

from aeros.runtime.gate.configuration import make_configuration
from aeros.spec.obligations.claim_id import ClaimForm
from tests.unit.runtime.bench import configuration


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
