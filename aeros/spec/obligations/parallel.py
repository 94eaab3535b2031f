"""Claims about branches that run at the same time: they share nothing that only one may have.

Any step of one branch, its handlers included, is taken to run beside any of another.  Conditions that
exclude each other are not looked at: branches that are never taken together are refused all the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, product

from aeros.spec.diagnostics.codes import Diagnostic, Label
from aeros.spec.diagnostics.source import Span
from aeros.spec.expr import terms as t
from aeros.spec.flow.arguments import arguments_of
from aeros.spec.model.composition import Composition, Part, Step, handlers_of
from aeros.spec.model.model import Ecm, Site, Skill
from aeros.spec.model.step_graph import If, Par, children_of, parts_of, steps_of
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.joint import Running, joint_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import Settled


def parallel_obligations(composition: Composition, ecm: Ecm, site: Site) -> Iterator[Obligation | Settled]:
    """Every claim about every `par` of `composition`, whose handlers lead back to none of themselves."""
    pars = [part for part in parts_of(composition.body) if isinstance(part, Par)]
    for number, par in enumerate(pars, 1):
        beside = _Beside(number, par, composition, ecm.skills, site)
        claimed: set[frozenset[str]] = set()
        yield from beside.resources()
        for first, second in combinations(par.branches, 2):
            yield from beside.sharing(first, second)
            yield from beside.actions(first, second, claimed)


def interference(composition: Composition, skills: Mapping[str, Skill], site: Site) -> Iterator[Settled]:
    """The claims about every `par` that take no solver: all but those on joint rules."""
    pars = [part for part in parts_of(composition.body) if isinstance(part, Par)]
    for number, par in enumerate(pars, 1):
        beside = _Beside(number, par, composition, skills, site)
        yield from beside.resources()
        for first, second in combinations(par.branches, 2):
            yield from beside.sharing(first, second)


@dataclass(frozen=True)
class _Use:
    """Where a state variable is read or written."""

    span: Span
    what: str


@dataclass(frozen=True)
class _Beside:
    number: int
    par: Par[Step]
    composition: Composition
    skills: Mapping[str, Skill]
    site: Site

    def resources(self) -> Iterator[Settled]:
        """The branches together never need more of a resource than the site has."""
        demands = [self._demand(branch) for branch in self.par.branches]
        for name in sorted(set().union(*demands)):
            needed, capacity = sum(demand[name] for demand in demands), self.site.resources[name]
            # A branch that needs too much by itself is told of at the `par` inside it.
            short = needed > capacity and all(demand[name] <= capacity for demand in demands)
            holders = [self._holder(branch, name) for branch in self.par.branches]
            labels = tuple(Label(one.span, f"holds `{name}`") for one in holders if one is not None)
            yield Settled(
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

    def _demand(self, part: Part) -> Counter[str]:
        """The most of each resource that `part` may hold at one time."""
        total = Counter(self._resources(part)) if isinstance(part, Step) else Counter[str]()
        for demand in map(self._demand, children_of(part)):
            total = total + demand if isinstance(part, Par) else total | demand
        return total

    def _resources(self, step: Step) -> set[str]:
        return {name for one in self._runs(step) for name in self.skills[one.skill].resources}

    def _holder(self, branch: Part, resource: str) -> Step | None:
        return next((step for step in steps_of(branch) if resource in self._resources(step)), None)

    def _runs(self, step: Step) -> tuple[Step, ...]:
        """`step`, and the handlers that may run in its place."""
        return (step, *handlers_of(step, self.composition.handlers))

    def _all_runs(self, branch: Part) -> list[Step]:
        return [run for step in steps_of(branch) for run in self._runs(step)]

    def sharing(self, first: Part, second: Part) -> Iterator[Settled]:
        """What two branches may not have in common, beside resources: nothing of it takes a solver."""
        yield self._actuators(first, second)
        yield self._effects(first, second)

    def _actuators(self, first: Part, second: Part) -> Settled:
        """No actuator is moved by both branches."""
        claim_id = ClaimForm.PAR_ACTUATORS(self.composition.id, self.number, _name(first), _name(second))
        for a, b in product(self._all_runs(first), self._all_runs(second)):
            shared = sorted(self.skills[a.skill].actuators & self.skills[b.skill].actuators)
            if shared:
                headline = f"`{a.id}` and `{b.id}` may move `{shared[0]}` at the same time"
                labels = (Label(a.span, f"moves `{shared[0]}`"), Label(b.span, "moves it too"))
                help_ = ("run them one after the other, in a `seq`",)
                return Settled(claim_id, Diagnostic("AE859", headline, labels[0], labels[1:], help=help_))
        return Settled(claim_id, None)

    def _effects(self, first: Part, second: Part) -> Settled:
        """Neither branch writes what the other reads or writes."""
        claim_id = ClaimForm.PAR_EFFECTS(self.composition.id, self.number, _name(first), _name(second))
        for one, other in ((first, second), (second, first)):
            uses = self._writes(other) | self._reads(other)
            for name, written in self._writes(one).items():
                if name in uses:
                    headline = f"`{name}` is written by one branch while the other uses it"
                    labels = (Label(uses[name].span, uses[name].what),)
                    help_ = ("run them one after the other, in a `seq`",)
                    label = Label(written.span, written.what)
                    return Settled(claim_id, Diagnostic("AE860", headline, label, labels, help=help_))
        return Settled(claim_id, None)

    def _writes(self, branch: Part) -> dict[str, _Use]:
        found: dict[str, _Use] = {}
        for step in self._all_runs(branch):
            for outcome in self.skills[step.skill].outcomes.values():
                for name in outcome.effects if outcome.probability != 0 else ():
                    found.setdefault(name, _Use(step.span, f"`{step.id}` may set it"))
        return found

    def _reads(self, branch: Part) -> dict[str, _Use]:
        """What preconditions, hold-conditions, conditions and envelopes of the branch speak of."""
        read: list[tuple[t.Term, _Use]] = [
            (part.condition, _Use(part.span, "read here"))
            for part in parts_of(branch)
            if isinstance(part, If)
        ]
        for step in self._all_runs(branch):
            skill = self.skills[step.skill]
            conditions = [one for one in (skill.precondition, skill.hold) if one is not None]
            clauses = [*conditions, *skill.envelope.values()]
            read += [(clause.term, _Use(step.span, f"`{step.id}` reads it")) for clause in clauses]
        return {
            name: use
            for term, use in reversed(read)
            for name, variable in t.variables_of(term).items()
            if variable.role is t.Role.STATE
        }

    def actions(self, first: Part, second: Part, claimed: set[frozenset[str]]) -> Iterator[Obligation]:
        """Yield that every two actions that the branches may ask for together obey the joint rules.

        claimed: the names of each two steps of which this was claimed, to which it adds these.  Branches that
        share a handler share claims.
        """
        runs = ({one.name: one for one in self._running(branch)} for branch in (first, second))
        for a, b in product(*(each.values() for each in runs)):
            pair = frozenset((a.name, b.name))
            if pair in claimed:
                continue
            claimed.add(pair)
            yield from joint_obligations(self.composition.id, self.number, self.site, a, b)

    def _running(self, branch: Part) -> Iterator[Running]:
        sources = {step.id: step for step in steps_of(self.composition.body)}
        for step in self._all_runs(branch):
            name = step.id if sources.get(step.id) is step else f"handler-{step.id}"
            yield Running(name, step, self.skills[step.skill], arguments_of(step, sources, self.skills))


def _name(branch: Part) -> str:
    """A branch by its first step: every branch has one, and no two the same."""
    return next(steps_of(branch)).id
