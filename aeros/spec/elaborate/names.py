"""Names in a file: a declared name must be free, and a name that is referred to must exist.

A fault suggests the name that was probably intended.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from aeros.spec.declared.models import UsedModels
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.expr.parser import KEYWORDS, NAMES_TOO
from aeros.spec.expr.units import unit_names
from aeros.spec.model.models import ModuleModel
from aeros.spec.model.site import Site
from aeros.spec.text.fields import TextField

_T = TypeVar("_T")

# A name has one meaning, so a declaration may not use these.
_RESERVED = (
    (KEYWORDS - NAMES_TOO)
    | {"inputs", "abs", "min", "max", "norm", "distance", "dot", "vec", "clamp"}
    | set(unit_names())
)


def check_name_is_free(name: TextField, used: Mapping[str, str], what: str, diagnostics: Diagnostics) -> bool:
    """Check that a name has no meaning yet; report the meaning that it has.

    Args:
        name: the new name, with its position in the file.
        used: description of each name in use, such as `a state variable`, by name.
        what: noun for the thing to be named, for the report.
        diagnostics: receives the faults.

    Returns:
        True if the name is free.
    """
    if name.value in _RESERVED:
        diagnostics.error("AE121", f"`{name.value}` is a word of the expression language", name.span)
        return False
    if name.value in used:
        diagnostics.error(
            "AE121",
            f"`{name.value}` is already {used[name.value]}",
            name.span,
            help=(f"choose another name for this {what}",),
        )
        return False
    return True


def resolve_name(name: TextField, among: Mapping[str, _T], what: str, diagnostics: Diagnostics) -> _T | None:
    """Look up a name; report an unknown one with a suggestion.

    Args:
        name: the name, with its position in the file.
        among: known things by name.
        what: noun phrase of what the name should be, such as `an action kind`; it completes “… is not”.
        diagnostics: receives the faults.

    Returns:
        The thing of that name, or None after reporting that there is none.
    """
    if name.value not in among:
        near = did_you_mean(name.value, among)
        listed = ", ".join(f"`{one}`" for one in list(among)[:12]) or "none"
        help_ = f"did you mean `{near}`?" if near else f"declared here: {listed}"
        diagnostics.error("AE122", f"`{name.value}` is not {what}", name.span, help=(help_,))
    return among.get(name.value)


def resolve_need(name: TextField, among: Mapping[str, _T], sort: str, diagnostics: Diagnostics) -> _T | None:
    """Look up a name of a module for a thing of the site; report an unknown one.

    Args:
        name: the name, with its position in the manifest.
        among: things of the site by its names, and by the names of the module's needs.
        sort: sort of the thing, as `is` of a need has it.
        diagnostics: receives the faults.

    Returns:
        The thing of that name, or None after reporting that there is none.
    """
    if name.value not in among:
        near = did_you_mean(name.value, among)
        listed = ", ".join(f"`{one}`" for one in list(among)[:12]) or "none"
        is_word = "." not in name.value
        needed = (f"or declare it under `needs`, as in `{name.value}: {{is: {sort}}}`",) if is_word else ()
        noun = {"action": "action kind", "variable": "state variable"}.get(sort, sort)
        article = "an" if noun[0] in "aeiou" else "a"
        diagnostics.error(
            "AE122",
            f"`{name.value}` is neither {article} {noun} of this site nor a need of this module",
            name.span,
            help=(f"did you mean `{near}`?",) if near else (f"declared here: {listed}", *needed),
        )
    return among.get(name.value)


def resolve_site_name(
    name: TextField, among: Mapping[str, _T], what: str, diagnostics: Diagnostics
) -> _T | None:
    """Look up a name that a site's rules or policy refer to; report an unknown one with a suggestion.

    Args:
        name: the name, with its position in the file.
        among: things that the site declares, by name.
        what: noun phrase of what the name should be, such as `an action kind`; it completes “… is not”.
        diagnostics: receives the faults.

    Returns:
        The thing of that name, or None after reporting that there is none.
    """
    if name.value not in among:
        near = did_you_mean(name.value, among)
        listed = ", ".join(f"`{one}`" for one in among)
        help_ = f"did you mean `{near}`?" if near else f"the site declares {listed}"
        diagnostics.error("AE122", f"`{name.value}` is not {what}", name.span, help=(help_,))
    return among.get(name.value)


def meanings_of_names(site: Site) -> dict[str, str]:
    """Describe each name that has a meaning in conditions under a site.

    Args:
        site: the site.

    Returns:
        Noun phrase of what it means, by name.
    """
    used = dict.fromkeys(site.state, "a state variable of this site")
    used |= dict.fromkeys(site.constants, "a constant of this site")
    used |= dict.fromkeys(site.volumes, "a volume of this site")
    used |= dict.fromkeys(site.definitions, "a definition of this site")
    used |= {role: "a role of a joint rule" for rule in site.joint_rules for role, _ in rule.roles}
    for enum in site.enums.values():
        used |= {enum.name: "an enum of this site"} | dict.fromkeys(
            enum.members, f"a member of `{enum.name}`"
        )
    for kind in site.kinds.values():
        used |= dict.fromkeys(kind.parameters, f"a parameter of `{kind.name}`")
    return used


def resolve_models(
    names: UsedModels, models: Mapping[str, ModuleModel], diagnostics: Diagnostics
) -> tuple[str, ...]:
    """Resolve the names of the models that a skill or a perceiver uses.

    Args:
        names: the names as declared.
        models: models of the module by name.
        diagnostics: receives the faults.

    Returns:
        The names, each once.
    """
    for name in names:
        model = resolve_name(name, models, "a model of this module", diagnostics)
        if model is not None and not model.file:
            diagnostics.error("AE122", f"`{name.value}` has no file to use", name.span)
    return tuple(dict.fromkeys(name.value for name in names))
