"""Certificates of proofs, written as `ecm.lock`: verdicts, digests of the proved files, and verifier.

A certificate is canonical JSON.  It holds its own digest, so an edit of it is noticed, and the digests of
manifest, code, models and site, so an edit of any of those is noticed.  It is a record and not an authority:
anybody can write a file.  So a configuration is proved again when it is loaded, and the certificate must then
equal the result (docs/decisions/0004-certificates-are-rechecked.md).
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from json.encoder import encode_basestring_ascii
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import aeros
from aeros.spec.backends.package_versions import z3_version
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration, setting_options
from aeros.spec.text.digests import text_digest
from aeros.spec.text.files import read_source

if TYPE_CHECKING:
    from aeros.spec.model.ecm import Ecm
    from aeros.spec.model.site import Site
    from aeros.spec.model.summary import ModuleSummary, SiteSummary
    from aeros.spec.obligations.claim_id import ClaimId

LOCK = "ecm.lock"
GUARDED: Final = "GUARDED"
"""Verdict on an obligation that the gate decides at run time."""
_OF_THE_FILES: Final = frozenset({"schema", "module", "version", "manifest", "code", "models"})
"""Fields of a certificate that policy and settings have no influence on."""
_OF_THE_OPERATOR: Final = frozenset({"site", "configuration"})
"""Fields of a certificate that name the policy and the settings."""


@dataclass(frozen=True)
class Certificate:
    """Record of the proof of a module under a site.

    Attributes:
        schema: name and version of the format.
        module: id of the module.
        version: version of the module.
        manifest: SHA-256 of the manifest, in hexadecimal.
        code: SHA-256 of the code, in hexadecimal.
        models: SHA-256 of each model file, in hexadecimal, by path in the module.
        site: SHA-256 of the site file, in hexadecimal.
        verifier: AEROS and its version.
        solver: the solver and its version.
        obligations: the verdict on each obligation, PROVED or GUARDED.
        engines: what decided an obligation and its version, where it is neither AEROS's own reading nor the
            solver; left out where it is empty.
        configuration: the site's name for everything that the module needs, and the value of each of its
            parameters, by the module's name; left out where it is empty.
        resources: limits that the module declares on its processes, as in `skills.processor: 50 %`; left out
            where it is empty.
    """

    schema: str
    module: str
    version: str
    manifest: str
    code: str
    models: Mapping[str, str]
    site: str
    verifier: str
    solver: str
    obligations: Mapping[ClaimId, str]
    engines: Mapping[ClaimId, str] = field(default_factory=dict)
    configuration: Mapping[str, str] = field(default_factory=dict)
    resources: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of all other fields, which the certificate holds too."""
        return _digest(_body(self))

    @cached_property
    def _text(self) -> str:
        body = _body(self)
        vars(self).setdefault("digest", _digest(body))
        return _dump_json({**body, "digest": self.digest}, "") + "\n"

    def text(self) -> str:
        """Write the certificate as JSON.

        Returns:
            The contents of `ecm.lock`.
        """
        return self._text

    def runtime_checked_rules(self, skill: str, kind: str) -> frozenset[str]:
        """List the invariants that the gate must decide for a skill's actions of one kind.

        Args:
            skill: name of the skill.
            kind: the action kind.

        Returns:
            Names of the invariants.
        """
        # Imported where they are needed: `aeros verify` of what is proved already starts without them.
        from aeros.spec.obligations.claim_id import ClaimForm

        return frozenset(
            claim_id.name_of("invariant")
            for claim_id, verdict in self.obligations.items()
            if verdict == GUARDED
            and claim_id.form is ClaimForm.ENVELOPE_OBEYS
            and claim_id.names[:2] == (skill, kind)
        )


_CERTIFICATES: Final[dict[str, Certificate]] = {}
"""Certificates that this process made, by the SHA-256 of their text."""

_MAX_CERTIFICATES: Final = 2048


