"""Every failure belongs to one of three families: the user's, the caller's, or ours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from aeros.spec.diagnostics.codes import Diagnostic


class UserError(Exception):
    """What was written or asked for is refused; `diagnostics` say where and why."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("; ".join(f"{found.code}: {found.headline}" for found in self.diagnostics))

    def __reduce__(self) -> tuple[type[UserError], tuple[tuple[Diagnostic, ...]]]:
        # By what it was made of, and not by its words: another process may have raised it.
        return type(self), (self.diagnostics,)


class UndecidedError(UserError):
    """What was asked for is refused because the solver could not decide whether it is safe."""


class MisuseError(Exception):
    """Code that calls AEROS broke the contract of what it called."""


class InternalError(Exception):
    """AEROS itself is wrong: a state was reached that its own reasoning excludes."""


class DisagreementError(InternalError):
    """Both solvers decided a question, and not the same: nothing of the run can be relied on.

    about: what asked it; script: the question.
    """

    def __init__(self, description: str, script: str, first: str, second: str) -> None:
        super().__init__(f"of {description}, {first}, but {second}")
        self.about = description
        self.script = script
        self.answers = (first, second)
