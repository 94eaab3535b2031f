"""A configuration: a site and the modules that are proved and active under it.  Frozen; swapped whole."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from aeros.spec.model.model import Ecm, Site
from aeros.spec.obligations.claim_id import ClaimId
from aeros.spec.verification.certificate import Certificate


@dataclass(frozen=True)
class Configuration:
    """What governs: the site's policy and the certified, active modules.

    certificates: by module; says which invariants the proof left to the gate.
    digest: SHA-256 over site and certificates, in hexadecimal; audit records name it.
    """

    site: Site
    modules: Mapping[str, Ecm]
    certificates: Mapping[str, Certificate]
    digest: str

    def proved_obligations(self, module: str) -> frozenset[ClaimId]:
        """The obligations that are PROVED of exactly this module under exactly this site."""
        ecm, certificate = self.modules[module], self.certificates.get(module)
        subject = (ecm.id, ecm.manifest_digest, self.site.digest)
        if certificate is None or (certificate.module, certificate.manifest, certificate.site) != subject:
            return frozenset()
        return frozenset(id_ for id_, verdict in certificate.obligations.items() if verdict == "PROVED")


class UnknownConfigurationError(Exception):
    """The configuration of that digest is not to be had; the message says why."""


FindConfiguration = Callable[[str], Configuration]
"""Gives the configuration of a digest, or raises `UnknownConfigurationError`."""


def single_configuration(configuration: Configuration) -> FindConfiguration:
    """Knows one configuration."""

    def find(digest: str) -> Configuration:
        if digest != configuration.digest:
            raise UnknownConfigurationError(f"the one given is {configuration.digest}")
        return configuration

    return find


def make_configuration(site: Site, certified: Mapping[str, tuple[Ecm, Certificate]]) -> Configuration:
    """The configuration of `site` with these certified modules, all active."""
    certificates = {name: certificate for name, (_, certificate) in sorted(certified.items())}
    canonical = json.dumps([site.digest, {name: one.text() for name, one in certificates.items()}])
    return Configuration(
        site,
        {name: ecm for name, (ecm, _) in sorted(certified.items())},
        certificates,
        hashlib.sha256(canonical.encode()).hexdigest(),
    )
