"""Cache of the proofs of modules between runs: an unchanged module is not even read as YAML.

The cache keeps proofs of one module by itself, if nothing is left to report, and of a site.  The key is
the digest of all that a proof depends on: manifest, code, site, overrides, budget, and the programs that
decide, down to the interpreter.  No cached value names a path, so a copy of a module is found anywhere.
Models are hashed again.  The key of a module that requires others also holds the digest of the modules around
it that may provide what it requires (`required_modules`).  Claims about how modules agree are not cached but
decided again.  As for answers, a value that cannot be read counts as absent
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
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import aeros
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.package_versions import package_version
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.model.summary import (
    ModuleSummary,
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
from aeros.spec.verification.claim_summary import ClaimCounts, Claims, ClaimSummary
from aeros.spec.verification.reports import Known, ModuleFindings, Report, SubjectReport
from aeros.spec.verification.required_modules import RequiredModules

_VERDICT_DISTRIBUTIONS: Final = (
    ("networkx", "networkx"),
    ("packaging", "packaging"),
    ("pyyaml", "yaml"),
    ("z3-solver", "z3"),
)
"""Distributions whose code has a part in verdicts, with the package of each."""


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
        settings: settings of the operator, in addition to those of the site.
        surroundings: the modules among which each finds those that it requires.
    """

    def __init__(
        self,
        store: AnswerStore,
        site: Source,
        rlimit: int,
        settings: OperatorSettings = NO_SETTINGS,
        surroundings: Surroundings = NEIGHBOURS,
    ) -> None:
        self._store = store
        self._site = site
        self._about = [_program_digest(), rlimit, text_digest(site.text), settings.identity]
        self._new: dict[str, tuple[str, bytes]] = {}
        self._surroundings = surroundings
        self._around = RequiredModules(surroundings)
        self._before: dict[tuple[Path, str, str], tuple[frozenset[str], str]] = {}

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
            text, claims = self._proof_of_module(folder, manifest, digests)
            head, summary = _decoded(text), _summary(text, manifest)
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
            text, packed_claims = self._proof(self._digest("site"))
            site = site_summary_from_json(_decoded(text), self._site)
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
        self._around = RequiredModules(self._surroundings)
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
        head = summary_to_json(site, self._site)
        self._put(self._digest("site"), head, [_claim_to_row(one) for one in claims])

    def put_module(self, folder: Path, one: ModuleFindings, lock_digest: str) -> None:
        """Hold the proof of a module until `close` writes it, unless a module that it may use has changed.

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
            names, before = self._before.get((folder, *own), (frozenset(), None))
            if before is None or before != self._around.digest(folder, names):
                return
            self._put(self._digest("names", *own), {"names": sorted(names)}, [])
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

    def _proof(self, key: str) -> tuple[str, bytes]:
        """Return a stored proof: the text of its head, and its packed claims.

        Raises:
            LookupError: it is absent.
            ValueError: it is damaged.
            TypeError: it is damaged.
        """
        proof = self._store.proof(key)
        if proof is None:
            raise LookupError(key)
        if _decoded(proof[0])["claims"] != file_digest(proof[1]):
            raise LookupError(key)
        return proof

    def _proof_of_module(self, folder: Path, manifest: Source, own: tuple[str, str]) -> tuple[str, bytes]:
        """Return the stored proof of a module, whether or not it requires others; raise as `_proof` does."""
        try:
            return self._proof(self._digest("module", *own))
        except LookupError:
            if not _may_require_modules(manifest.text):
                raise
        try:
            names = frozenset(_decoded(self._proof(self._digest("names", *own))[0])["names"])
            around = self._around.digest(folder, names)
            return self._proof(self._digest("module", *own, str(around)))
        except LookupError:
            # What it is proved with is what is there now, before it is proved.
            needed = self._around.names(folder, manifest)
            around = None if needed is None else self._around.digest(folder, needed)
            if needed is not None and around is not None:
                self._before[folder, *own] = needed, around
            raise

    def _digest(self, *of: str) -> str:
        return text_digest(json.dumps([*self._about, *of]))


# Of a thousand modules of a robot, all are looked up at each change of it.
@lru_cache(maxsize=2048)
def _decoded(head: str) -> Any:
    """Decode the head of a proof; nobody changes the result."""
    return json.loads(head)


@lru_cache(maxsize=2048)
def _summary(head: str, manifest: Source) -> ModuleSummary:
    """Read the summary of a module in the head of its proof."""
    return module_summary_from_json(_decoded(head)["presence"], manifest)


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
