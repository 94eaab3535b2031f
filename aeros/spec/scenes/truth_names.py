"""Names under `truth` of a scene: each is a state variable, else nobody would read its condition."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from aeros.spec.declared import scene as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.names import resolve_name


def check_truth(
    scene: declared.Scene, variables: Mapping[str, Collection[str]], prefix: str, diagnostics: Diagnostics
) -> None:
    """Check the names under `truth` of one file.

    Args:
        scene: the file. Without `module` it may define variables of any module; where its module is not among
            `variables`, its names are not checked.
        variables: for each module, the short names of its own state variables; those of the site by the
            empty name. A full name of a module that is not among them is not checked.
        prefix: what those that include the file put before its names; a name may be meant with or without it.
        diagnostics: receives the faults.
    """
    module = None if scene.module is None else scene.module.value
    if module is not None and module not in variables:
        return
    owners = list(variables) if module is None else [module, ""]
    known = dict.fromkeys(name for owner in owners for name in variables.get(owner, ()))
    owner = "a module" if module is None else f"`{module}`"
    for name, _ in scene.truth:
        other, dot, short = name.value.rpartition(".")
        if dot and other in variables:
            resolve_name(
                replace(name, value=short),
                dict.fromkeys(variables[other]),
                f"a state variable of `{other}`",
                diagnostics,
            )
        elif not dot and prefix + name.value not in known:
            resolve_name(name, known, f"a state variable of {owner} or of the site", diagnostics)
