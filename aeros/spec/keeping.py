"""Proofs of modules kept between runs: an unchanged module is not even read as YAML.

Kept is what was proved of one module by itself, without anything left to say.  Its key is the digest of
all that this depends on: manifest, code, site, budget, place, and the programs that decide, down to the
interpreter.  Models are hashed again, and what depends on other modules is not kept but asked anew.  As of
answers, what cannot be read is not there (docs/decisions/0008-answers-are-kept.md).
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import aeros
from aeros.spec.backends.release import release_of
from aeros.spec.backends.store import Store
from aeros.spec.digests import MAX_MODELS, code_digest, code_files, model_digest, text_digest
from aeros.spec.errors import MisuseError, UserError
from aeros.spec.loading import MANIFEST
from aeros.spec.model import Site
from aeros.spec.obligations.obligation import Verdict
from aeros.spec.presence import Presence, packed, unpacked
from aeros.spec.reader import read_source
from aeros.spec.told import Told

_DECIDING: Final = (
    ("networkx", "networkx"),
    ("packaging", "packaging"),
    ("pyyaml", "yaml"),
    ("z3-solver", "z3"),
)
"""Distributions whose code has a part in verdicts, with the package of each."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A module that is proved by itself.

    before, after: the claims that come before and after those about other modules.
    """

    presence: Presence
    before: tuple[Told, ...]
    after: tuple[Told, ...]


class Keeper:
    """Proofs in a store, under one site and one budget."""

    def __init__(self, store: Store, site: Site, rlimit: int) -> None:
        self._store = store
        self._about = [_program(), rlimit, site.digest]
        self._new: dict[str, str] = {}

    def find(self, folder: Path) -> Kept | None:
        """What was proved of exactly the module that is in `folder`, if anything."""
        try:
            manifest = read_source(folder / MANIFEST)
            digests = text_digest(manifest.text), code_digest(code_files(folder))
            text = self._store.report(self._key(folder, *digests))
            if text is None:
                return None
            kept = json.loads(text)
            presence = unpacked(kept["presence"], manifest)
            found = Kept(presence, _claims(kept["before"]), _claims(kept["after"]))
        except (UserError, MisuseError, OSError, ValueError, KeyError, TypeError):
            return None
        same = (presence.manifest_digest, presence.code_digest) == digests
        return found if same and _models_are(folder, presence.model_digests) else None

    def keep(self, folder: Path, proved: Kept) -> None:
        """Put `proved` into the store when `close` is called."""
        presence = proved.presence
        key = self._key(folder, presence.manifest_digest, presence.code_digest)
        kept = {
            "presence": packed(presence),
            "before": [_row(one) for one in proved.before],
            "after": [_row(one) for one in proved.after],
        }
        self._new[key] = json.dumps(kept, separators=(",", ":"))

    def close(self) -> None:
        """Write what is to be kept."""
        self._store.put_reports(self._new)
        self._new = {}

    def _key(self, folder: Path, manifest: str, code: str) -> str:
        question = [*self._about, str(folder), str(folder.resolve()), manifest, code]
        return hashlib.sha256(json.dumps(question).encode()).hexdigest()


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
