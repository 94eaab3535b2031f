"""Theorems about AEROS: obligations made from its code, and mutants of the code that refute them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_not
from aeros.spec.theorems.symbolic_execution import DecisionDiagram, questions_in, smtlib_definitions


@dataclass(frozen=True)
class SymbolicFunction:
    """The behaviour of explored code as a function of SMT-LIB.

    Attributes:
        name: name by which formulas refer to the result.
        sort: sort of the result.
        diagram: decision diagram of the code.
    """

    name: str
    sort: str
    diagram: DecisionDiagram


@dataclass(frozen=True)
class TheoremObligation:
    """A claim that is proved iff no input makes every assumption true and the conclusion false.

    Attributes:
        statement: the claim in a sentence or two, for people.
        declarations: SMT-LIB commands that declare sorts and functions.
        conclusion: formula to prove.
        tables: behaviour of explored code; defined after the declarations.
        lemmas: definitions over all of these.
        assumptions: formulas by name; unsat cores are counted in them.
        logic: SMT-LIB logic; a specific one lets a solver choose its best method.
    """

    statement: str
    declarations: Sequence[str]
    conclusion: str
    tables: Sequence[SymbolicFunction] = ()
    lemmas: Sequence[str] = ()
    assumptions: Mapping[str, str] = field(default_factory=dict)
    logic: str = "ALL"

    def to_smtlib(self) -> str:
        """Write the obligation as an SMT-LIB 2.6 script.

        Returns:
            The script; `unsat` is a proof.
        """
        lines = [f"; {line}" for line in self.statement.splitlines()]
        lines += ["; unsat: proved", f"(set-logic {self.logic})", *self._premises()]
        lines += [f"(assert (! {smt_not(self.conclusion)} :named negated-conclusion))", "(check-sat)"]
        return "\n".join(lines) + "\n"

    def premises_to_smtlib(self) -> str:
        """Write a script that checks the assumptions alone; `unsat` would make anything provable.

        Returns:
            The script.
        """
        return "\n".join([f"(set-logic {self.logic})", *self._premises(), "(check-sat)"]) + "\n"

    def to_traced_smtlib(self) -> tuple[str, dict[str, str]]:
        """Write `to_smtlib` with a constant for each question of the tables.

        Returns:
            The script, and the question of each constant.
        """
        asked = dict.fromkeys(one for table in self.tables for one in questions_in(table.diagram))
        by_constant = {f"asked.{number}": one for number, one in enumerate(asked)}
        lines = [
            f"(declare-const {name} Bool)\n(assert (= {name} {one}))\n" for name, one in by_constant.items()
        ]
        return self.to_smtlib().replace("(check-sat)\n", "".join(lines) + "(check-sat)\n"), by_constant

    def _premises(self) -> list[str]:
        lines = [*self.declarations]
        for table in self.tables:
            lines += smtlib_definitions(table.diagram, table.name, table.sort)
        lines += self.lemmas
        return lines + [
            f"(assert (! {formula} :named given.{name}))" for name, formula in self.assumptions.items()
        ]


@dataclass(frozen=True)
class Theorem:
    """A theorem: obligations that together are its proof, and mutants that each must refute one of them.

    Attributes:
        title: the claim, in one line.
        obligations: makers of obligations by name, which is also the name of a file; each receives the code.
        mutants: faults that the theorem must detect.
    """

    title: str
    obligations: Mapping[str, Callable[[ModuleSource], TheoremObligation]]
    mutants: Sequence[Mutant]
