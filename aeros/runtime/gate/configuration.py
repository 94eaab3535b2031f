"""Configurations: a site and the modules proved and active under it. Frozen, and replaced as a whole."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimId
from aeros.spec.verification.certificate import Certificate


@dataclass(frozen=True)
class Configuration:
    """The site's policy and the certified, active modules that the gate enforces.

    Attributes:
        site: the site with its rules and its policy, and with the state variables of the modules.
        modules: active modules by name.
        certificates: by module name; says which invariants the proof left to the gate.
        digest: SHA-256 over site and certificates, in hexadecimal; audit records name it.
    """

    site: Site
    modules: Mapping[str, Ecm]
    certificates: Mapping[str, Certificate]
    digest: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "site", self.site.with_modules(self.modules.values()))

    def proved_obligations(self, module: str) -> frozenset[ClaimId]:
        """Return the obligations that are PROVED of exactly this module under exactly this site.

        Args:
            module: the name of an active module.

        Returns:
            Their ids; none if the certificate is missing or is of another module, manifest or site.

        Raises:
            KeyError: no such module is active.
        """
        ecm, certificate = self.modules[module], self.certificates.get(module)
        subject = (ecm.id, ecm.manifest_digest, self.site.digest)
        if certificate is None or (certificate.module, certificate.manifest, certificate.site) != subject:
            return frozenset()
        return frozenset(id_ for id_, verdict in certificate.obligations.items() if verdict == "PROVED")


class UnknownConfigurationError(Exception):
    """The configuration with a given digest is not available; the message says why."""


FindConfiguration = Callable[[str], Configuration]
"""Function that returns the configuration with a digest, or raises `UnknownConfigurationError`."""


def single_configuration(configuration: Configuration) -> FindConfiguration:
    """Make a `FindConfiguration` that knows one configuration.

    Args:
        configuration: that configuration.

    Returns:
        The function.
    """

    def find(digest: str) -> Configuration:
        if digest != configuration.digest:
            raise UnknownConfigurationError(f"the one given is {configuration.digest}")
        return configuration

    return find


def make_configuration(site: Site, certified: Mapping[str, tuple[Ecm, Certificate]]) -> Configuration:
    """Build the configuration of a site and certified modules, all of them active.

    Args:
        site: the site, with its operator overrides.
        certified: each module and its certificate, by the module's name.

    Returns:
        The configuration, with its digest.
    """
    certificates = {name: certificate for name, (_, certificate) in sorted(certified.items())}
    canonical = json.dumps([site.digest, {name: one.text() for name, one in certificates.items()}])
    return Configuration(
        site,
        {name: ecm for name, (ecm, _) in sorted(certified.items())},
        certificates,
        hashlib.sha256(canonical.encode()).hexdigest(),
    )
