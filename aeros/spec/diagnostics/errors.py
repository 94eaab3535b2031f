"""Families of errors: the user's, the caller's, and errors of AEROS itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from aeros.spec.diagnostics.codes import Diagnostic


class UserError(Exception):
    """File, claim or request that is refused.

    Attributes:
        diagnostics: where and why.
        text: message for people; `rendered_errors` replaces it by the full text, with lines of the files.
    """

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        self.text = "; ".join(f"{problem.code}: {problem.headline}" for problem in self.diagnostics)
        # The argument, not the message: pickle makes the error again from it, for another process.
        super().__init__(self.diagnostics)

    def __str__(self) -> str:
        return self.text


class UndecidedError(UserError):
    """Request that is refused because the solver could not decide if it is safe."""


class MisuseError(Exception):
    """Breach of a function's contract by the code that calls AEROS."""


class InternalError(Exception):
    """Error of AEROS itself: a state was reached that its own reasoning excludes."""


class DisagreementError(InternalError):
    """Two answers to one question that differ, so that nothing of the run can be relied on.

    Attributes:
        about: purpose of the question.
        script: the question, in SMT-LIB.
        answers: the two answers, of two solvers or of the definition of the language and an encoding.
    """

    def __init__(self, description: str, script: str, first: str, second: str) -> None:
        # All arguments, so that the error can be raised again in another process.
        super().__init__(description, script, first, second)
        self.about = description
        self.script = script
        self.answers = (first, second)

    def __str__(self) -> str:
        return f"two answers about {self.about} differ: {self.answers[0]}, but {self.answers[1]}"
