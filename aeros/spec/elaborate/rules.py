"""Elaboration of a site's rules: invariants by action kind, and joint rules about two actions at a time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from aeros.spec.declared import site as declared
from aeros.spec.declared.policy import OperatorOverride, Quota
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_condition, elaborate_expression
from aeros.spec.elaborate.names import check_name_is_free, resolve_site_name
from aeros.spec.elaborate.past_time import HistoryCollector
from aeros.spec.elaborate.scopes import action_scope, joint_scope
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.rules import ActionKind, Conjunct, JointRule, Rule
from aeros.spec.model.variables import History
from aeros.spec.text.fields import ExpressionField, MappingField, TextField

_HasId = declared.Invariant | declared.JointInvariant | OperatorOverride | Quota


class ElaboratedRules(NamedTuple):
    """Rules of a site.

    Attributes:
        rules: rules on one action.
        joint_rules: rules on two actions at the same time.
        histories: histories of the rules' past-time conditions.
    """

    rules: tuple[Rule, ...] = ()
    joint_rules: tuple[JointRule, ...] = ()
    histories: tuple[History, ...] = ()


def elaborate_rules(
    site: declared.Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> ElaboratedRules:
    """Elaborate the rules of a site.

    Args:
        site: the declared site.
        vocabulary: its vocabulary, without faults.
        diagnostics: receives the faults.

    Returns:
        The rules without faults.
    """
    elaborator = _RuleElaborator(vocabulary, diagnostics)
    rules = tuple(rule for one in site.invariants if (rule := elaborator.rule(one)) is not None)
    joint = tuple(found for one in site.joint if (found := elaborator.joint_rule(one)) is not None)
    return ElaboratedRules(rules, joint, elaborator.histories.collected)


def check_unique_ids(site: declared.Site, diagnostics: Diagnostics) -> None:
    """Check that no two invariants, joint rules, overrides or quotas of a site have one id.

    Args:
        site: the declared site.
        diagnostics: receives the faults.
    """
    seen: set[str] = set()
    groups: tuple[Iterable[_HasId], ...] = (
        site.invariants,
        site.joint,
        site.policy.blocks,
        site.policy.quotas,
    )
    for one in (one for group in groups for one in group):
        if one.id.value in seen:
            diagnostics.error("AE120", f"the rule `{one.id.value}` is declared twice", one.id.span)
        seen.add(one.id.value)


def resolve_kinds(
    names: Iterable[TextField], vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> list[ActionKind]:
    """Look up the action kinds that a rule or quota names.

    Args:
        names: names of action kinds.
        vocabulary: vocabulary of the site.
        diagnostics: receives the faults.

    Returns:
        The kinds that the site declares.
    """
    found = (resolve_site_name(name, vocabulary.kinds, "an action kind", diagnostics) for name in names)
    return [kind for kind in found if kind is not None]


class _RuleElaborator:
    def __init__(self, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
        self._vocabulary = vocabulary
        self._diagnostics = diagnostics
        self.histories = HistoryCollector()

    def rule(self, invariant: declared.Invariant) -> Rule | None:
        if invariant.on == ():
            self._diagnostics.error(
                "AE112",
                f"the rule `{invariant.id.value}` governs no action kind",
                invariant.id.span,
                help=("name one under `on`, or leave `on` out: the rule then governs all but the stop",),
            )
            return None
        terms: dict[str, t.Term] = {}
        conjuncts: dict[str, tuple[Conjunct, ...]] = {}
        premises: dict[str, tuple[Conjunct, ...]] = {}
        alternatives: dict[str, tuple[Conjunct, ...]] = {}
        attenuations: dict[str, dict[str, t.Term]] = {}
        for kind in self._governed_kinds(invariant):
            scope = replace(action_scope(self._vocabulary, kind), past=True)
            found = elaborate_condition(invariant.require, scope, self._diagnostics)
            if found is None:
                return None  # the same fault would be found for every kind
            terms[kind.name] = self.histories.replace_past_terms(found.term, invariant.require.span)
            conjuncts[kind.name] = self._replace_past_terms(found.conjuncts)
            premises[kind.name] = self._replace_past_terms(found.premises)
            alternatives[kind.name] = self._replace_past_terms(found.alternatives)
            reduced = self._attenuation(invariant.attenuate, kind, scope)
            if reduced:
                attenuations[kind.name] = reduced
        return Rule(
            invariant.id.value,
            invariant.require.value,
            invariant.rationale.value,
            invariant.source.value,
            terms,
            attenuations,
            invariant.span,
            invariant.require.span,
            conjuncts,
            premises,
            alternatives,
        )

    def _governed_kinds(self, invariant: declared.Invariant) -> list[ActionKind]:
        if invariant.on is None:
            return [kind for kind in self._vocabulary.kinds.values() if not kind.protective]
        return resolve_kinds(invariant.on, self._vocabulary, self._diagnostics)

    def _attenuation(
        self, entries: MappingField[ExpressionField], kind: ActionKind, scope: Scope
    ) -> dict[str, t.Term]:
        reduced: dict[str, t.Term] = {}
        for name, expression in entries:
            parameter = kind.parameters.get(name.value)
            type_ = None if parameter is None else parameter.variable.type
            if isinstance(type_, VectorType) and type_.dimension == LENGTH:
                self._diagnostics.error(
                    "AE122",
                    f"`{name.value}` of `{kind.name}` is a place: a shorter vector is another place, "
                    "not a smaller one",
                    name.span,
                )
                continue
            if not isinstance(type_, RealType | VectorType):
                self._diagnostics.error(
                    "AE122", f"`{name.value}` is not a real or vector parameter of `{kind.name}`", name.span
                )
                continue
            term = elaborate_expression(expression, scope, self._diagnostics, RealType(type_.dimension))
            if term is not None:
                reduced[name.value] = self.histories.replace_past_terms(term, expression.span)
        return reduced

    def joint_rule(self, invariant: declared.JointInvariant) -> JointRule | None:
        roles = self._roles(invariant)
        if roles is None:
            return None
        scope = replace(joint_scope(self._vocabulary, roles), past=True)
        found = elaborate_condition(invariant.require, scope, self._diagnostics)
        if found is None:
            return None
        first, second = ((role, kind.name) for role, kind in roles.items())
        return JointRule(
            invariant.id.value,
            invariant.require.value,
            invariant.rationale.value,
            invariant.source.value,
            (first, second),
            self.histories.replace_past_terms(found.term, invariant.require.span),
            invariant.span,
            invariant.require.span,
            self._replace_past_terms(found.conjuncts),
        )

    def _roles(self, invariant: declared.JointInvariant) -> dict[str, ActionKind] | None:
        """Return the action kind of each of the two roles; None after a report."""
        if len(invariant.on) != 2:
            self._diagnostics.error(
                "AE112", "a joint rule has two roles, as in `on: {a: move, b: drive}`", invariant.id.span
            )
            return None
        before = len(self._diagnostics)
        for role, _ in invariant.on:
            check_name_is_free(role, self._vocabulary.used_names, "role", self._diagnostics)
        kinds = {
            role.value: resolve_site_name(kind, self._vocabulary.kinds, "an action kind", self._diagnostics)
            for role, kind in invariant.on
        }
        if len(self._diagnostics) > before:
            return None
        return {role: kind for role, kind in kinds.items() if kind is not None}

    def _replace_past_terms(self, parts: tuple[Conjunct, ...]) -> tuple[Conjunct, ...]:
        return tuple(
            Conjunct(self.histories.replace_past_terms(part.term, part.span), part.span) for part in parts
        )
