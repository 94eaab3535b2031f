"""Theorems of `proofs/` as killers: those made from a mutant's code must still be proved."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final, TextIO

from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.check import SolverPanel
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem_folder import load_theorem, proofs_folder, theorem_folders
from tests.mutation.forks import fork
from tests.mutation.results import KILLED, LATE, SURVIVED, Outcome

_SECONDS: Final = 60
"""Of the processor, for one theorem on one mutant."""


class _ChangedSource(ModuleSource):
    """Shipped modules, one of them with another text."""

    def __init__(self, module: str, text: str) -> None:
        super().__init__()
        self._module, self._text = module, text

    def source(self, name: str) -> str:
        self.loaded.add(name)
        return self._text if name == self._module else super().source(name)


class TheoremTrials:
    """All theorems, and the modules that each is about."""

    def __init__(self) -> None:
        self._folders = theorem_folders(proofs_folder())
        self._texts = {
            name: _text_with_library(sorted(folder.glob("*.py"))) for name, folder in self._folders.items()
        }

    def about(self, module: str) -> list[str]:
        """Return the names of theorems whose code, or that of the library that it uses, names a module."""
        return [name for name, text in self._texts.items() if f'"{module}"' in text]

    def outcome(self, module: str, text: str) -> Outcome:
        """Prove the theorems about a module with another text of it, up to the first that fails."""
        used, late = 0.0, False
        for name in self.about(module):
            end, written, seconds = fork(partial(self._prove, name, module, text), _SECONDS)
            used += seconds
            late |= end == LATE
            if end == "done" and written.strip():
                return Outcome(KILLED, f"theorem {name}/{written.strip()}", used)
        return Outcome(LATE if late else SURVIVED, "", used)

    def _prove(self, name: str, module: str, text: str, pipe: TextIO) -> None:
        """Write the name of the first obligation that is refuted or can no longer be made."""
        for obligation, build in load_theorem(self._folders[name]).obligations.items():
            shipped = build(ModuleSource()).to_smtlib()
            try:
                made = build(_ChangedSource(module, text))
            except Exception:  # `aeros prove` fails, too, where changed code cannot be explored
                pipe.write(obligation)
                return
            if made.to_smtlib() != shipped and SolverPanel().check(obligation, made).verdict in _FAILED:
                pipe.write(obligation)
                return


def _text_with_library(paths: Sequence[Path]) -> str:
    """Read a theorem's code with that of the modules of `proofs/lib` that it imports, at any depth."""
    todo, texts = [*paths], dict[Path, str]()
    while todo:
        one = todo.pop()
        if one not in texts:
            texts[one] = one.read_text("utf-8")
            used = set(
                re.findall(r"\w+", " ".join(re.findall(r"^from proofs\.lib.*", texts[one], re.MULTILINE)))
            )
            todo += [path for path in (proofs_folder() / "lib").glob("*.py") if path.stem in used]
    return "\n".join(texts.values())


_FAILED: Final[Sequence[Verdict]] = (Verdict.REFUTED, Verdict.VACUOUS)
