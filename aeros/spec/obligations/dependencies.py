"""Claims about what a module needs around it: the runtime's version, and other modules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from packaging.specifiers import SpecifierSet
from packaging.version import Version

import aeros
from aeros.spec.diagnostics import Diagnostic, Label
from aeros.spec.obligations.obligation import Settled
from aeros.spec.presence import Presence


def dependency_obligations(ecm: Presence, around: Mapping[str, Presence]) -> Iterator[Settled]:
    """Every claim of group dependencies about `ecm`, where `around` are the modules beside it."""
    yield Settled(
        "dependencies/runtime",
        None
        if SpecifierSet(ecm.runtime).contains(aeros.__version__, prereleases=True)
        else Diagnostic(
            "AE304",
            f"`{ecm.id}` works with aeros {ecm.runtime}; this is {aeros.__version__}",
            Label(ecm.runtime_span),
        ),
    )
    for name, specifier in ecm.requires.items():
        yield Settled(f"dependencies/{name}", _unmet(ecm, name, specifier, around))
    cycle = _cycle(ecm, around)
    yield Settled(
        "dependencies/acyclic",
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
    if not SpecifierSet(specifier).contains(Version(found.version), prereleases=True):
        return Diagnostic(
            "AE302", f"`{ecm.id}` needs `{name}` {specifier}, but version {found.version} is there", label
        )
    return None


def _cycle(ecm: Presence, around: Mapping[str, Presence]) -> list[str]:
    """A dependency cycle through `ecm`, closed, or nothing."""
    if not ecm.requires:
        return []
    import networkx as nx  # 50 ms, which most modules need not pay

    graph: nx.DiGraph[str] = nx.DiGraph()
    known, pending = {**around, ecm.id: ecm}, [ecm.id]
    while pending:
        here = pending.pop()
        needed = known[here].requires if here in known else {}
        pending += [name for name in needed if name not in graph]
        graph.add_edges_from((here, name) for name in needed)
    for name in ecm.requires:
        if nx.has_path(graph, name, ecm.id):
            return [ecm.id, *nx.shortest_path(graph, name, ecm.id)]
    return []
