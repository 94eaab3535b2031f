"""Claims about the modules that a site names: its grants, overrides and settings are for existing modules.

A misspelt name would be without effect, and a module that takes the name later would get what was meant for
another.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel, did_you_mean
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.summary import BlockSummary, ModuleSummary, SiteSummary
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.discovery import reference_site_path

_SLIP: Final = 0.85
"""Least similarity of two names (0 to 1, `difflib`) of which one is probably a slip of the other."""


def policy_name_obligations(
    skills: Mapping[str, Collection[str]], site: SiteSummary
) -> Iterator[StaticClaim]:
    """Claim that the modules and skills that the policy names are in the set; the others are warnings.

    Args:
        skills: names of the skills of each module, by the module's name.
        site: the site they would be installed at.

    Yields:
        A claim for each grant, shared variable and override.
    """
    absent = {name: span for name, span in _own_grants(site).items() if name not in skills}
    for name in site.grants:
        # One warning for all of them: a site for several modules is used with a few of them, too.
        is_first = name == next(iter(absent), None)
        yield StaticClaim(ClaimForm.GRANT_IS_USED(name), _absent_grants(absent) if is_first else None)
    for name, span in site.shared.items():
        module = name.partition(".")[0]
        warning = _missing_module(
            f"the site shares `{name}`, but `{module}` is not in this set, so the value is never known",
            span,
            "install the module, or remove the entry until there is one",
        )
        yield StaticClaim(ClaimForm.SHARED_IS_USED(name), None if module in skills else warning)
    for block in site.blocks:
        is_present = block.module in skills and (block.skill is None or block.skill in skills[block.module])
        named = block.module if block.skill is None else f"{block.module}.{block.skill}"
        warning = _missing_module(
            f"the operator override `{block.id}` blocks `{named}`, which is not in this set",
            block.span,
            _cure_of_block(block, skills),
        )
        yield StaticClaim(ClaimForm.BLOCK_IS_USED(block.id), None if is_present else warning)


def names_near(modules: Collection[str], site: SiteSummary) -> frozenset[str]:
    """List the names in overrides and grants that are nearly the names of some modules.

    Args:
        modules: names of the modules.
        site: the site.

    Returns:
        The names, without those that only a site that comes with AEROS grants something.
    """
    blocked = (one.module for one in site.blocks if one.module is not None)
    named = {*_own_grants(site), *blocked} - {*modules}
    return frozenset(one for one in named if any(_is_slip(one, name) for name in modules))


def _is_slip(name: str, other: str) -> bool:
    """Tell if two different names differ by a letter or two, as `polsh` and `polish` do."""
    return name != other and SequenceMatcher(None, name, other).ratio() >= _SLIP


def _own_grants(site: SiteSummary) -> dict[str, SourceSpan]:
    """Return the grants that whoever verifies can change: not those of a site that comes with AEROS."""
    shipped = reference_site_path().parent
    return {name: span for name, span in site.grants.items() if Path(span.source.path).parent != shipped}


def misspelt_policy_names(
    ecm: ModuleSummary, site: SiteSummary, others: Collection[str]
) -> Iterator[StaticClaim]:
    """Claim that grants and overrides of one module have its name and those of its skills.

    What names a module that is not there may be for one that nobody verifies now. What nearly has the name of
    this module, and of no other that is there, is probably for this one.

    Args:
        ecm: the module.
        site: the site it would be installed at.
        others: names of further modules that are there.

    Yields:
        A claim for each grant and override that has no effect; each is a warning.
    """

    def concerns_it(module: str | None) -> bool:
        return module == ecm.id or (module is not None and module not in others and _is_slip(module, ecm.id))

    own = replace(
        site,
        grants={name: span for name, span in site.grants.items() if concerns_it(name)},
        shared={},
        blocks=tuple(block for block in site.blocks if concerns_it(block.module)),
    )
    for claim in policy_name_obligations({ecm.id: ecm.skills}, own):
        if claim.diagnostic is not None:
            yield claim


def settings_obligations(
    settings: Mapping[str, SourceSpan | None], names: Collection[str]
) -> Iterator[StaticClaim]:
    """Claim that modules with settings are among those that are there.

    Args:
        settings: modules with settings, and where in the site file; None if the operator alone gives any.
        names: names of the modules that are there.

    Yields:
        A claim for each of the settings.  One that is not met is a warning if the settings are in a site
        file, which several sets of modules may use, and else an error.
    """
    for name, span in settings.items():
        problem = None if name in names else absent_settings(name, span, names)
        yield StaticClaim(ClaimForm.SETTINGS_ARE_USED(name), problem)


def absent_settings(name: str, span: SourceSpan | None, names: Collection[str]) -> Diagnostic:
    """Describe settings for a module that is not there.

    Args:
        name: name of the module.
        span: where in the site file; None if the operator gives them.
        names: names of the modules that are there.

    Returns:
        A warning for a site file, and else an error.
    """
    near = did_you_mean(name, names)
    listed = ", ".join(f"`{one}`" for one in sorted(names))
    known = f"the modules are {listed}" if listed else "there is no module"
    help_ = f"did you mean `{near}`?" if near else known
    if span is None:
        headline = f"settings are given for `{name}`, and there is no such module"
        return Diagnostic("AE886", headline, help=(help_,))
    headline = f"the site has settings for `{name}`, which is not in this set, so they have no effect"
    return Diagnostic("AE886", headline, SpanLabel(span), help=(help_,), severity=Severity.WARNING)


def _cure_of_block(block: BlockSummary, skills: Mapping[str, Collection[str]]) -> str:
    """Return the name that was probably meant, if one is near."""
    module, skill = block.module or "", block.skill or ""
    if module in skills:
        near = did_you_mean(skill, skills[module])
        found = None if near is None else f"{module}.{near}"
    else:
        found = did_you_mean(module, skills)
    return f"did you mean `{found}`?" if found else "correct the name if something is meant to be blocked"


def _absent_grants(grants: Mapping[str, SourceSpan]) -> Diagnostic:
    """Describe the grants for modules that are not there, at least one."""
    first, *others = grants.values()
    named = ", ".join(f"`{name}`" for name in grants)
    are, name = ("are", "one of these names") if others else ("is", "this name")
    warning = _missing_module(
        f"the site grants further access to {named}, which {are} not in this set",
        first,
        f"a module that takes {name} gets the access: remove the grant until a module needs it",
    )
    return replace(warning, secondary=tuple(SpanLabel(one) for one in others))


def _missing_module(headline: str, at: SourceSpan, help_: str) -> Diagnostic:
    return Diagnostic("AE886", headline, SpanLabel(at), help=(help_,), severity=Severity.WARNING)
