"""Scenes of modules that `aeros verify` proves: one that a run could not load is a warning.

No proof speaks of a scene, so a fault in one leaves the certificate as it is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.scenes.load import FOLDER, known_scenes, load_scene, require_robot, scenes_in
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.verification.reports import Report, SubjectReport


def add_scene_warnings(report: Report) -> Report:
    """Load the scenes of each module, and warn of those that cannot be loaded.

    Args:
        report: report on modules; those that cannot be read are left out.

    Returns:
        The report with the warnings of each module after its other diagnostics.
    """
    folders = [module.path for module in report.modules]
    variables = {module.name: module.variables for module in report.modules}
    variables[""] = report.site.variables
    modules = tuple(
        replace(module, diagnostics=(*module.diagnostics, *_warnings(module, folders, variables)))
        for module in report.modules
    )
    return replace(report, modules=modules)


def _warnings(
    module: SubjectReport, folders: Sequence[Path], variables: Mapping[str, Collection[str]]
) -> Iterator[Diagnostic]:
    """Yield the faults of a module's scenes as warnings, each once."""
    if module.name != str(module.path):  # else it could not be read
        faults = dict.fromkeys(_faults(module, folders, variables))
        yield from (replace(one, severity=Severity.WARNING) for one in faults)


def _faults(
    module: SubjectReport, folders: Sequence[Path], variables: Mapping[str, Collection[str]]
) -> Iterator[Diagnostic]:
    # A run may have the modules beside this one, too.
    neighbours = [path.parent for path in sorted(module.path.resolve().parent.glob(f"*/{MANIFEST}"))]
    around = [
        module.path,
        *(one for one in (*folders, *neighbours) if one.resolve() != module.path.resolve()),
    ]
    known = known_scenes(around)
    for name, span in module.scenes.items():
        if name not in known:
            near = did_you_mean(name, known)
            help_ = (
                f"did you mean `{near}`?" if near else f"add `{FOLDER}/{name}.yaml` to the module's folder"
            )
            label = SpanLabel(span, "a task that cannot be simulated")
            yield Diagnostic("AE002", f"there is no scene `{name}`", label, help=(help_,))
    for name in {**scenes_in(module.path), **{one: None for one in module.scenes if one in known}}:
        try:
            scene = load_scene(name, around, variables=variables)
            if name in module.scenes:
                require_robot(scene)
        except UserError as error:
            yield from (_placed(one, module.scenes.get(name)) for one in error.diagnostics)


def _placed(fault: Diagnostic, span: SourceSpan | None) -> Diagnostic:
    """Show a fault without a place at the task that names the scene."""
    if fault.primary is not None or span is None:
        return fault
    return replace(fault, primary=SpanLabel(span, "the task that names it"))
