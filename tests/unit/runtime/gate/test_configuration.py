from __future__ import annotations

from dataclasses import replace

from aeros.runtime.gate.configuration import configure
from aeros.spec.obligations.claim_id import ClaimForm
from tests.unit.runtime.bench import configuration


def test_the_digest_is_that_of_site_and_certificates() -> None:
    one = configuration()
    ecm, certificate = one.modules["handling"], one.certificates["handling"]
    again = configure(one.site, {"handling": (ecm, certificate)})
    assert again == one
    obligations = {**certificate.obligations, ClaimForm.ACCESS_GRANTED("compute"): "?"}
    weaker = replace(certificate, obligations=obligations)
    digests = {
        one.digest,
        configure(one.site, {}).digest,
        configure(replace(one.site, digest="other"), {"handling": (ecm, certificate)}).digest,
        configure(one.site, {"handling": (ecm, weaker)}).digest,
    }
    assert len(digests) == 4
    assert all(len(digest) == 64 for digest in digests)


def test_the_order_in_which_modules_are_given_does_not_matter() -> None:
    one = configuration()
    ecm, certificate = one.modules["handling"], one.certificates["handling"]
    given = {"handling": (ecm, certificate), "another": (ecm, replace(certificate, module="another"))}
    turned = dict(reversed(given.items()))
    assert configure(one.site, given).digest == configure(one.site, turned).digest
    assert list(configure(one.site, turned).modules) == ["another", "handling"]
