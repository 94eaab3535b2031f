"""Claims about branches that run at the same time: they share nothing that only one may use.

Any step of one branch, its handlers included, is assumed to run at the same time as any step of another.
Conditions that exclude each other are ignored: branches that never run together are refused all the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.flow.arguments import step_arguments
from aeros.spec.model.composition import Composition, Part, Step, handlers_of
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import HeldPart, If, Par, children_of, steps_of, walk_parts
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.joint import ConcurrentStep, joint_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim


def parallel_obligations(
    composition: Composition, ecm: Ecm, site: Site
) -> Iterator[Obligation | StaticClaim]:
    """Make every claim about the `par` parts of a composition.

    Args:
        composition: the composition; its handlers form no cycle.
        ecm: module that declares it.
        site: site under which the module is elaborated.

    Yields:
        Claims settled at once, and obligations about joint rules for the solver.
    """
    pars = [part for part in walk_parts(composition.body) if isinstance(part, Par)]
    for number, par in enumerate(pars, 1):
        claims = _BranchPairClaims(number, par, composition, ecm.callable_skills, site)
        claimed: set[frozenset[str]] = set()
        yield from claims.resources()
        for first, second in combinations(par.branches, 2):
            yield from claims.shared_use_claims(first, second)
            yield from claims.joint_rule_claims(first, second, claimed)


def interference_claims(
    composition: Composition, skills: Mapping[str, Skill], site: Site
) -> Iterator[StaticClaim]:
    """Make the claims about the `par` parts of a composition that need no solver: all but joint rules.

    Args:
        composition: the composition; its handlers form no cycle.
        skills: skills of the module by name.
        site: site under which the module is elaborated.

    Yields:
        The claims, settled.
    """
    pars = [part for part in walk_parts(composition.body) if isinstance(part, Par)]
    for number, par in enumerate(pars, 1):
        claims = _BranchPairClaims(number, par, composition, skills, site)
        yield from claims.resources()
        for first, second in combinations(par.branches, 2):
            yield from claims.shared_use_claims(first, second)


@dataclass(frozen=True)
class _VariableUse:
    """A place where a state variable is read or written."""

    span: SourceSpan
    description: str


@dataclass(frozen=True)
class _BranchPairClaims:
    """The claims about one `par` and the pairs of its branches."""

    number: int
    par: Par[Step]
    composition: Composition
    skills: Mapping[str, Skill]
    site: Site

    def resources(self) -> Iterator[StaticClaim]:
        """Claim that the branches together never need more of a resource than the site has."""
        demands = [self._resource_demand(branch) for branch in self.par.branches]
        for name in sorted(set().union(*demands)):
            needed, capacity = sum(demand[name] for demand in demands), self.site.resources[name]
            # A branch that needs too much by itself is reported at the `par` inside it.
            short = needed > capacity and all(demand[name] <= capacity for demand in demands)
            holders = [self._holder(branch, name) for branch in self.par.branches]
            labels = tuple(SpanLabel(one.span, f"holds `{name}`") for one in holders if one is not None)
            yield StaticClaim(
                ClaimForm.PAR_RESOURCES(self.composition.id, self.number, name),
                Diagnostic(
                    "AE858",
                    f"these branches need {needed} of `{name}` at the same time; the site has {capacity}",
                    labels[0],
                    labels[1:],
                    help=("run them one after the other, in a `seq`",),
                )
                if short
                else None,
            )

    def _resource_demand(self, part: Part) -> Counter[str]:
        """Compute the largest amount of each resource that `part` may hold at one time."""
        total = Counter(self._resources(part)) if isinstance(part, Step) else Counter[str]()
        for demand in map(self._resource_demand, children_of(part)):
            total = total + demand if isinstance(part, Par) else total | demand
        return total

    def _resources(self, step: Step) -> set[str]:
        return {name for one in self._possible_steps(step) for name in self.skills[one.skill].resources}

    def _holder(self, branch: Part, resource: str) -> Step | None:
        return next((step for step in steps_of(branch) if resource in self._resources(step)), None)

    def _possible_steps(self, step: Step) -> tuple[Step, ...]:
        """Return `step`, and the handlers that may run in its place, once for each skill that may run."""
        steps = (step, *handlers_of(step, self.composition.handlers))
        return tuple(replace(one, skill=run, choices=()) for one in steps for run in one.runs)

    def _all_possible_steps(self, branch: Part) -> list[Step]:
        return [run for step in steps_of(branch) for run in self._possible_steps(step)]

    def shared_use_claims(self, first: Part, second: Part) -> Iterator[StaticClaim]:
        """Claim that two branches share no actuator, and no state variable that one of them writes."""
        yield self._actuators(first, second)
        yield self._effects(first, second)

    def _actuators(self, first: Part, second: Part) -> StaticClaim:
        """Claim that no actuator is moved by both branches."""
        claim_id = ClaimForm.PAR_ACTUATORS(
            self.composition.id, self.number, _branch_name(first), _branch_name(second)
        )
        for a, b in product(self._all_possible_steps(first), self._all_possible_steps(second)):
            shared = sorted(self.skills[a.skill].actuators & self.skills[b.skill].actuators)
            if shared:
                headline = f"`{a.id}` and `{b.id}` may move `{shared[0]}` at the same time"
                labels = (SpanLabel(a.span, f"moves `{shared[0]}`"), SpanLabel(b.span, "moves it too"))
                help_ = ("run them one after the other, in a `seq`",)
                return StaticClaim(claim_id, Diagnostic("AE859", headline, labels[0], labels[1:], help=help_))
        return StaticClaim(claim_id, None)

    def _effects(self, first: Part, second: Part) -> StaticClaim:
        """Claim that neither branch writes a state variable that the other reads or writes."""
        claim_id = ClaimForm.PAR_EFFECTS(
            self.composition.id, self.number, _branch_name(first), _branch_name(second)
        )
        for one, other in ((first, second), (second, first)):
            uses = self._writes(other) | self._reads(other)
            for name, written in (self._disturbs(one) | self._writes(one)).items():
                if name in uses:
                    headline = f"`{name}` is written by one branch while the other uses it"
                    labels = (SpanLabel(uses[name].span, uses[name].description),)
                    help_ = ("run them one after the other, in a `seq`",)
                    label = SpanLabel(written.span, written.description)
                    return StaticClaim(claim_id, Diagnostic("AE860", headline, label, labels, help=help_))
        return StaticClaim(claim_id, None)

    def _writes(self, branch: Part) -> dict[str, _VariableUse]:
        uses: dict[str, _VariableUse] = {}
        for step in self._all_possible_steps(branch):
            for outcome in self.skills[step.skill].outcomes.values():
                # A value that follows from what is stated is set, too: another branch may move what it reads.
                follow = (name for name, value in outcome.consequences.items() if value is not None)
                changed = (*outcome.effects, *(one.variable for one in outcome.ranges), *follow)
                for name in changed if outcome.probability != 0 else ():
                    uses.setdefault(name, _VariableUse(step.span, f"`{step.id}` may set it"))
        return uses

    def _disturbs(self, branch: Part) -> dict[str, _VariableUse]:
        """Collect predicates with a definition that actions of a branch may change."""
        return {
            name: _VariableUse(step.span, f"`{step.id}` may change {reading}, which defines it")
            for step in reversed(self._all_possible_steps(branch))
            for name, reading in self.skills[step.skill].disturbed.items()
        }

    def _reads(self, branch: Part) -> dict[str, _VariableUse]:
        """Collect state variables in preconditions, hold-conditions, conditions and envelopes."""
        read: list[tuple[t.Term, _VariableUse]] = [
            (part.condition, _VariableUse(part.span, "read here"))
            for part in walk_parts(branch)
            if isinstance(part, If)
        ]
        read += [
            (part.condition.term, _VariableUse(part.span, "held here"))
            for part in walk_parts(branch)
            if isinstance(part, HeldPart)
        ]
        for step in self._all_possible_steps(branch):
            skill = self.skills[step.skill]
            conditions = [one for one in (skill.precondition, skill.hold_condition) if one is not None]
            clauses = [*conditions, *skill.envelope.values()]
            read += [(clause.term, _VariableUse(step.span, f"`{step.id}` reads it")) for clause in clauses]
        return {
            name: use
            for term, use in reversed(read)
            for name, variable in t.variables_of(term).items()
            if variable.role is t.VariableRole.STATE
        }

    def joint_rule_claims(
        self, first: Part, second: Part, claimed: set[frozenset[str]]
    ) -> Iterator[Obligation]:
        """Claim that every two actions that the branches may ask for together obey the joint rules.

        Args:
            first: a branch.
            second: another branch.
            claimed: names of each two steps with such a claim already; this adds more.  Branches that share a
                handler share claims.
        """
        runs = ({one.name: one for one in self._concurrent_steps(branch)} for branch in (first, second))
        for a, b in product(*(each.values() for each in runs)):
            pair = frozenset((a.name, b.name))
            if pair in claimed:
                continue
            claimed.add(pair)
            yield from joint_obligations(self.composition.id, self.number, self.site, a, b)

    def _concurrent_steps(self, branch: Part) -> Iterator[ConcurrentStep]:
        sources = {step.id: step for step in steps_of(self.composition.body)}
        for step in self._all_possible_steps(branch):
            written = sources.get(step.id)
            is_in_body = written is not None and step.skill in written.runs and written.span == step.span
            name = step.id if is_in_body else f"handler-{step.id}"
            name += f"-{step.skill}" if is_in_body and len(sources[step.id].runs) > 1 else ""
            yield ConcurrentStep(
                name, step, self.skills[step.skill], step_arguments(step, sources, self.skills)
            )


def _branch_name(branch: Part) -> str:
    """Name a branch after its first step: every branch has one, and no two have the same."""
    return next(steps_of(branch)).id
