"""Names under `truth` and `parameters` of a scene: each is a variable, else nobody would read its line."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from aeros.spec.declared import scene as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.names import resolve_name


def check_truth(
    scene: declared.Scene,
    variables: Mapping[str, Mapping[str, Sequence[str]]],
    prefix: str,
    diagnostics: Diagnostics,
) -> None:
    """Check the names under `truth` and `parameters` of one file.

    Args:
        scene: the file. Without `module` it may define variables of any module; where its module is not among
            `variables`, its names are not checked.
        variables: for each module, its own state variables by short name, each with the members of its enum;
            those of the site by the empty name. A full name of a module that is not among them is not
            checked.
        prefix: what those that include the file put before its names; a name may be meant with or without it.
        diagnostics: receives the faults.
    """
    module = None if scene.module is None else scene.module.value
    if module is not None and module not in variables:
        return
    owners = list(variables) if module is None else [module, ""]
    known = dict.fromkeys(name for owner in owners for name in variables.get(owner, ()))
    owner = "a module" if module is None else f"`{module}`"
    dotted = [name.value.rpartition(".")[0] for name, _ in scene.truth]
    asked = [variables.get(one, {}) for one in dict.fromkeys((*owners, *dotted)) if one]
    _check_parameters(scene, asked, owner, diagnostics)
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


def check_parameters_are_used(
    scene: declared.Scene, used: Collection[str], truths: Iterable[str], diagnostics: Diagnostics
) -> None:
    """Check that each parameter of one file changes a truth of it, and not only one of an included file.

    Args:
        scene: the file.
        used: names of the parameters that its own truths speak of.
        truths: names of all truths, also of included files, as `truth_name` makes them.
        diagnostics: receives the faults.
    """
    dependent = sorted({one.partition("(")[0] for one in truths if "(" in one})
    for name, _ in scene.parameters:
        if name.value in used:
            continue
        cures = [f"say under `truth` of this file what depends on `{name.value}`, or remove it here"]
        if dependent:
            listed = ", ".join(f"`{one}`" for one in dependent)
            cures.append(f"a full name there replaces what an included scene says of it: {listed}")
        headline = f"no `truth` of this file uses the parameter `{name.value}`"
        diagnostics.error("AE208", headline, name.span, help=tuple(cures))


def _check_parameters(
    scene: declared.Scene,
    variables: Iterable[Mapping[str, Sequence[str]]],
    owner: str,
    diagnostics: Diagnostics,
) -> None:
    """Check that the names are parameters, and that these have the values."""
    members: dict[str, list[str]] = {}
    for one in variables:
        for variable, known in one.items():
            if known:
                members.setdefault(variable, []).extend(known)
    for name, things in scene.parameters:
        values = resolve_name(name, members, f"a parameter of {owner} with named values", diagnostics)
        for value, _ in things if values is not None else ():
            resolve_name(value, dict.fromkeys(values or ()), f"a value of `{name.value}`", diagnostics)
