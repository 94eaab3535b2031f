"""Reports of imports between a module's files that find no file or no name, or go round in a circle."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.obligations.skill_syntax.neighbours import (
    ModuleFiles,
    defined_names,
    import_cycle,
    neighbour_imports,
)
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile, UnreadableCodeError


def missing_neighbour_error(
    file: SkillFile, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Diagnostic | None:
    """Report the first import of a file or of a name that the module does not have.

    Args:
        file: a file of the module.
        files: all its files by path relative to its folder.

    Returns:
        The report; None if every import from another file finds what it names.
    """
    for one in neighbour_imports(file.tree):
        neighbour = files.get(one.path)
        if neighbour is None:
            near = did_you_mean(one.path, [name for name in files if "/" not in name])
            help_ = f"did you mean `{near}`?" if near else f"put `{one.path}` into the folder of the module"
            headline, node = f"there is no `{one.path}` in this module", one.statement
            return Diagnostic("AE143", headline, SpanLabel(file.span(node), "imported here"), help=(help_,))
        if isinstance(neighbour, UnreadableCodeError):
            continue
        defined, name = defined_names(neighbour.tree), one.alias.name
        if name not in (*defined, "*"):
            near = did_you_mean(name, defined)
            advice = f"did you mean `{near}`?" if near else "import a name from the file that defines it"
            return Diagnostic(
                "AE143",
                f"`{one.path}` defines no `{name}`",
                SpanLabel(file.span(one.alias), "imported here"),
                help=(advice,),
            )
    return None


def import_cycle_error(files: ModuleFiles) -> Diagnostic | None:
    """Report files that import each other in a circle.

    Args:
        files: the module's files.

    Returns:
        The report, with each import of the first circle; None if there is none.
    """
    cycle = import_cycle(files)
    if not cycle:
        return None
    (first, imported), *others = cycle
    headline = "a file imports itself" if not others else f"{len(cycle)} files import each other in a circle"
    return Diagnostic(
        "AE144",
        headline,
        SpanLabel(files[first].span(imported.statement), f"`{first}` needs `{imported.path}`"),
        tuple(
            SpanLabel(files[path].span(one.statement), f"`{path}` needs `{one.path}`") for path, one in others
        ),
        help=("put what both need into a file of its own, and import it from there",),
    )
