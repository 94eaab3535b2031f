"""Scenes of modules that `aeros verify` proves: one that a run could not load is a warning.

No proof speaks of a scene, so a fault in one leaves the certificate as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.scene import Scene
from aeros.spec.scenes.cells import load_cell
from aeros.spec.scenes.load import known_scenes, load_scene, require_robot, scenes_in
from aeros.spec.text.discovery import MANIFEST, SCENES
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
    module: SubjectReport, folders: Sequence[Path], variables: Mapping[str, Mapping[str, Sequence[str]]]
) -> Iterator[Diagnostic]:
    """Yield the faults of a module's scenes as warnings, each once."""
    if module.is_readable:
        faults = dict.fromkeys(_faults(module, folders, variables))
        yield from (replace(one, severity=Severity.WARNING) for one in faults)


def _faults(
    module: SubjectReport, folders: Sequence[Path], variables: Mapping[str, Mapping[str, Sequence[str]]]
) -> Iterator[Diagnostic]:
    # A run may have the modules beside this one, too.
    neighbours = [path.parent for path in sorted(module.path.resolve().parent.glob(f"*/{MANIFEST}"))]
    everywhere = (*folders, *neighbours)
    around = _first(module.path, everywhere)
    known = known_scenes(around)
    for name, span in module.scenes.items():
        if name not in known:
            near = did_you_mean(name, known)
            help_ = (
                f"did you mean `{near}`?" if near else f"add `{SCENES}/{name}.yaml` to the module's folder"
            )
            label = SpanLabel(span, "a task that cannot be simulated")
            yield Diagnostic("AE002", f"there is no scene `{name}`", label, help=(help_,))
    for name in {**scenes_in(module.path), **{one: None for one in module.scenes if one in known}}:
        try:
            scene = load_scene(name, around, module.cameras, variables)
            if scene.module is not None and scene.module not in variables:
                # Another module may be in a folder of another name; a slip is near a name that is known.
                near = did_you_mean(scene.module, [one for one in variables if one])
                yield from () if near is None else (_unknown_module(scene, near),)
            if name in module.scenes:
                require_robot(scene)
                yield from _missing_cameras(module, scene, module.scenes[name])
                for variable in scene.unmeasured(module.measured_by_site):
                    yield _unmeasured(variable, scene.name, module.scenes[name])
        except UserError as error:
            yield from (_placed(one, module.scenes.get(name)) for one in error.diagnostics)

    by_name = {path.name: path for path in everywhere}
    for task, scenes, span in module.composed_scenes:
        if not all(owner in by_name for owner, _ in scenes):
            continue  # a module that is missing, or in a folder of another name
        own_first = {owner: _first(by_name[owner], everywhere) for owner, _ in scenes}
        try:
            load_cell(scenes, own_first, module.cameras, variables)
        except UserError as error:
            yield from (_placed(one, span, f"the scenes of `{task}`") for one in error.diagnostics)


def _unknown_module(scene: Scene, near: str) -> Diagnostic:
    return Diagnostic(
        "AE122",
        f"the scene `{scene.name}` is of the module `{scene.module}`, which is not verified with it",
        help=(f"did you mean `{near}`?", f"or verify `{scene.module}` as well"),
    )


def _missing_cameras(module: SubjectReport, scene: Scene, span: SourceSpan) -> Iterator[Diagnostic]:
    own_names = {one: name for name, one in module.cameras.get(module.name, {}).items()}
    for camera in module.needed_cameras:
        if camera not in scene.cameras:
            own = own_names.get(camera, camera)
            headline = f"the scene `{scene.name}` has no camera `{own}`, which the module takes pictures with"
            help_ = (f"add `{own}` under `cameras` of the scene",)
            yield Diagnostic("AE208", headline, SpanLabel(span, "the task that names it"), help=help_)


def _unmeasured(variable: str, scene: str, span: SourceSpan) -> Diagnostic:
    short = variable.rpartition(".")[2]
    return Diagnostic(
        "AE208",
        f"`{short}` stays unknown in the scene `{scene}`, which has no place or instrument for it",
        SpanLabel(span, "the task that names it"),
        help=(f"add `{short}` under `places` or `instruments` of the scene",),
    )


def _first(folder: Path, others: Iterable[Path]) -> list[Path]:
    """Return a folder and the others after it."""
    return [folder, *(one for one in others if one.resolve() != folder.resolve())]


def _placed(fault: Diagnostic, span: SourceSpan | None, label: str = "the task that names it") -> Diagnostic:
    """Show a fault without a place at the task whose scene it is."""
    if fault.primary is not None or span is None:
        return fault
    return replace(fault, primary=SpanLabel(span, label))
