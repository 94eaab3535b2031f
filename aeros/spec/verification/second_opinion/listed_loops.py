"""Second opinion on closed loops whose states were listed: their certificates, which both solvers decide.

A loop that was proved by listing its states is computed again as sets of states, by code that the listing
does not share.  The certificate of these sets is obligations like any other: Z3 decides them here, and the
cross-check asks the second solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.findings import LoopPath, format_path
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.reachability import explore_system
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.certificate import CertificateTooLargeError
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from aeros.spec.obligations.closed_loop import certificate_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations


@dataclass(frozen=True)
class ListedLoopsReport:
    """Result of proving listed loops a second time.

    Attributes:
        certified: number of loops whose certificate is proved.
        uncertified: each other loop, as `MODULE.TASK`, and why it has no proved certificate.
    """

    certified: int
    uncertified: tuple[tuple[str, str], ...]


def certify_listed_loops(
    modules: Iterable[tuple[Ecm, Site]], oracle: Oracle, progress: Callable[[str], None]
) -> ListedLoopsReport:
    """Prove each closed loop again that was proved by listing its states.

    Args:
        modules: each module, with the site that has its variables.
        oracle: solver with its budget; it records the questions of the certificates.
        progress: called with a line of text before each loop.

    Returns:
        The result.

    Raises:
        DisagreementError: the sets of states have a fault that the listed states have not, or the solver
            contradicts a certificate.
    """
    certified, uncertified = 0, list[tuple[str, str]]()
    for ecm, site in modules:
        for task in ecm.tasks.values():
            name = f"{ecm.id}.{task.id}"
            system = _faultless_listing(ecm, task, site)
            if system is None:
                continue
            progress(f"the loop of {name} again, as sets of states")
            reason = _uncertified(name, system, oracle)
            if reason is None:
                certified += 1
            else:
                uncertified.append((name, reason))
    return ListedLoopsReport(certified, tuple(uncertified))


def _faultless_listing(ecm: Ecm, task: Task, site: Site) -> TransitionSystem | None:
    """Return a loop in which listing its states finds no fault; None where it finds one, or cannot list."""
    try:
        system = TransitionSystem(ecm, task, site)
        listed = explore_system(system)
    except StateSpaceError:
        return None
    has_fault = listed.blocked_step() is not None or listed.dead_end() is not None
    return None if has_fault or any(map(listed.violation, task.invariants)) else system


def _uncertified(name: str, system: TransitionSystem, oracle: Oracle) -> str | None:
    """Return why a loop has no proved certificate, or None if it has one.

    Raises:
        DisagreementError: the sets have a fault, or the solver contradicts the certificate.
    """
    sets = SymbolicLoop(system)
    try:
        fault = next(_faults(sets), None)
        if fault is not None:
            answers = ("listing its states finds no fault", "as sets of states it has one")
            raise DisagreementError(f"the loop of {name}", f"{fault}\n", *answers)
        obligations = list(certificate_obligations(system.task, sets.certificate()))
    except (StateSpaceError, CertificateTooLargeError) as error:
        return str(error) or "its certificate is too large"
    undecided = 0
    for result in discharge_obligations(obligations, oracle):
        if result.verdict is Verdict.REFUTED:
            answers = ("the sets of states have no fault", f"Z3 refutes {result.obligation.id}")
            raise DisagreementError(f"the loop of {name}", f"{result.obligation.headline}\n", *answers)
        undecided += result.verdict is not Verdict.PROVED
    return f"{undecided} claims of its certificate are undecided" if undecided else None


def _faults(loop: SymbolicLoop) -> Iterator[str]:
    """Yield the path to each fault of a loop."""
    blocked = loop.blocked_step()
    paths: Iterable[LoopPath | None] = chain(
        (None if blocked is None else blocked.path, loop.dead_end()),
        map(loop.violation, loop.system.task.invariants),
    )
    yield from (format_path(loop.system, path) for path in paths if path is not None)
