"""Cache of the proofs of modules between runs: an unchanged module is not even read as YAML.

The cache keeps proofs of one module by itself, if nothing is left to report, and of a site.  The key is
the digest of all that a proof depends on: manifest, code, site, overrides, budget, and the programs that
decide, down to the interpreter.  No cached value names a path, so a copy of a module is found anywhere.
Models are hashed again.  The key of a module that requires others also holds the digest of all modules around
it, any of which may provide what it requires.  Claims about how modules agree are not cached but decided
again.  As for answers, a value that cannot be read counts as absent
(docs/decisions/0008-answers-are-kept.md).

A value has a head, which holds all that most runs read.  The claims are stored next to it, with their digest
in the head.  They are read where a report lists them or a certificate has to be written.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import aeros
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.package_versions import package_version
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.summary import (
    SiteSummary,
    module_summary_from_json,
    site_summary_from_json,
    summary_to_json,
)
from aeros.spec.obligations.verdicts import Conclusion, Verdict
from aeros.spec.text.digests import (
    MAX_MODELS,
    code_digest,
    code_files,
    file_digest,
    model_digest,
    text_digest,
)
from aeros.spec.text.discovery import MANIFEST, NEIGHBOURS, Surroundings
from aeros.spec.text.files import read_source
from aeros.spec.verification.certificate import LOCK
from aeros.spec.verification.claim_summary import ClaimCounts, Claims, ClaimSummary
from aeros.spec.verification.reports import Known, ModuleFindings, Report, SubjectReport

if TYPE_CHECKING:
    from aeros.spec.model.policy import OperatorOverride

_VERDICT_DISTRIBUTIONS: Final = (
    ("networkx", "networkx"),
    ("packaging", "packaging"),
    ("pyyaml", "yaml"),
    ("z3-solver", "z3"),
)
"""Distributions whose code has a part in verdicts, with the package of each."""


_MAX_OTHER_FILES: Final = 64 * 2**20
"""Bytes of files of a module around another that are hashed to find a proof; with more, it is proved anew."""


class _KeptClaims:
    """The packed claims about a module by itself, from the cache; implements `OwnClaims`."""

    def __init__(self, tally: ClaimCounts, packed_claims: bytes) -> None:
        self.tally = tally
        self._packed = packed_claims

    def read(self) -> tuple[tuple[ClaimSummary, ...], tuple[ClaimSummary, ...]]:
        """Implement `OwnClaims.read`."""
        before, after = json.loads(zlib.decompress(self._packed))
        return _claims_from_rows(before), _claims_from_rows(after)


class ProofCache:
    """Proofs in a store, of one site and of modules under it, under one budget.

    Args:
        store: store of answers and proofs.
        site: text of the site file and its path.
        rlimit: the solver's budget for one query, in Z3 resource units.
        blocks: operator overrides, in addition to those of the site.
        surroundings: the modules among which each finds those that it requires.
    """

    def __init__(
        self,
        store: AnswerStore,
        site: Source,
        rlimit: int,
        blocks: Sequence[OperatorOverride] = (),
        surroundings: Surroundings = NEIGHBOURS,
    ) -> None:
        self._store = store
        self._site = site
        self._about = [_program_digest(), rlimit, text_digest(site.text), [one.identity for one in blocks]]
        self._new: dict[str, tuple[str, bytes]] = {}
        self._surroundings = surroundings
        self._digests_around: dict[Path | None, str | None] = {}

    def find(self, folders: Iterable[Path]) -> Known:
        """Look up the proofs of the site and of modules.

        Args:
            folders: folders of the modules.

        Returns:
            The proofs that are cached.
        """
        findings = ((folder, self.find_module(folder)) for folder in folders)
        return Known(self.find_site(), {folder: one for folder, one in findings if one is not None})

    def find_module(self, folder: Path) -> ModuleFindings | None:
        """Look up the proof of exactly the module that is in a folder now.

        Args:
            folder: the module's folder.

        Returns:
            The findings, or None if they are not cached or cannot be read.
        """
        try:
            manifest = read_source(folder / MANIFEST)
            digests = text_digest(manifest.text), code_digest(code_files(folder))
            head, claims = self._proof_of_module(folder, manifest, *digests)
            summary = module_summary_from_json(head["presence"], manifest)
            findings = ModuleFindings(
                summary, claims=_KeptClaims(_read_counts(head["tally"]), claims), lock_digest=head["lock"]
            )
        except (UserError, MisuseError, OSError, ValueError, LookupError, TypeError):
            return None
        same = (summary.manifest_digest, summary.code_digest) == digests
        return findings if same and _models_unchanged(folder, summary.model_digests) else None

    def find_site(self) -> tuple[SiteSummary, SubjectReport] | None:
        """Look up the proof of the site.

        Returns:
            The site and the report on it; None unless all of it was proved with nothing to report.
        """
        try:
            head, packed_claims = self._proof(self._digest("site"))
            site = site_summary_from_json(head, self._site)
            claims = Claims.from_claims(_claims_from_rows(json.loads(zlib.decompress(packed_claims))))
        except (MisuseError, ValueError, LookupError, TypeError, zlib.error):
            return None
        return site, SubjectReport(site.id, Path(self._site.path), Conclusion.PROVED, (), claims)

    def keep(self, report: Report, new: Known) -> None:
        """Put the new proofs that leave nothing to report into the store.

        Args:
            report: report on the whole run.
            new: findings of this run that were not cached.
        """
        if new.site is not None and _is_proved(report.site):
            self.put_site(new.site[0], report.site.claims)
        for module in report.modules:
            found = new.modules.get(module.path)
            if found is not None and module.lock is not None and _is_proved(module):
                self.put_module(module.path, found, module.lock.digest)
        self.close()

    def put_site(self, site: SiteSummary, claims: Sequence[ClaimSummary]) -> None:
        """Hold the proof of the site until `close` writes it.

        Args:
            site: summary of the site.
            claims: the proved claims about it.
        """
        self._put(self._digest("site"), summary_to_json(site), [_claim_to_row(one) for one in claims])

    def put_module(self, folder: Path, one: ModuleFindings, lock_digest: str) -> None:
        """Hold the proof of a module until `close` writes it, unless the modules around it have changed.

        Args:
            folder: the module's folder.
            one: findings on the module.
            lock_digest: SHA-256 of the text of its certificate.

        Raises:
            MisuseError: the module could not be read, or a claim has a diagnostic.
        """
        summary = one.summary
        if summary is None:
            raise MisuseError("a module that cannot be read is not proved")
        own, tally = (summary.manifest_digest, summary.code_digest), one.claims.tally
        key = self._digest("module", *own)
        if summary.has_requirements:
            place = self._surroundings.place(folder)
            before = self._digests_around.get(place)
            if before is None or before != _digest_of_members(self._surroundings, place):
                return
            key = self._digest("module", *own, before)
        head = {
            "presence": summary_to_json(summary),
            "tally": [tally.claims, tally.runtime_checked],
            "lock": lock_digest,
        }
        self._put(key, head, [[_claim_to_row(claim) for claim in claims] for claims in one.claims.read()])

    def close(self) -> None:
        """Write the proofs that are held."""
        self._store.put_proofs(self._new)
        self._new = {}

    def _put(self, key: str, head: Mapping[str, Any], claims: Any) -> None:
        rows = zlib.compress(_dump_json(claims).encode(), 1)
        self._new[key] = (_dump_json({**head, "claims": file_digest(rows)}), rows)

    def _proof(self, key: str) -> tuple[Any, bytes]:
        """Return a stored proof.

        Raises:
            LookupError: it is absent.
            ValueError: it is damaged.
            TypeError: it is damaged.
        """
        proof = self._store.proof(key)
        if proof is None:
            raise LookupError(key)
        head = json.loads(proof[0])
        if head["claims"] != file_digest(proof[1]):
            raise LookupError(key)
        return head, proof[1]

    def _proof_of_module(
        self, folder: Path, manifest: Source, manifest_digest: str, code: str
    ) -> tuple[Any, bytes]:
        """Return the stored proof of a module, whether or not it requires others; raise as `_proof` does."""
        try:
            return self._proof(self._digest("module", manifest_digest, code))
        except LookupError:
            around = self._digest_around(folder) if _may_require_modules(manifest.text) else None
            if around is None:
                raise
            return self._proof(self._digest("module", manifest_digest, code, around))

    def _digest_around(self, folder: Path) -> str | None:
        """Hash the modules around a folder and the one in it, once for all of them."""
        place = self._surroundings.place(folder)
        if place not in self._digests_around:
            self._digests_around[place] = _digest_of_members(self._surroundings, place)
        return self._digests_around[place]

    def _digest(self, *of: str) -> str:
        return text_digest(json.dumps([*self._about, *of]))


def _dump_json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"))


def _read_counts(data: Any) -> ClaimCounts:
    claims, guarded = data
    return ClaimCounts(claims, tuple((rule, boundary, count) for rule, boundary, count in guarded))


def _is_proved(report: SubjectReport) -> bool:
    return report.conclusion is Conclusion.PROVED and not report.diagnostics


def _may_require_modules(manifest: str) -> bool:
    """Return False if a manifest names no requirement; one that hides it is only proved anew each time."""
    return "modules" in manifest or manifest.count("capabilities") > 1


def _digest_of_members(surroundings: Surroundings, place: Path | None) -> str | None:
    """Hash all modules that are around each other, with their models; None if a file cannot be read."""
    parts: list[Any] = []
    try:
        for one in surroundings.members(place):
            manifest = read_source(one / MANIFEST).text
            code = code_digest(code_files(one))
            parts.append([one in surroundings.active, text_digest(manifest), code, _other_files(one)])
    except (UserError, OSError):
        return None
    return text_digest(_dump_json(parts))


def _other_files(folder: Path) -> list[list[str]]:
    """Return name and digest of what may be a model of a module; raise OSError where there is too much."""
    left, found = _MAX_OTHER_FILES, []
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted(files):
            below = os.path.relpath(os.path.join(here, name), folder)
            if not name.endswith(".py") and below not in (MANIFEST, LOCK):
                digest, size = model_digest(folder, below, left)
                left -= size
                found.append([below, digest])
    return found


def _models_unchanged(folder: Path, digests: Mapping[str, str]) -> bool:
    left = MAX_MODELS
    for name, expected in digests.items():
        try:
            digest, size = model_digest(folder, name, left)
        except OSError:
            return False
        if digest != expected:
            return False
        left -= size
    return True


def _claim_to_row(claim: ClaimSummary) -> list[Any]:
    if claim.diagnostic is not None:
        raise MisuseError(f"`{claim.id}` is not proved without a word")
    return [
        claim.id.form.name,
        claim.id.names,
        claim.verdict.value,
        claim.runtime_checked_rule,
        claim.boundary,
        claim.witness,
        claim.engine,
    ]


_VERDICTS: Final = {one.value: one for one in Verdict}


def _claims_from_rows(rows: Any) -> tuple[ClaimSummary, ...]:
    if not isinstance(rows, list):
        raise TypeError("claims are kept as a list")
    # Imported here: a run that finds everything proved reads no claim.
    from aeros.spec.obligations.claim_id import ClaimId, claim_form

    return tuple(
        ClaimSummary(
            ClaimId(claim_form(form), tuple(names)),
            _VERDICTS[verdict],
            guard,
            boundary,
            None if witness is None else tuple(witness),
            engine=engine,
        )
        for form, names, verdict, guard, boundary, witness, engine in rows
    )


@cache
def _program_digest() -> str:
    """Compute the digest of the programs that decide: AEROS, the packages it uses, and the interpreter."""
    digest = hashlib.sha256(sys.version.encode())
    for names in _VERDICT_DISTRIBUTIONS:
        digest.update(f"\n{names[0]} {package_version(*names)}".encode())
    if find_spec("maraboupy") is not None:
        digest.update(f"\nmaraboupy {package_version('maraboupy', 'maraboupy')}".encode())
    root = os.path.dirname(aeros.__file__)
    for name in ("__init__.py", "skill.py", *_modules_below(root, "models"), *_modules_below(root, "spec")):
        with open(os.path.join(root, name), "rb") as file:
            content = file.read()
        digest.update(f"\n{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _modules_below(root: str, package: str) -> Iterator[str]:
    """Yield the path of each module of a package below `root`; `Path.rglob` takes twice the time."""
    for folder, folders, files in os.walk(os.path.join(root, package)):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        below = os.path.relpath(folder, root)
        yield from (f"{below}/{name}" for name in sorted(files) if name.endswith(".py"))
