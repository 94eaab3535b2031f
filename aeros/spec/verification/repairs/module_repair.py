"""Repairs of preconditions, permissions, compositions and planning rules, proved on the whole module.

A candidate is an edit of the manifest.  The edited module is read and proved as a whole, as it stands.  The
edit is offered only if the claim holds then, no other claim fails that did not fail before, none is gone, and
nothing more is left to the gate.  Claims that something can start, is reachable or is not dead are among
them, so that no repair makes a skill dead or a proof vacuous.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId, ClaimPattern
from aeros.spec.obligations.safety import state_rules_of_skill
from aeros.spec.text.nodes import MappingNode, ScalarNode, SequenceNode
from aeros.spec.verification.repairs.edits import ConditionEditor
from aeros.spec.verification.repairs.manifest_edit import ManifestEditor, quoted
from aeros.spec.verification.repairs.repair import BACKTICKED, Candidates, FailedClaim, Repair
from aeros.spec.verification.repairs.rule_proposals import RuleProposals

MAX_TRIALS: Final = 12
"""Edited manifests that are proved for one module; most take a tenth of a second."""

_MAX_LARGE_TRIALS: Final = 3
_LARGE_LOOP: Final = 256
"""Start states of a task from which on the analysis of its rules takes up to a second, each time."""

_MAX_CANDIDATES: Final = 6  # for one claim
_MAX_ROOM: Final = 4  # by which a bound of a whole number is moved


@dataclass(frozen=True)
class ModuleVerdicts:
    """Verdicts of all claims about a module, for comparison with those of its edited text.

    Attributes:
        failing: texts of the claims that are refuted, vacuous, undecided or warned of.
        claims: texts of all claims.
        left_to_gate: texts of the claims that the gate decides at run time.
    """

    failing: frozenset[str]
    claims: frozenset[str]
    left_to_gate: frozenset[str]

    def is_repair_of(self, before: ModuleVerdicts, claim: ClaimId) -> bool:
        """Tell if a claim is mended and nothing else became worse.

        Args:
            before: verdicts of the text as it was.
            claim: the claim that failed.

        Returns:
            True if it holds now, and every other claim is there and fails only if it failed before.
        """
        lost = _without_cases(before.claims) - _without_cases(self.claims)
        if claim.form in _ENDED_BY_REPAIR:
            lost -= _without_cases({str(claim)})
        return (
            not _without_cases({str(claim)}) & _without_cases(self.failing)
            and _without_cases(self.failing) < _without_cases(before.failing)
            and not lost
            and self.left_to_gate <= before.left_to_gate
        )


def _without_cases(claims: Iterable[str]) -> set[str]:
    """Return the claims without the numbers of their cases, of which there may be others after an edit."""
    return {re.sub(r"/\d+$", "", one) for one in claims}


_ENDED_BY_REPAIR: Final = (ClaimForm.IF_COVERS, ClaimForm.IF_COVERS_CASE)
"""Claims that are made only where something is left out."""


Judge = Callable[[Source], ModuleVerdicts | None]
"""Proves a module with another manifest; None if the manifest cannot be read."""


def find_module_repairs(
    ecm: Ecm,
    site: Site,
    manifest: Source,
    failed: Iterable[FailedClaim],
    before: ModuleVerdicts,
    judge: Judge,
    oracle: Oracle,
) -> Mapping[ClaimId, Repair]:
    """Find proved edits of a manifest for claims that failed.

    Args:
        ecm: the module.
        site: its site.
        manifest: text of its manifest.
        failed: claims without a repair.
        before: verdicts of the manifest as it is.
        judge: proves the module with another manifest.
        oracle: solver with its budget.

    Returns:
        The repair by the id of each claim that has one.
    """
    proposals = _Proposals(ecm, site, ManifestEditor(manifest), oracle)
    tried: dict[str, ModuleVerdicts | None] = {}
    most = _MAX_LARGE_TRIALS if _has_large_loop(ecm, site) else MAX_TRIALS
    repairs: dict[ClaimId, Repair] = {}
    for one in failed:
        for number, (line, fix) in enumerate(proposals.for_claim(one)):
            if fix is None or number >= _MAX_CANDIDATES:
                continue
            text = proposals.editor.applied(fix)
            if text not in tried:
                if len(tried) >= most:
                    return repairs
                tried[text] = judge(Source(manifest.path, text))
            verdicts = tried[text]
            if verdicts is not None and verdicts.is_repair_of(before, one.id):
                repairs[one.id] = Repair(line, fix)
                break
    return repairs


def _has_large_loop(ecm: Ecm, site: Site) -> bool:
    for task in ecm.tasks.values():
        try:
            starts = TransitionSystem(ecm, task, site).variables.starts(task.initial)
            if math.prod(map(len, starts.values())) >= _LARGE_LOOP:
                return True
        except StateSpaceError:  # there are none that could be listed
            continue
    return False


class _Proposals:
    """Candidates for each kind of claim; none of them is proved yet."""

    def __init__(self, ecm: Ecm, site: Site, editor: ManifestEditor, oracle: Oracle) -> None:
        self._oracle = oracle
        self._ecm = ecm
        self._site = site
        self.editor = editor
        rules = RuleProposals(ecm, editor)
        self._by_form: Mapping[ClaimPattern, Callable[[FailedClaim], Candidates]] = {
            ClaimForm.SKILL_CAN_START: self._loosen_precondition,
            ClaimForm.INCREMENT_IN_RANGE: self._bound_precondition,
            ClaimForm.ENVELOPE_PERMITTED: self._permit_kind,
            ClaimForm.ENVELOPE_ACTUATORS_DECLARED: self._declare_actuators,
            ClaimForm.ENVELOPE_CHANNELS_PERMITTED: self._permit_names("channels"),
            ClaimForm.SKILL_ACTUATORS_PERMITTED: self._permit_names("actuators"),
            ClaimForm.SKILL_ACTUATORS_HELD: self._hold_actuators,
            ClaimForm.SKILL_SENSORS_PERMITTED: self._permit_names("sensors"),
            ClaimForm.TASK_SENSORS_PERMITTED: self._permit_names("sensors"),
            ClaimForm.DEFINITION_SENSORS_PERMITTED: self._permit_names("sensors"),
            ClaimForm.COMPOSITION_SENSORS_PERMITTED: self._permit_names("sensors"),
            ClaimForm.PERCEIVER_SENSORS_PERMITTED: self._permit_names("sensors"),
            ClaimForm.SKILL_RISK_STATED: self._raise_risk,
            ClaimForm.STEP_FAILURE_HANDLED: self._stop_on_failure,
            ClaimForm.IF_COVERS: self._otherwise_nothing,
            ClaimForm.IF_COVERS_CASE: self._otherwise_nothing,
            ClaimForm.STEP_READY: self._require_at_start,
            ClaimForm.STEP_READY_CASE: self._require_at_start,
            ClaimForm.HANDLER_READY: self._require_at_start,
            ClaimForm.HANDLER_READY_CASE: self._require_at_start,
            ClaimForm.RULES_DISPATCH: rules.call_when_ready,
            ClaimForm.RULES_PROGRESS: rules.recover,
            ClaimForm.RULES_KEEP_INVARIANT: rules.keep_invariant,
            ClaimForm.RULES_EFFECTIVE: rules.correct_start,
        }

    def for_claim(self, failed: FailedClaim) -> Candidates:
        """Yield candidates for a claim."""
        propose = self._by_form.get(failed.id.form)
        if propose is not None:
            yield from propose(failed)

    def _loosen_precondition(self, failed: FailedClaim) -> Candidates:
        """Move one bound of a precondition that no state meets."""
        skill = self._ecm.skills[failed.id.name_of("skill")]
        node = self.editor.node("skills", skill.id, "precondition")
        if skill.precondition is None or not isinstance(node, ScalarNode):
            return
        declared = (*self._site.observed_variables.values(), *skill.inputs.values())
        scope = state_scope(self._site, skill.inputs)
        editor = ConditionEditor(scope, declared, self._oracle, bounds_state=True)
        if editor.term(text := " ".join(node.text.split())) is None:
            return  # in names that only the module has
        for looser in editor.loosen(text, state_rules_of_skill(self._site, skill)):
            yield f"precondition: {quoted(looser)}", self.editor.replace(node, looser)

    def _bound_precondition(self, failed: FailedClaim) -> Candidates:
        """Add to a precondition that there is room for the change of a number."""
        skill, name = self._ecm.skills[failed.id.name_of("skill")], failed.id.names[-1]
        effect, bounds = (
            skill.outcomes[failed.id.name_of("outcome")].effects[name],
            self._site.state[name].range,
        )
        if bounds is None:
            return
        word = name.removeprefix(f"{self._ecm.id}.")
        compared = "<=" if effect.amount > 0 else ">="
        most = bounds[effect.amount > 0] - effect.amount
        node = self.editor.node("skills", skill.id, "precondition")
        if isinstance(node, ScalarNode):
            bound = re.compile(rf"(?<![\w.])({re.escape(word)}\s*{compared}\s*)-?[\d.]+(?![\w.])")
            text = bound.sub(rf"\g<1>{most}", " ".join(node.text.split()))
            if text != " ".join(node.text.split()):
                yield f"precondition: {quoted(text)}", self.editor.replace(node, text)
        yield from self._require(("skills", skill.id), f"{word} {compared} {most}")

    def _require(self, path: tuple[str, ...], condition: str) -> Candidates:
        """Add a condition to the precondition of a skill or a composition."""
        node = self.editor.node(*path, "precondition")
        if node is None:
            mapping = self.editor.node(*path)
            line = f"precondition: {quoted(condition)}"
            yield line, self.editor.add_entry(mapping, "precondition", condition)
        elif (fix := self.editor.conjoin(node, condition)) is not None:
            yield f"precondition: {fix.text}", fix

    def _permit_kind(self, failed: FailedClaim) -> Candidates:
        """Permit a kind of action that is not permitted at all, as far as the envelope goes."""
        skill, kind = self._ecm.skills[failed.id.name_of("skill")], failed.id.name_of("action")
        if kind in self._ecm.permitted_actions or "inputs." in skill.envelope[kind].text:
            return
        word, text = skill.envelope[kind].kind_name or kind, " ".join(skill.envelope[kind].text.split())
        actions = self.editor.node("permissions", "actions")
        yield (
            f"{word}: {quoted(text)}` under `permissions.actions",
            self.editor.add_entry(actions, word, text),
        )

    def _permit_names(self, group: str) -> Callable[[FailedClaim], Candidates]:
        """Ask for a sensor, actuator or channel that is used."""

        def propose(failed: FailedClaim) -> Candidates:
            known = self._site.state.values() if group == "sensors" else ()
            names = {one.sensor for one in known} | set(getattr(self._site.access, group))
            names |= {one.sensor for one in self._site.cameras.values()} if group == "sensors" else set()
            names |= set(getattr(self._ecm.names, group, {}))
            for name in BACKTICKED.findall(failed.diagnostic.headline):
                if name in names:
                    yield from self._list(("permissions",), group, name)

        return propose

    def _list(self, path: tuple[str, ...], group: str, name: str) -> Candidates:
        place = ".".join(path)
        node = self.editor.node(*path, group)
        if isinstance(node, SequenceNode):
            yield f"{name}` under `{place}.{group}", self.editor.add_item(node, name)
        elif node is None and isinstance(mapping := self.editor.node(*path), MappingNode):
            yield f"{group}: [{name}]` under `{place}", self.editor.add_list(mapping, group, name)

    def _declare_actuators(self, failed: FailedClaim) -> Candidates:
        for name in BACKTICKED.findall(failed.diagnostic.headline)[1:-1]:
            yield from self._list(("skills", failed.id.name_of("skill")), "actuators", name)

    def _hold_actuators(self, failed: FailedClaim) -> Candidates:
        for name in BACKTICKED.findall(failed.diagnostic.headline)[1:]:
            yield from self._list(("skills", failed.id.name_of("skill")), "resources", name)

    def _raise_risk(self, failed: FailedClaim) -> Candidates:
        skill = self._ecm.skills[failed.id.name_of("skill")]
        needed = max(self._site.kinds[kind].risk for kind in skill.envelope).name.lower()
        node = self.editor.node("skills", skill.id, "risk")
        yield f"risk: {needed}", self.editor.replace(node, needed)

    def _stop_on_failure(self, failed: FailedClaim) -> Candidates:
        step = self._mapping_at(("compositions", failed.id.name_of("composition")), failed, "skill")
        yield "on_failure: stop", self.editor.add_entry(step, "on_failure", "stop")

    def _otherwise_nothing(self, failed: FailedClaim) -> Candidates:
        part = self._mapping_at(("compositions", failed.id.name_of("composition")), failed, "if")
        yield "else: nothing", self.editor.add_entry(part, "else", "nothing")

    def _mapping_at(self, path: tuple[str, ...], failed: FailedClaim, key: str) -> MappingNode | None:
        """Find the mapping of a part of a composition, by the place that the diagnostic marks."""
        primary = failed.diagnostic.primary
        if primary is None or primary.span.source != self.editor.source:
            return None
        return self.editor.smallest_mapping(self.editor.node(*path), primary.span, key)

    def _require_at_start(self, failed: FailedClaim) -> Candidates:
        """Make what a step needs part of the composition's own precondition."""
        composition = failed.id.name_of("composition")
        spans = [one.span for one in failed.diagnostic.secondary]
        if not any(one.source == self.editor.source for one in spans):
            return  # the precondition is that of another module
        wholes = [
            skill.precondition.span for skill in self._ecm.skills.values() if skill.precondition is not None
        ]
        parts = [span for span in spans if any(_holds(whole, span) for whole in wholes)]
        needed = [" ".join(span.text.split()).strip("\"'") for span in parts]
        yield from self._leave_more_room(composition, needed)
        texts = dict.fromkeys(
            (
                " and ".join(dict.fromkeys(needed)),
                *(
                    " ".join(skill.precondition.text.split())
                    for skill in self._ecm.skills.values()
                    if skill.precondition is not None
                    and any(_holds(skill.precondition.span, part) for part in parts)
                ),
            )
        )
        for text in texts:
            if text and "inputs." not in text:
                yield from self._require(("compositions", composition), text)

    def _leave_more_room(self, composition: str, needed: Iterable[str]) -> Candidates:
        """Move bounds of whole numbers in a composition's precondition, for what its steps add to them."""
        node = self.editor.node("compositions", composition, "precondition")
        text = " ".join(node.text.split()) if isinstance(node, ScalarNode) else ""
        for name, declared in self._site.state.items():
            word = name.removeprefix(f"{self._ecm.id}.")
            is_read = any(re.search(rf"(?<![\w.]){re.escape(word)}(?![\w.])", one) for one in needed)
            if not is_read or not isinstance(declared.variable.type, IntegerType):
                continue
            bound = re.compile(rf"(?<![\w.])({re.escape(word)}\s*)(<=|<|>=|>)(\s*)(\d+)(?![\w.])")
            for room in range(1, _MAX_ROOM + 1):
                tighter = bound.sub(partial(_tightened, room=room), text)
                if node is not None and tighter != text:
                    yield f"precondition: {quoted(tighter)}", self.editor.replace(node, tighter)


def _tightened(bound: re.Match[str], room: int) -> str:
    """Write a bound that a regular expression has found so that it leaves more room."""
    word, op, blank, limit = bound.groups()
    return f"{word}{op}{blank}{int(limit) + (room if op.startswith('>') else -room)}"


def _holds(outer: SourceSpan, inner: SourceSpan) -> bool:
    return outer.source == inner.source and outer.start <= inner.start and inner.end <= outer.end
