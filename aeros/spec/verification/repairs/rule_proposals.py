"""Repairs of a task's rules and start: candidates, of which none is proved yet."""

from __future__ import annotations

from typing import Any

from aeros.spec.diagnostics.codes import Fix
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.hold_conditions import HOLD_LOST
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.verification.repairs.manifest_edit import ManifestEditor, quoted
from aeros.spec.verification.repairs.repair import BACKTICKED, Candidates, FailedClaim


class RuleProposals:
    """Candidates for claims about the closed loop of a task.

    Args:
        ecm: the module.
        editor: editor of its manifest.
    """

    def __init__(self, ecm: Ecm, editor: ManifestEditor) -> None:
        self._ecm = ecm
        self._editor = editor

    def call_when_ready(self, failed: FailedClaim) -> Candidates:
        """Call a skill only where its precondition holds, or make the precondition true before.

        Args:
            failed: the claim.

        Yields:
            Each candidate.
        """
        rules = self._editor.node("tasks", failed.id.name_of("task"), "rules")
        primary = failed.diagnostic.primary
        if not isinstance(rules, SequenceNode) or primary is None:
            return
        rule = self._editor.smallest_mapping(rules, primary.span, "unless")
        needed = [" ".join(one.span.text.split()).strip("\"'") for one in failed.diagnostic.secondary]
        if rule is None or not needed:
            return
        condition = " and ".join(f"({one})" for one in needed) if needed[1:] else needed[0]
        unless = next(value for key, value in rule.entries if key.text == "unless")
        if isinstance(unless, ScalarNode):
            text = f"{' '.join(unless.text.split())} or not ({condition})"
            yield f"unless: {quoted(text)}", self._editor.replace(unless, text)
        called = _called_by(rule)
        for name, skill in self._ecm.skills.items():
            if name != called and any(one.effects for one in skill.outcomes.values()):
                yield self._run_before(rules, rule, condition, name)

    def keep_invariant(self, failed: FailedClaim) -> Candidates:
        """Do something else after a failure, or first bring about what the invariant needs.

        Args:
            failed: the claim.

        Yields:
            Each candidate.
        """
        task = self._ecm.tasks[failed.id.name_of("task")]
        invariant = next(one for one in task.invariants if one.id == failed.id.name_of("invariant"))
        rules = self._editor.node("tasks", task.id, "rules")
        for rule in rules.items if isinstance(rules, SequenceNode) else ():
            if isinstance(rule, MappingNode):
                yield from self._handle_otherwise(rule)
                yield from self._bring_about_before(rules, rule, frozenset(t.variables_of(invariant.term)))
        yield from self.recover(failed)

    def _handle_otherwise(self, rule: MappingNode) -> Candidates:
        """Run another skill than a rule does between two tries or after a failure, or none."""
        for key, value in rule.entries:
            if key.text in ("between_tries", "on_failure") and isinstance(value, ScalarNode):
                for name in self._ecm.skills:
                    if name != value.text:
                        yield f"{key.text}: {name}", self._editor.replace(value, name)
                line = f"remove `{key.text}` from that rule"
                yield line, self._editor.remove_entry(rule, key.text)

    def _bring_about_before(self, rules: Node | None, rule: MappingNode, names: frozenset[str]) -> Candidates:
        """Before the rule of a skill that changes some of `names`, run one that sets another of them."""
        called = _called_by(rule)
        changed = names & _effects_of(self._ecm.skills.get(called)).keys()
        for name, skill in self._ecm.skills.items() if changed else ():
            for affected, value in _effects_of(skill).items():
                word = affected.removeprefix(f"{self._ecm.id}.")
                if name == called or affected not in names - changed:
                    continue
                if isinstance(value, bool):
                    needed = word if value else f"not {word}"
                elif isinstance(value, str):
                    needed = f"{word} == {value}"
                else:
                    continue
                yield self._run_before(rules, rule, needed, name)

    def _run_before(
        self, rules: Node | None, rule: MappingNode, condition: str, name: str
    ) -> tuple[str, Fix | None]:
        """Run a skill before that of a rule, unless a condition holds."""
        line = f"{{unless: {quoted(condition)}, do: {name}}}"
        fix = self._editor.insert_item(rules, rule, line)
        return f"- {line}` before the rule for `{_called_by(rule)}", fix

    def correct_start(self, failed: FailedClaim) -> Candidates:
        """Leave a value out of `initial`, so that it may be anything, or state the opposite.

        Args:
            failed: the claim.

        Yields:
            Each candidate.
        """
        task = self._ecm.tasks[failed.id.name_of("task")]
        initial = self._editor.node("tasks", task.id, "initial")
        named = BACKTICKED.findall(failed.diagnostic.headline)
        for key, value in initial.entries if isinstance(initial, MappingNode) else ():
            full = key.text if key.text in task.initial else f"{self._ecm.id}.{key.text}"
            if full not in t.variables_of(task.goal) and not {key.text, full} & set(named):
                continue
            opposite = (
                {"true": "false", "false": "true"}.get(value.text) if isinstance(value, ScalarNode) else None
            )
            if opposite is not None:
                yield f"{key.text}: {opposite}` under `initial", self._editor.replace(value, opposite)
            yield f"remove `{key.text}` from `initial`", self._editor.remove_entry(initial, key.text)

    def recover(self, failed: FailedClaim) -> Candidates:
        """Run another skill where one has failed.

        Args:
            failed: the claim.

        Yields:
            Each candidate.
        """
        rules = self._editor.node("tasks", failed.id.name_of("task"), "rules")
        if not isinstance(rules, SequenceNode):
            return
        for rule in rules.items:
            if not isinstance(rule, MappingNode) or any(key.text == "on_failure" for key, _ in rule.entries):
                continue
            skill = self._ecm.skills.get(_called_by(rule))
            fails = skill is not None and (
                skill.hold_condition is not None or any(one.failure for one in skill.outcomes.values())
            )
            for name, other in self._ecm.skills.items() if fails else ():
                if other is not skill and other.outcomes.keys() != {HOLD_LOST}:
                    yield f"on_failure: {name}", self._editor.add_entry(rule, "on_failure", name)


def _called_by(rule: MappingNode) -> str:
    """Return what a rule runs; nothing if it does not say so by a name."""
    called = (one.text for key, one in rule.entries if key.text == "do" and isinstance(one, ScalarNode))
    return next(called, "")


def _effects_of(skill: Skill | None) -> dict[str, Any]:
    """Return what a skill sets when it succeeds, by state variable."""
    outcomes = () if skill is None else skill.outcomes.values()
    return {name: value for one in outcomes if not one.failure for name, value in one.effects.items()}
