"""Repairs of a site's quotas: what changes no decision is removed, and the quotas are proved again.

The gate decides as before: a kind that no module may ever execute is never counted, and a quota that does not
run out before another one denies nothing by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from aeros.spec.diagnostics.codes import Diagnostics, Fix
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import elaborate_source
from aeros.spec.model.policy import Quota
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.quotas import denial_of_kind, quota_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.nodes import Node, ScalarNode, SequenceNode
from aeros.spec.verification.repairs.manifest_edit import ManifestEditor
from aeros.spec.verification.repairs.repair import Repair


def find_quota_repairs(site: Site, source: Source, claims: Iterable[StaticClaim]) -> Mapping[ClaimId, Repair]:
    """Find proved edits of a site file for the quotas that are warned of.

    Args:
        site: the site.
        source: text of the site file; with overlays in it there is no repair, as these are several files.
        claims: claims about the site.

    Returns:
        The repair by the id of each claim that has one.
    """
    found: dict[ClaimId, Repair] = {}
    quotas = {one.id: one for one in site.quotas if one.span.source == source}
    for claim in claims:
        form = claim.id.form
        is_of_quota = form in (ClaimForm.QUOTA_EFFECTIVE, ClaimForm.QUOTA_NEEDED)
        if claim.diagnostic is None or not is_of_quota or claim.id.name_of("quota") not in quotas:
            continue
        quota = quotas[claim.id.name_of("quota")]
        kinds = frozenset(kind for kind in quota.kinds if denial_of_kind(site, kind) is None)
        kept = kinds if form is ClaimForm.QUOTA_EFFECTIVE else frozenset()
        editor = ManifestEditor(source)
        fix = _without_kinds(editor, quota, kept)
        if fix is not None and _is_proved(site, Source(source.path, editor.applied(fix)), claim, quota, kept):
            line = f"on: [{', '.join(sorted(kept))}]" if kept else f"remove the quota `{quota.id}`"
            found[claim.id] = Repair(line, fix)
    return found


def repair_quotas(source: Source) -> str:
    """Apply one proved edit after the other to a site file, until no quota has a repair.

    Args:
        source: text of a site file.

    Returns:
        The text with its quotas repaired.
    """
    while (site := elaborate_source(source, Diagnostics())) is not None:
        repairs = find_quota_repairs(site, source, quota_obligations(site))
        fix = next((one.fix for one in repairs.values() if one.fix is not None), None)
        if fix is None:
            break
        source = Source(source.path, ManifestEditor(source).applied(fix))
    return source.text


def _without_kinds(editor: ManifestEditor, quota: Quota, kept: frozenset[str]) -> Fix | None:
    """Return the edit that leaves a quota some of its kinds, or that removes it if these are none."""
    quotas = editor.node("policy", "quotas")
    if not isinstance(quotas, SequenceNode):
        return None
    number = next((n for n, one in enumerate(quotas.items) if _holds(one, quota)), None)
    if number is None:
        return None
    if not kept and len(quotas.items) == 1:
        return editor.empty_list(editor.node("policy"), "quotas")
    if not kept:
        return editor.remove_item(quotas, number)
    counted = editor.node("policy", "quotas", number, "on")
    if not isinstance(counted, SequenceNode):
        return None
    removed = [
        at for at, one in enumerate(counted.items) if not (isinstance(one, ScalarNode) and one.text in kept)
    ]
    return editor.remove_item(counted, removed[0]) if len(removed) == 1 else None


def _holds(node: Node, quota: Quota) -> bool:
    return node.span.start <= quota.span.start < node.span.end


def _is_proved(site: Site, edited: Source, claim: StaticClaim, quota: Quota, kept: frozenset[str]) -> bool:
    """Tell if the edited site has the same quotas but for what is removed, and no warning of this one."""
    diagnostics = Diagnostics()
    repaired = elaborate_source(edited, diagnostics)
    if repaired is None or any(True for _ in diagnostics):
        return False
    wanted = [_meaning(one) for one in site.quotas if one.id != quota.id]
    others = [_meaning(one) for one in repaired.quotas if one.id != quota.id]
    mine = [one.kinds for one in repaired.quotas if one.id == quota.id]
    before, after = _failing(site), _failing(repaired)
    return others == wanted and mine == [kept] * bool(kept) and after <= before - {claim.id}


def _failing(site: Site) -> set[ClaimId]:
    return {one.id for one in quota_obligations(site) if one.diagnostic is not None}


def _meaning(quota: Quota) -> tuple[object, ...]:
    return quota.id, quota.kinds, quota.max_count, quota.window_s
