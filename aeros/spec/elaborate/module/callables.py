"""Names by which the steps of a module call skills and capabilities, its own and those of other modules."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import Alternative, Ecm, ForeignNames, Skill, as_seen_by_others, owner_of
from aeros.spec.text.fields import TextField


@dataclass(frozen=True)
class CallableNames:
    """The skills and capabilities that the steps of a module may name.

    Attributes:
        module: id of the module.
        skills: its own skills by name.
        capabilities: names of the alternatives of each of its own capabilities, by its name.
        compositions: its own compositions by name, those in this mapping so far.
        foreign: those of other modules.
        requirements: modules and capabilities that its dependencies declare.
    """

    module: str
    skills: Mapping[str, Skill]
    capabilities: Mapping[str, tuple[str, ...]]
    compositions: Mapping[str, Composition]
    foreign: ForeignNames
    requirements: frozenset[str]

    @property
    def all_skills(self) -> Mapping[str, Skill]:
        """Own skills by name, and those of required modules by `MODULE.SKILL`."""
        return {**self.skills, **self.foreign.skills}

    def alternatives(self, name: TextField, diagnostics: Diagnostics) -> tuple[Alternative, ...]:
        """Look up the ways to do what a step names; report a name that nothing has.

        Args:
            name: the name, with its position in the file.
            diagnostics: receives the faults.

        Returns:
            The alternatives; empty after a report.
        """
        text = name.value
        owner, dot, _ = text.rpartition(".")
        if dot and owner not in self.foreign.modules:
            self._report_owner(name, owner, diagnostics)
            return ()
        own = self.capabilities.get(text)
        if own is not None and text in self.skills and own != (text,):
            headline = f"`{text}` is the name of a skill and of a capability that other skills provide"
            diagnostics.error("AE121", headline, name.span, help=("rename one of them",))
            return ()
        if text in self.all_skills:
            return (Alternative(text),)
        if own is not None:
            ways = [
                Alternative(one, None if one in self.skills else self.compositions.get(one)) for one in own
            ]
            return (*ways, *self.foreign.capabilities.get(text, ()))
        if text in self.foreign.capabilities:
            return self.foreign.capabilities[text]
        if text in self.requirements:
            listed = ", ".join(f"`{one}` {version}" for one, version in self.foreign.unsuitable.get(text, ()))
            code, headline = "AE305", f"no module here provides `{text}`"
            if listed:
                code, headline = "AE306", f"`{text}` is here in versions that do not suit: {listed}"
            diagnostics.error(code, headline, name.span, "needed here")
            return ()
        named = {**dict.fromkeys(self.all_skills), **dict.fromkeys(self.capabilities)}
        named |= dict.fromkeys(self.foreign.capabilities)
        resolve_name(name, named, "a skill or capability of this module", diagnostics)
        return ()

    def skills_for(self, name: TextField, diagnostics: Diagnostics) -> tuple[Skill, ...]:
        """Look up the skills any of which may run where only skills can.

        Args:
            name: the name, with its position in the file.
            diagnostics: receives the faults.

        Returns:
            The skills; empty after a report.
        """
        found = self.alternatives(name, diagnostics)
        composed = next((one.name for one in found if one.name not in self.all_skills), None)
        if composed is not None:
            headline = f"`{name.value}` cannot run here: `{composed}`, which provides it, is not a skill"
            diagnostics.error("AE122", headline, name.span)
            return ()
        return tuple(self.all_skills[one.name] for one in found)

    def _report_owner(self, name: TextField, owner: str, diagnostics: Diagnostics) -> None:
        if owner in self.requirements:
            diagnostics.error("AE122", f"`{name.value}` is of a module that is missing", name.span)
            return
        headline = f"`{name.value}` is of another module, and no dependency declares `{owner}`"
        help_ = f'add `{owner}: ">=1.0"` to `dependencies.modules`'
        diagnostics.error("AE122", headline, name.span, help=(help_,))


def foreign_names(
    modules: Mapping[str, Ecm],
    required: Collection[str],
    providers: Mapping[str, Sequence[tuple[Ecm, bool]]],
) -> ForeignNames:
    """List what a module may call of other modules.

    Args:
        modules: modules that it requires, or that provide a capability that it requires, by name.
        required: names of the modules that it requires by name.
        providers: for each required capability, the modules that provide it in a version that suits; each
            with True if it is active.

    Returns:
        Skills and capabilities of required modules by `MODULE.NAME`, and the alternatives of each required
        capability; if active modules provide it, only theirs.
    """
    skills: dict[str, Skill] = {}
    owners = {name: one for ecm in modules.values() for name, one in ecm.foreign.owners.items()}
    for name, ecm in modules.items():
        skills |= ecm.foreign.skills  # its compositions may run these
        skills |= {f"{name}.{one.id}": replace(one, id=f"{name}.{one.id}") for one in ecm.skills.values()}
    called = {name: ecm for name, ecm in modules.items() if name in required}
    capabilities = {
        f"{name}.{capability}": alternatives_of(ecm, capability)
        for name, ecm in called.items()
        for capability in ecm.capabilities
    }
    for capability, found in providers.items():
        preferred = [ecm for ecm, is_active in found if is_active] or [ecm for ecm, _ in found]
        if preferred:
            ways = [way for ecm in preferred for way in alternatives_of(ecm, capability)]
            capabilities[capability] = tuple(ways)
    return ForeignNames(called, skills, capabilities, owners | dict(modules))


def alternatives_of(ecm: Ecm, capability: str) -> tuple[Alternative, ...]:
    """List the alternatives of a capability as other modules name them.

    Args:
        ecm: module that provides it.
        capability: the capability.

    Returns:
        The alternatives by `MODULE.NAME`.
    """
    return tuple(
        Alternative(
            ".".join(owner_of(one.name, ecm.id)),
            None if one.composition is None else as_seen_by_others(ecm.id, one.composition),
        )
        for one in ecm.alternatives(capability)
    )


def capability_names(ecm: declared.Ecm) -> dict[str, tuple[str, ...]]:
    """List the alternatives of each capability by their names.

    Args:
        ecm: the declared module.

    Returns:
        Names of skills and compositions by capability; skills in sequence are joined by `+`.
    """
    return {
        name.value: tuple(alternative_name(one) for one in capability.provided_by)
        for name, capability in ecm.capabilities
    }


def alternative_name(alternative: TextField | tuple[TextField, ...]) -> str:
    """Name an alternative of a capability.

    Args:
        alternative: a name, or the names of skills in sequence.

    Returns:
        The name; names in sequence are joined by `+`.
    """
    if isinstance(alternative, TextField):
        return alternative.value
    return "+".join(one.value for one in alternative)
