"""Certificates: what was proved, of exactly which bytes, by which verifier.  Written as `ecm.lock`.

A certificate is canonical JSON that holds its own digest, so an edit of it is noticed, and the
digests of manifest, code, models and site, so an edit of any of those is noticed.  It is a record and not
an authority: anybody can write a file, so a configuration is proved again when it is loaded, and
the certificate must then be the one that results (docs/decisions/0004-certificates-are-rechecked.md).
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from json.encoder import encode_basestring_ascii
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import aeros
from aeros.spec.backends.package_versions import z3_version
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.migrations.formats import CERTIFICATE
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.text.digests import text_digest
from aeros.spec.text.files import read_source

if TYPE_CHECKING:
    from aeros.spec.model.model import Ecm, Site
    from aeros.spec.model.summary import ModuleSummary, SiteSummary

LOCK = "ecm.lock"
SCHEMA = str(CERTIFICATE.schema)
GUARDED: Final = "GUARDED"
"""The verdict on an obligation that the proof left to the gate."""


@dataclass(frozen=True)
class Certificate:
    """What was proved of a module under a site.

    manifest, code, site: SHA-256 in hexadecimal; models: likewise, by path in the module.
    obligations: the verdict on each obligation, PROVED or GUARDED.
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

    @cached_property
    def digest(self) -> str:
        """The digest that it holds of itself."""
        return _digest(_body(self))

    def text(self) -> str:
        """The contents of `ecm.lock`."""
        return _dump_json({**_body(self), "digest": self.digest}, "") + "\n"

    def runtime_checked_rules(self, skill: str, kind: str) -> frozenset[str]:
        """The invariants that the gate must decide for this skill's actions of this kind."""
        return frozenset(
            claim_id.name_of("invariant")
            for claim_id, verdict in self.obligations.items()
            if verdict == GUARDED
            and claim_id.form is ClaimForm.ENVELOPE_OBEYS
            and claim_id.names[:2] == (skill, kind)
        )


class LockFile:
    """What `ecm.lock` is to hold, by its digest: of a module that was kept, the rest is seldom needed.

    certify: makes the certificate.
    digest: of its text, where that is known.
    """

    def __init__(self, certify: Callable[[], Certificate], digest: str | None = None) -> None:
        self._certify = certify
        self._known = digest

    @cached_property
    def certificate(self) -> Certificate:
        """The certificate."""
        return self._certify()

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the text of the certificate."""
        return text_digest(self.certificate.text()) if self._known is None else self._known

    def matches_folder(self, folder: Path) -> bool:
        """Whether the `ecm.lock` in `folder` holds it.  Never raises for its contents."""
        path = folder / LOCK
        try:
            return not path.is_symlink() and text_digest(read_source(path).text) == self.digest
        except UserError:
            return False


def certificate_for(
    ecm: Ecm | ModuleSummary, site: Site | SiteSummary, obligations: Mapping[ClaimId, str]
) -> Certificate:
    """The certificate of `ecm` under `site`, given that no obligation failed."""
    return Certificate(
        SCHEMA,
        ecm.id,
        ecm.version,
        ecm.manifest_digest,
        ecm.code_digest,
        dict(ecm.model_digests),
        site.digest,
        f"aeros {aeros.__version__}",
        f"z3-solver {z3_version()}",
        dict(obligations),
    )


def check_lock(folder: Path, expected: Certificate) -> Diagnostic | None:
    """Why the `ecm.lock` in `folder` is not `expected`, or None if it is.  Never raises for its contents."""
    path = folder / LOCK
    cure = (f"run `aeros verify {folder}` and read what it says",)
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
    version = CERTIFICATE.version_of(found)
    if version is not None and version > CERTIFICATE.version:
        cause, newer = CERTIFICATE.refusal(version, path)
        return Diagnostic("AE902", f"`{path}` cannot be compared: {cause}", help=(newer, *cure))
    if not isinstance(found, dict) or found.get("digest") != _digest(
        {key: value for key, value in found.items() if key != "digest"}
    ):
        return Diagnostic("AE903", f"`{path}` was changed after it was written", help=cure)
    changed = [key for key, value in _body(expected).items() if found.get(key) != value]
    return Diagnostic(
        "AE902",
        f"the certificate of `{expected.module}` is stale: {', '.join(changed) or 'its layout'} differs",
        help=cure,
    )


def write_lock(folder: Path, certificate: Certificate) -> None:
    """Put the certificate into `folder`, whole or not at all; raises OSError where it cannot be.

    What is there already is replaced and never followed: a link in a stranger's module may lead anywhere.
    """
    lock = folder / LOCK
    if check_lock(folder, certificate) is None:
        return
    if lock.is_dir():
        raise IsADirectoryError(errno.EISDIR, "it is a folder")
    new = folder / f".{LOCK}.{os.getpid()}"
    try:
        with new.open("x", encoding="utf-8") as file:  # never through a link that waits there
            file.write(certificate.text())
        new.replace(lock)
    finally:
        new.unlink(missing_ok=True)


def _body(certificate: Certificate) -> dict[str, Any]:
    """The fields as they are written."""
    body = {field.name: getattr(certificate, field.name) for field in fields(certificate)}
    return {**body, "obligations": {str(claim_id): one for claim_id, one in certificate.obligations.items()}}


def _dump_json(value: Mapping[str, Any], margin: str) -> str:
    """As `json.dumps` with `indent=1` and `sort_keys`, many times as fast, of texts and mappings of texts."""
    lines = [
        f"{margin} {encode_basestring_ascii(key)}: "
        + (encode_basestring_ascii(inner) if isinstance(inner, str) else _dump_json(inner, margin + " "))
        for key, inner in sorted(value.items())
    ]
    return "{\n" + ",\n".join(lines) + f"\n{margin}}}" if lines else "{}"


def _digest(body: Mapping[str, object]) -> str:
    canonical = json.dumps(body, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode()).hexdigest()
