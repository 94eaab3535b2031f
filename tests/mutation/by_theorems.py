"""Theorems of `proofs/` as killers: those made from a mutant's code must still be proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, TextIO

from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.check import SolverPanel
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem import Theorem
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

    def _source(self, name: str) -> str:
        return self._text if name == self._module else super()._source(name)


@dataclass(frozen=True)
class _Baseline:
    """A theorem about the shipped code: modules that it is made from, and the questions."""

    theorem: Theorem
    modules: frozenset[str]
    scripts: Mapping[str, str]


class TheoremTrials:
    """All theorems, and the modules that each is about."""

    def __init__(self) -> None:
        self._baselines: dict[str, _Baseline] = {}
        for name, folder in theorem_folders(proofs_folder()).items():
            theorem, source = load_theorem(folder), ModuleSource()
            scripts = {one: build(source).to_smtlib() for one, build in theorem.obligations.items()}
            self._baselines[name] = _Baseline(theorem, frozenset(source.loaded), scripts)

    def about(self, module: str) -> list[str]:
        """Return the names of theorems that are made from a module."""
        return [name for name, one in self._baselines.items() if module in one.modules]

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
        one = self._baselines[name]
        for obligation, build in one.theorem.obligations.items():
            try:
                made = build(_ChangedSource(module, text))
            except Exception:  # the code has a fault
                pipe.write(obligation)
                return
            if made.to_smtlib() == one.scripts[obligation]:
                continue
            if SolverPanel().check(obligation, made).verdict in _FAILED:
                pipe.write(obligation)
                return


_FAILED: Final[Sequence[Verdict]] = (Verdict.REFUTED, Verdict.VACUOUS)
