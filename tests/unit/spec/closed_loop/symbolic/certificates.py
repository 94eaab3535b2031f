"""Certificates of loops as obligations."""

from __future__ import annotations

from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.obligations.closed_loop import certificate_obligations
from aeros.spec.obligations.obligation import Obligation


def certificate_of(loop: SymbolicLoop) -> list[Obligation]:
    """The obligations of a loop's certificate."""
    return list(certificate_obligations(loop.system.task, loop.certificate()))
