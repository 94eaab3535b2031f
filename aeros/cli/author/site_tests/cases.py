"""Site tests with resolved names and values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from aeros.runtime.gate.decision import Caller
from aeros.runtime.ports import Reading
from aeros.skill import Action
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.obligations.verdicts import Conclusion


@dataclass(frozen=True)
class DecisionCase:
    """Expected decision on a request.

    Attributes:
        name: name of the test.
        span: place of its name in the file.
        caller: the skill that asks, with its inputs.
        action: the requested action, numbers in SI units.
        readings: measured values with their times.
        now: time of the request, s.
        usage: count of each quota.
        kind: the expected kind of decision: ALLOW, ATTENUATE or DENY.
        by: rules or codes that its reasons have to name.
        becomes: expected parameters of the attenuated action, numbers in SI units.
    """

    name: str
    span: SourceSpan
    caller: Caller
    action: Action
    readings: Mapping[str, Reading]
    now: float
    usage: Mapping[str, int]
    kind: str
    by: tuple[str, ...] = ()
    becomes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class VerdictCase:
    """Expected verdict on a module.

    Attributes:
        name: name of the test.
        span: place of its name in the file.
        module: path of the module.
        conclusion: the expected verdict.
        codes: expected codes of its errors; None where any are accepted.
    """

    name: str
    span: SourceSpan
    module: Path
    conclusion: Conclusion
    codes: frozenset[str] | None


@dataclass(frozen=True)
class CaseResult:
    """Result of one test.

    Attributes:
        case: the test.
        problems: differences from the expectation, a line for each; empty if it passed.
    """

    case: DecisionCase | VerdictCase
    problems: tuple[str, ...]

    @property
    def is_passed(self) -> bool:
        """True if nothing differs."""
        return not self.problems
