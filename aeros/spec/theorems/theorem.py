"""What a theorem about AEROS is: obligations made from its code, and mutants of it that refute them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_not
from aeros.spec.theorems.symbolic_execution import DecisionDiagram, questions_in, smtlib_definitions


@dataclass(frozen=True)
class SymbolicFunction:
    """What explored code does, under the name by which formulas speak of its result.

    sort: of the result.
    """

    name: str
    sort: str
    diagram: DecisionDiagram


@dataclass(frozen=True)
class TheoremObligation:
    """A claim that is proved iff no input makes every assumption true and the conclusion false.

    says: the claim in a sentence or two, for people.
    declarations: SMT-LIB commands: sorts, what is uninterpreted, what is defined of it.
    tables: what explored code does; defined after the declarations.
    lemmas: definitions over all of these.
    assumptions: by name; cores are counted in them.
    logic: of SMT-LIB; one that is named lets a solver choose what it is best at.
    """

    statement: str
    declarations: Sequence[str]
    conclusion: str
    tables: Sequence[SymbolicFunction] = ()
    lemmas: Sequence[str] = ()
    assumptions: Mapping[str, str] = field(default_factory=dict)
    logic: str = "ALL"

    def to_smtlib(self) -> str:
        """The question, as SMT-LIB 2.6: `unsat` is a proof."""
        lines = [f"; {line}" for line in self.statement.splitlines()]
        lines += ["; unsat: proved", f"(set-logic {self.logic})", *self._premises()]
        lines += [f"(assert (! {smt_not(self.conclusion)} :named negated-conclusion))", "(check-sat)"]
        return "\n".join(lines) + "\n"

    def premises_to_smtlib(self) -> str:
        """Whether the assumptions can hold at all: `unsat` would make anything provable."""
        return "\n".join([f"(set-logic {self.logic})", *self._premises(), "(check-sat)"]) + "\n"

    def to_traced_smtlib(self) -> tuple[str, dict[str, str]]:
        """`to_smtlib`, with a constant for each question of the tables; the questions by constant."""
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
    """A theorem: the obligations that together are its proof, and mutants that each must refute one.

    title: the claim, in one line.
    obligations: by name, which is also that of a file; each is made of the code that it is given.
    """

    title: str
    obligations: Mapping[str, Callable[[ModuleSource], TheoremObligation]]
    mutants: Sequence[Mutant]
