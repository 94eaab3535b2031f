"""Faults that a missing module causes in one that requires it: one error in place of one for each name."""

from __future__ import annotations

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.missing_module import missing_module
from aeros.spec.model.ecm import ForeignNames


def blame_missing_modules(ecm: declared.Ecm, foreign: ForeignNames, faults: Diagnostics) -> Diagnostics:
    """Replace the faults about names of a missing module by one error about the module.

    Args:
        ecm: the declared module, which was elaborated.
        foreign: names of the required modules that were found.
        faults: faults of its elaboration.

    Returns:
        The faults, without those that name something of a required module that was not found.
    """
    absent = [name for name, _ in ecm.dependencies.modules if name.value not in foreign.modules]
    blamed = [name for name in absent if any(f"`{name.value}." in one.headline for one in faults)]
    if not blamed:
        return faults
    remaining = Diagnostics()
    for name in blamed:
        remaining.report(missing_module("AE301", ecm.id.value, name.value, name.span))
    for one in faults:
        if not any(f"`{name.value}." in one.headline for name in blamed):
            remaining.report(one)
    remaining.dropped += faults.dropped
    return remaining
