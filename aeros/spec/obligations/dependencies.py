"""Claims about what a module needs around it: the runtime's version, and other modules."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping

import aeros
from aeros.spec.diagnostics.codes import Diagnostic, Label
from aeros.spec.model.summary import Presence
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Settled
from aeros.spec.obligations.versions import suits


def runtime_obligations(ecm: Presence) -> Iterator[Settled]:
    """That `ecm` works with this version of AEROS."""
    yield Settled(
        ClaimForm.RUNTIME_SUITS(),
        None
        if suits(ecm.runtime, aeros.__version__)
        else Diagnostic(
            "AE304",
            f"`{ecm.id}` works with aeros {ecm.runtime}; this is {aeros.__version__}",
            Label(ecm.runtime_span),
        ),
    )


def dependency_obligations(ecm: Presence, around: Mapping[str, Presence]) -> Iterator[Settled]:
    """Every claim about what `ecm` needs of other modules, where `around` are those beside it."""
    for name, specifier in ecm.requires.items():
        yield Settled(ClaimForm.DEPENDENCY_MET(name), _unmet(ecm, name, specifier, around))
    cycle = _cycle(ecm, around)
    yield Settled(
        ClaimForm.DEPENDENCIES_ACYCLIC(),
        Diagnostic(
            "AE303",
            "modules depend on each other in a circle: " + " → ".join(f"`{name}`" for name in cycle),
            Label(ecm.span),
        )
        if cycle
        else None,
    )


def _unmet(ecm: Presence, name: str, specifier: str, around: Mapping[str, Presence]) -> Diagnostic | None:
    label = Label(ecm.requires_spans[name])
    found = around.get(name)
    if found is None:
        help_ = (f"put the module beside `{ecm.id}`, or remove the dependency",)
        return Diagnostic("AE301", f"`{ecm.id}` needs `{name}`, which is not there", label, help=help_)
    if not suits(specifier, found.version):
        return Diagnostic(
            "AE302", f"`{ecm.id}` needs `{name}` {specifier}, but version {found.version} is there", label
        )
    return None


def _cycle(ecm: Presence, around: Mapping[str, Presence]) -> list[str]:
    """A dependency cycle through `ecm`, closed, or nothing: a shortest one, found breadth first."""
    needed_by = dict.fromkeys(ecm.requires, ecm.id)
    pending = deque(needed_by)
    while pending and ecm.id not in needed_by:
        here = pending.popleft()
        for name in around[here].requires if here in around else ():
            if name not in needed_by:
                needed_by[name] = here
                pending.append(name)
    if ecm.id not in needed_by:
        return []
    cycle = [ecm.id, needed_by[ecm.id]]
    while cycle[-1] != ecm.id:
        cycle.append(needed_by[cycle[-1]])
    return cycle[::-1]
