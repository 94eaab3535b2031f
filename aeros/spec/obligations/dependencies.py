"""Claims about a module's requirements: the version of AEROS, and other modules."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping

import aeros
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.missing_module import missing_module
from aeros.spec.model.summary import ModuleSummary
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.versions import is_compatible_version


def runtime_obligations(ecm: ModuleSummary) -> Iterator[StaticClaim]:
    """Claim that a module works with this version of AEROS.

    Args:
        ecm: the module.

    Yields:
        The claim.
    """
    yield StaticClaim(
        ClaimForm.RUNTIME_SUITS(),
        None
        if is_compatible_version(ecm.runtime, aeros.__version__)
        else Diagnostic(
            "AE304",
            f"`{ecm.id}` works with aeros {ecm.runtime}; this is {aeros.__version__}",
            SpanLabel(ecm.runtime_span),
        ),
    )


def dependency_obligations(
    ecm: ModuleSummary, co_installed: Mapping[str, ModuleSummary]
) -> Iterator[StaticClaim]:
    """Make every claim about a module's dependencies on other modules.

    Args:
        ecm: the module.
        co_installed: the modules that its dependencies may refer to, by name.

    Yields:
        A claim for each module and each capability that it needs, and one that dependencies have no cycle.
    """
    for name, specifier in ecm.requires.items():
        yield StaticClaim(
            ClaimForm.DEPENDENCY_MET(name), _unmet_dependency(ecm, name, specifier, co_installed)
        )
    for name, specifier in ecm.required_capabilities.items():
        yield StaticClaim(
            ClaimForm.CAPABILITY_PROVIDED(name), _unprovided_capability(ecm, name, specifier, co_installed)
        )
    cycle = _dependency_cycle(ecm, co_installed)
    yield StaticClaim(
        ClaimForm.DEPENDENCIES_ACYCLIC(),
        Diagnostic(
            "AE303",
            "modules depend on each other in a cycle: " + " → ".join(f"`{name}`" for name in cycle),
            SpanLabel(ecm.span),
        )
        if cycle
        else None,
    )


def _unmet_dependency(
    ecm: ModuleSummary, name: str, specifier: str, co_installed: Mapping[str, ModuleSummary]
) -> Diagnostic | None:
    span = ecm.requires_spans[name]
    module = co_installed.get(name)
    if module is None:
        return missing_module("AE301", ecm.id, name, span)
    if not is_compatible_version(specifier, module.version):
        headline = f"`{ecm.id}` needs `{name}` {specifier}, but found version {module.version}"
        return Diagnostic("AE302", headline, SpanLabel(span))
    return None


def providers_of(capability: str, modules: Iterable[ModuleSummary]) -> list[tuple[str, str]]:
    """List the modules that provide a capability.

    Args:
        capability: name of the capability.
        modules: the modules to look at.

    Returns:
        Pairs of a module's name and the capability's version, sorted.
    """
    return sorted(
        (one.id, one.capability_versions[capability])
        for one in modules
        if capability in one.capability_versions
    )


def _unprovided_capability(
    ecm: ModuleSummary, name: str, specifier: str, co_installed: Mapping[str, ModuleSummary]
) -> Diagnostic | None:
    label = SpanLabel(ecm.capability_spans[name])
    found = providers_of(name, co_installed.values())
    if any(is_compatible_version(specifier, version) for _, version in found):
        return None
    needs = f"`{ecm.id}` needs the capability `{name}` {specifier}"
    if not found:
        help_ = f"add a module with `{name}` under `capabilities`"
        return Diagnostic("AE305", f"{needs}, which no module here provides", label, help=(help_,))
    listed = ", ".join(f"`{module}` provides {version}" for module, version in found)
    return Diagnostic("AE306", f"{needs}, but {listed}", label, help=("use another version of one of them",))


def _dependency_cycle(ecm: ModuleSummary, co_installed: Mapping[str, ModuleSummary]) -> list[str]:
    """Find a shortest dependency cycle through `ecm`, breadth first; empty if there is none."""
    needed_by = dict.fromkeys(ecm.requires, ecm.id)
    pending = deque(needed_by)
    while pending and ecm.id not in needed_by:
        here = pending.popleft()
        for name in co_installed[here].requires if here in co_installed else ():
            if name not in needed_by:
                needed_by[name] = here
                pending.append(name)
    if ecm.id not in needed_by:
        return []
    cycle = [ecm.id, needed_by[ecm.id]]
    while cycle[-1] != ecm.id:
        cycle.append(needed_by[cycle[-1]])
    return cycle[::-1]
