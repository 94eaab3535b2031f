"""Site and module files → a proved configuration, as `run` and `decide` need it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol

from aeros.runtime.configuration import Configuration, configure
from aeros.spec.backends.store import default_store
from aeros.spec.certificate import check_lock
from aeros.spec.diagnostics import Diagnostic
from aeros.spec.errors import UndecidedError, UserError
from aeros.spec.model import Block
from aeros.spec.reports import Report
from aeros.spec.verdicts import Conclusion
from aeros.spec.verify import verify


class Prove(Protocol):
    """What `prove` is, for who may be given another."""

    def __call__(
        self,
        paths: Iterable[Path],
        site: Path,
        *,
        certified: bool,
        blocks: Sequence[Block] = (),
        active: Callable[[str], bool] = ...,
    ) -> tuple[Configuration, Report]:
        """See `prove`."""


def prove(
    paths: Iterable[Path],
    site: Path,
    *,
    certified: bool,
    blocks: Sequence[Block] = (),
    active: Callable[[str], bool] = lambda _: True,
) -> tuple[Configuration, Report]:
    """The configuration of the modules at `paths`, all of them proved here and now.

    certified: require that each module's `ecm.lock` is the certificate that results.
    blocks: operator overrides beside those of the site file.
    active: whether the module of that name is to be active.
    Raises `UserError` with every reason why the configuration is refused, `UndecidedError` where the
    only reasons are that the solver ran out of its budget.
    """
    report = verify(paths, site, store=default_store(), blocks=blocks)
    problems: list[Diagnostic] = []
    if report.conclusion is not Conclusion.PROVED or report.site_model is None:
        problems = [problem for subject in report.subjects for problem in subject.diagnostics]
        refusal = UndecidedError if report.conclusion is Conclusion.UNDECIDED else UserError
        raise refusal(problems)
    modules = {}
    for module in report.modules:
        if module.ecm is None or module.certificate is None:
            continue
        problem = check_lock(module.path, module.certificate) if certified else None
        problems += [] if problem is None else [problem]
        if active(module.ecm.id):
            modules[module.ecm.id] = (module.ecm, module.certificate)
    if problems:
        raise UserError(problems)
    return configure(report.site_model, modules), report
