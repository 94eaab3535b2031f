"""Selection of the proofs that assume a skill to have no outcome but the declared ones."""

from __future__ import annotations

from typing import Final

from aeros.spec.closed_loop.loop_variables import skills_of
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.step_graph import steps_of
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.verification.certificate import Certificate

_PATH_CLAIM_GROUPS: Final = frozenset(
    (
        ClaimForm.HANDLER_REACHABLE,
        ClaimForm.HANDLER_READY,
        ClaimForm.HANDLER_READY_CASE,
        ClaimForm.IF_COVERS,
        ClaimForm.IF_COVERS_CASE,
        ClaimForm.STEP_REACHABLE,
        ClaimForm.STEP_READY,
        ClaimForm.STEP_READY_CASE,
    )
)
"""Claims about compositions that are proved of paths of outcomes."""

_ACHIEVEMENTS: Final = frozenset((ClaimForm.INTERFACE_ACHIEVED, ClaimForm.INTERFACE_ACHIEVED_CASE))
"""Claims about what an alternative of a capability achieves."""


def obligations_assuming_outcomes(ecm: Ecm, skill: str, certificate: Certificate) -> list[ClaimId]:
    """List the obligations that rest on the declared outcomes of a skill.

    They are those of tasks that run it, those about paths through compositions that run it, and those about
    what a capability achieves that it provides.  Claims about actions do not rest on outcomes: safety and
    permission hold, and the gate decides, whatever the outcome.

    Args:
        ecm: the module.
        skill: name of the skill.
        certificate: certificate of the module.

    Returns:
        Identities of the obligations, sorted by their text.
    """
    tasks = {one.id for one in ecm.tasks.values() if skill in {each.id for each in skills_of(ecm, one)}}
    compositions = {
        one.id
        for one in ecm.compositions.values()
        if skill in {name for step in (*steps_of(one.body), *one.handlers.values()) for name in step.runs}
    }

    def rests(claim_id: ClaimId) -> bool:
        if claim_id.group == "closed-loop":
            return claim_id.name_of("task") in tasks
        if claim_id.form in _ACHIEVEMENTS:
            return claim_id.name_of("alternative") in {skill, *compositions}
        return claim_id.form in _PATH_CLAIM_GROUPS and claim_id.name_of("composition") in compositions

    return sorted(filter(rests, certificate.obligations), key=str)
