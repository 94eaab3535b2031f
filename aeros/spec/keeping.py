"""Proofs of modules kept between runs: an unchanged module is not even read as YAML.

Kept is what was proved of one module by itself, without anything left to say; and of a site.  Its key is
the digest of all that this depends on: manifest, code, site, overrides, budget, and the programs that decide,
down to the interpreter.  Nothing that is kept names a place, so a copy is found wherever it lies.  Models are
hashed again, and what depends on other modules is not kept but asked anew.  As of answers, what cannot be
read is not there (docs/decisions/0008-answers-are-kept.md).

What most runs read is in the head of what is kept; the claims are beside it, with their digest in the head,
and are read where a report lists them or a certificate has to be written.
"""

from __future__ import annotations

import hashlib
import json
import sys
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import aeros
from aeros.spec.backends.release import release_of
from aeros.spec.backends.store import Store
from aeros.spec.digests import MAX_MODELS, code_digest, code_files, file_digest, model_digest, text_digest
from aeros.spec.errors import MisuseError, UserError
from aeros.spec.folders import MANIFEST
from aeros.spec.presence import Presence, SitePresence, packed, unpacked, unpacked_site
from aeros.spec.source import Source
from aeros.spec.texts import read_source
from aeros.spec.told import Claims, Tally, Told
from aeros.spec.verdicts import Verdict

if TYPE_CHECKING:
    from aeros.spec.model import Block

_DECIDING: Final = (
    ("networkx", "networkx"),
    ("packaging", "packaging"),
    ("pyyaml", "yaml"),
    ("z3-solver", "z3"),
)
"""Distributions whose code has a part in verdicts, with the package of each."""


@dataclass(frozen=True)
class Kept:
    """A module that is proved by itself.

    tally: of all its claims but those about other modules.
    lock_digest: of the text of its certificate, where what it needs of other modules is met.
    """

    presence: Presence
    tally: Tally
    lock_digest: str
    packed_claims: bytes

    def claims(self) -> tuple[tuple[Told, ...], tuple[Told, ...]]:
        """The claims that come before and after those about other modules."""
        before, after = json.loads(zlib.decompress(self.packed_claims))
        return _claims(before), _claims(after)


@dataclass(frozen=True)
class KeptSite:
    """A site that is proved."""

    presence: SitePresence
    claims: tuple[Told, ...]


class Keeper:
    """Proofs in a store, of one site and of modules under it, under one budget.

    blocks: operator overrides beside those of the site.
    """

    def __init__(self, store: Store, site: Source, rlimit: int, blocks: Sequence[Block] = ()) -> None:
        self._store = store
        self._site = site
        self._about = [_program(), rlimit, text_digest(site.text), [one.told for one in blocks]]
        self._new: dict[str, tuple[str, bytes]] = {}

    def find(self, folder: Path) -> Kept | None:
        """What was proved of exactly the module that is in `folder`, if anything."""
        try:
            manifest = read_source(folder / MANIFEST)
            digests = text_digest(manifest.text), code_digest(code_files(folder))
            head, claims = self._proof(self._key(*digests))
            presence = unpacked(head["presence"], manifest)
            found = Kept(presence, _tally(head["tally"]), head["lock"], claims)
        except (UserError, MisuseError, OSError, ValueError, LookupError, TypeError):
            return None
        same = (presence.manifest_digest, presence.code_digest) == digests
        return found if same and _models_are(folder, presence.model_digests) else None

    def find_all(self, folders: Iterable[Path]) -> dict[Path, Kept]:
        """What was proved of those modules of which anything was."""
        found = ((folder, self.find(folder)) for folder in folders)
        return {folder: kept for folder, kept in found if kept is not None}

    def find_site(self) -> KeptSite | None:
        """What was proved of the site, if all of it was and there is nothing to say."""
        try:
            head, claims = self._proof(self._digest("site"))
            return KeptSite(unpacked_site(head, self._site), _claims(json.loads(zlib.decompress(claims))))
        except (MisuseError, ValueError, LookupError, TypeError, zlib.error):
            return None

    def keep_site(self, site: SitePresence, claims: Sequence[Told]) -> None:
        """As `keep`, of the site."""
        rows = [_row(one) for one in claims]
        self._put(self._digest("site"), packed(site), rows)

    def keep(
        self,
        presence: Presence,
        before: Sequence[Told],
        after: Sequence[Told],
        lock_digest: str,
    ) -> None:
        """Put what was proved into the store when `close` is called; as `Kept` has it."""
        key = self._key(presence.manifest_digest, presence.code_digest)
        tally = Claims.of((*before, *after)).tally
        head = {"presence": packed(presence), "tally": [tally.claims, tally.guarded], "lock": lock_digest}
        self._put(key, head, [[_row(one) for one in claims] for claims in (before, after)])

    def close(self) -> None:
        """Write what is to be kept."""
        self._store.put_proofs(self._new)
        self._new = {}

    def _put(self, key: str, head: Mapping[str, Any], claims: Any) -> None:
        rows = zlib.compress(_dumped(claims).encode(), 1)
        self._new[key] = (_dumped({**head, "claims": file_digest(rows)}), rows)

    def _proof(self, key: str) -> tuple[Any, bytes]:
        """What was put; raises LookupError, ValueError or TypeError if it is not there as it was put."""
        proof = self._store.proof(key)
        if proof is None:
            raise LookupError(key)
        head = json.loads(proof[0])
        if head["claims"] != file_digest(proof[1]):
            raise LookupError(key)
        return head, proof[1]

    def _key(self, manifest: str, code: str) -> str:
        return self._digest("module", manifest, code)

    def _digest(self, *of: str) -> str:
        return text_digest(json.dumps([*self._about, *of]))


def _dumped(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"))


def _tally(kept: Any) -> Tally:
    claims, guarded = kept
    return Tally(claims, tuple((rule, boundary, count) for rule, boundary, count in guarded))


def _models_are(folder: Path, digests: Mapping[str, str]) -> bool:
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


def _row(one: Told) -> list[Any]:
    if one.diagnostic is not None:
        raise MisuseError(f"`{one.id}` is not proved without a word")
    return [one.id, one.verdict.value, one.guard, one.boundary, one.witness]


_VERDICTS: Final = {one.value: one for one in Verdict}


def _claims(rows: Any) -> tuple[Told, ...]:
    if not isinstance(rows, list):
        raise TypeError("claims are kept as a list")
    return tuple(
        Told(id_, _VERDICTS[verdict], guard, boundary, None if witness is None else tuple(witness))
        for id_, verdict, guard, boundary, witness in rows
    )


@cache
def _program() -> str:
    """Digest of everything that decides: AEROS itself, the packages it decides with, and the interpreter."""
    digest = hashlib.sha256(sys.version.encode())
    for names in _DECIDING:
        digest.update(f"\n{names[0]} {release_of(*names)}".encode())
    root = Path(aeros.__file__).parent
    for path in [root / "__init__.py", root / "skill.py", *sorted((root / "spec").rglob("*.py"))]:
        content = path.read_bytes()
        digest.update(f"\n{path.relative_to(root)} {len(content)}\n".encode() + content)
    return digest.hexdigest()