class LockFile:
    """Expected contents of an `ecm.lock`, by their digest; the certificate is made when it is needed.

    Most modules come from the proof cache, and then the digest is enough.

    Args:
        certify: makes the certificate.
        digest: SHA-256 of its text, where it is known.
    """

    def __init__(self, certify: Callable[[], Certificate], digest: str | None = None) -> None:
        self._certify = certify
        self._known = digest

    @cached_property
    def certificate(self) -> Certificate:
        """The certificate, made at the first use unless this process has made one with the same text."""
        known = None if self._known is None else _CERTIFICATES.get(self._known)
        if known is not None:
            return known
        made = self._certify()
        if self._known is not None and text_digest(made.text()) == self._known:
            _CERTIFICATES[self._known] = made
            if len(_CERTIFICATES) > _MAX_CERTIFICATES:
                _CERTIFICATES.pop(next(iter(_CERTIFICATES)))
        return made

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the text of the certificate."""
        return text_digest(self.certificate.text()) if self._known is None else self._known

    def matches_folder(self, folder: Path) -> bool:
        """Tell whether the `ecm.lock` in a folder holds the certificate.  Never raises for its contents.

        Args:
            folder: the module's folder.

        Returns:
            True if the file is not a link and has the digest.
        """
        path = folder / LOCK
        try:
            return not path.is_symlink() and text_digest(read_source(path).text) == self.digest
        except UserError:
            return False


def certificate_for(
    ecm: Ecm | ModuleSummary,
    site: Site | SiteSummary,
    obligations: Mapping[ClaimId, str],
    engines: Mapping[ClaimId, str] = MappingProxyType({}),
) -> Certificate:
    """Make the certificate of a module under a site; no obligation may have failed.

    Args:
        ecm: the module.
        site: the site.
        obligations: the verdict on each obligation, PROVED or GUARDED.
        engines: what decided an obligation, where it is neither AEROS's own reading nor the solver.

    Returns:
        The certificate, with the versions of this AEROS and this solver.
    """
    from aeros.spec.migrations.formats import CERTIFICATE

    return Certificate(
        str(CERTIFICATE.schema),
        ecm.id,
        ecm.version,
        ecm.manifest_digest,
        ecm.code_digest,
        dict(ecm.model_digests),
        site.digest,
        f"aeros {aeros.__version__}",
        f"z3-solver {z3_version()}",
        dict(obligations),
        dict(engines),
        dict(ecm.configuration),
        dict(ecm.resources),
    )


def check_lock(
    folder: Path,
    expected: Certificate,
    site: Path | None = None,
    configurations: Mapping[str, ModuleConfiguration] = MappingProxyType({}),
    *,
    accepts_other_setup: bool = False,
) -> Diagnostic | None:
    """Compare the `ecm.lock` in a folder with a certificate.  Never raises for its contents.

    Args:
        folder: the module's folder.
        expected: the certificate that the file must hold.
        site: the site file, for the command that renews the file; None for the reference site.
        configurations: settings of the operator by module, for the same command.
        accepts_other_setup: an unaltered certificate of the same files under another policy or with other
            settings is no difference, as it says nothing about these.

    Returns:
        The difference as a diagnostic, or None if there is none.
    """
    path = folder / LOCK
    own = {name: one for name, one in configurations.items() if name == expected.module}
    options = setting_options(own) if site is None else f" --site {site}{setting_options(own)}"
    cure = (f"run `aeros verify {folder}{options}`",)
    if path.is_symlink():
        return Diagnostic("AE903", f"`{path}` is a link, not a certificate", help=cure)
    if not path.exists():
        return Diagnostic("AE901", f"`{expected.module}` has no certificate", help=cure)
    try:
        text = read_source(path).text
        if text == expected.text():
            return None
        found = json.loads(text)
    except (UserError, ValueError, RecursionError):
        return Diagnostic("AE903", f"`{path}` is not a certificate", help=cure)
    from aeros.spec.migrations.formats import CERTIFICATE

    version = CERTIFICATE.version_of(found)
    if version is not None and version > CERTIFICATE.version:
        cause, newer = CERTIFICATE.refusal(version, path)
        return Diagnostic("AE902", f"`{path}` cannot be compared: {cause}", help=(newer, *cure))
    if not isinstance(found, dict) or found.get("digest") != _digest(
        {key: value for key, value in found.items() if key != "digest"}
    ):
        return Diagnostic("AE903", f"`{path}` was changed after it was written", help=cure)
    changed = [key for key, value in _body(expected).items() if found.get(key) != value]
    is_other_setup = not _OF_THE_OPERATOR.isdisjoint(changed)
    if accepts_other_setup and is_other_setup and _OF_THE_FILES.isdisjoint(changed):
        return None
    return Diagnostic(
        "AE902",
        f"the certificate of `{expected.module}` is stale: {', '.join(changed) or 'its layout'} differs",
        help=cure,
    )


def write_lock(folder: Path, certificate: Certificate) -> None:
    """Write a certificate into a folder, completely or not at all; leave the file alone if it is up to date.

    An existing file is replaced and never followed: a link in a module of unknown origin may lead anywhere.

    Args:
        folder: the module's folder.
        certificate: the certificate.

    Raises:
        OSError: the file cannot be written.
    """
    lock = folder / LOCK
    if check_lock(folder, certificate) is None:
        return
    if lock.is_dir():
        raise IsADirectoryError(errno.EISDIR, "it is a folder")
    new = folder / f".{LOCK}.{os.getpid()}"
    try:
        with new.open("x", encoding="utf-8") as file:  # "x" never follows a link that is already there
            file.write(certificate.text())
        new.replace(lock)
    finally:
        new.unlink(missing_ok=True)


def _body(certificate: Certificate) -> dict[str, Any]:
    """Return the fields as they are written."""
    body = {field.name: getattr(certificate, field.name) for field in fields(certificate)}
    body["obligations"] = {str(claim_id): one for claim_id, one in certificate.obligations.items()}
    body["engines"] = {str(claim_id): one for claim_id, one in certificate.engines.items()}
    optional = ("engines", "configuration", "resources")
    return {name: one for name, one in body.items() if one or name not in optional}


def _dump_json(value: Mapping[str, Any], margin: str) -> str:
    """Encode texts and mappings of texts as `json.dumps(indent=1, sort_keys=True)`, many times as fast."""
    lines = [
        f"{margin} {encode_basestring_ascii(key)}: "
        + (encode_basestring_ascii(inner) if isinstance(inner, str) else _dump_json(inner, margin + " "))
        for key, inner in sorted(value.items())
    ]
    return "{\n" + ",\n".join(lines) + f"\n{margin}}}" if lines else "{}"


def _digest(body: Mapping[str, object]) -> str:
    canonical = json.dumps(body, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode()).hexdigest()
