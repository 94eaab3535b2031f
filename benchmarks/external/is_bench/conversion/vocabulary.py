"""State variables of a converted task, and formulas over them for the predicates of the benchmark.

Each thing that may be moved has a variable `at_THING` with its one support as value: `on_PLACE` or
`in_PLACE`. All other predicates are boolean variables. A predicate that no action can ever make true is the
constant `false` and has no variable.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache

from benchmarks.external.is_bench.conversion.formulas import FALSE, TRUE, conjunction, disjunction, negation
from benchmarks.external.is_bench.conversion.task import Action, Node, Task, category

Support = tuple[str, str]
"""A relation, `on` or `in`, and the thing that supports."""

FLOOR: Support = ("on", "floor")


class UnsupportedError(Exception):
    """A part of a task that cannot be said in AEROS; the message says which."""


def identifier(thing: str) -> str:
    """Return the name of a thing as an identifier of AEROS."""
    return thing.replace(".", "_").replace("-", "_")


class Vocabulary:
    """Variables of a task for given actions.

    Attributes:
        task: the task.
        actions: ground actions that may be run.
        initial: value of each variable at the start, as text.
    """

    def __init__(self, task: Task, actions: Iterable[Action]) -> None:
        self.task = task
        self.actions = tuple(dict.fromkeys(actions))
        self._start = {fact[1]: _support(fact) for fact in task.init if _is_place(fact)}
        self._supports = self._possible_supports()
        self._true = {("contains", *one[1:]) if one[0] == "filled" else one for one in task.init}
        possible = self._possible_facts()
        self._constant = {fact for fact in possible if fact in self._true and not self._can_end(fact)}
        self._possible = [fact for fact in possible if fact not in self._constant]
        self._noted = [one.after for one in task.final if one.after in self.actions]
        self.initial: dict[str, str] = {
            **{f"at_{identifier(thing)}": _member(self._start.get(thing)) for thing in self._supports},
            **{self._name(fact): TRUE if fact in self._true else FALSE for fact in self._possible},
            **{self.run_variable(one): FALSE for one in self._noted},
        }
        self.is_inside = cache(self._is_inside)

    @property
    def places(self) -> list[str]:
        """Members of the enum of supports."""
        found = {_member(one) for supports in self._supports.values() for one in supports}
        return sorted(found | {_member(None)})

    # Predicates

    def fact(self, *fact: str) -> str:
        """Return the formula of a predicate other than a place."""
        if fact in self._constant:
            return TRUE
        return self._name(fact) if fact in self._possible else FALSE

    def at(self, thing: str, relation: str, place: str) -> str:
        """Return the formula that `thing` is directly on or in `place`."""
        if thing in self._supports:
            is_possible = (relation, place) in self._supports[thing]
            return f"at_{identifier(thing)} == {_member((relation, place))}" if is_possible else FALSE
        return TRUE if self._start.get(thing) == (relation, place) else FALSE

    def is_carried(self, thing: str, place: str) -> str:
        """Return the formula that `thing` is on or in `place`, or on or in something that is."""
        return self._reaches(thing, place, ("on", "in"), frozenset())

    def is_nextto(self, one: str, other: str) -> str:
        """Return the formula that both have the same support, the worst case of being side by side."""
        if one == other or self.task.is_substance(one) or self.task.is_substance(other):
            return FALSE
        return disjunction(
            conjunction((self._is_at(one, support), self._is_at(other, support)))
            for support in sorted({*self._normal_supports(one), *self._normal_supports(other)})
        )

    def condition(self, node: Node, bound: Mapping[str, str] | None = None) -> str:
        """Return the formula of a condition of BDDL.

        Args:
            node: the condition.
            bound: things that quantified names stand for.

        Raises:
            UnsupportedError: it has an unknown thing, predicate or connective.
        """
        bound = bound or {}
        if isinstance(node, str) or not node:
            raise UnsupportedError(f"`{node}` is no condition")
        head, rest = node[0], list(node[1:])
        match head, rest:
            case "and", _:
                return conjunction(self.condition(one, bound) for one in rest)
            case "or", _:
                return disjunction(self.condition(one, bound) for one in rest)
            case "not", [one]:
                return negation(self.condition(one, bound))
            case "forall" | "exists", [(str(name), "-", kind), body]:
                found = [one for one, is_ in self.task.kinds.items() if is_ == kind]
                each = (self.condition(body, {**bound, name: one}) for one in found)
                return conjunction(each) if head == "forall" else disjunction(each)
        things = [bound.get(str(word), str(word)) for word in rest]
        for thing in things:
            if thing not in self.task.kinds:
                raise UnsupportedError(f"a condition names `{thing}`, which is no thing of the task")
        match head, things:
            case "inside", [one, other]:
                return self.is_inside(one, other)
            case "ontop", [one, other]:
                return self.at(one, "on", other)
            case "nextto", [one, other]:
                return self.is_nextto(one, other)
            case "filled", [_, _]:
                return self.fact("contains", *things)
            case (("open" | "toggled_on" | "frozen" | "hot" | "cooked" | "real"), [_]):
                return self.fact(str(head), *things)
            case (("covered" | "contains" | "saturated"), [_, _]):
                return self.fact(str(head), *things)
        raise UnsupportedError(f"a condition has the unknown predicate `{head}`")

    # Variables

    def run_variable(self, action: Action) -> str:
        """Return the variable that says that an action was run."""
        return f"run_{'__'.join(map(identifier, action))}"

    def is_noted(self, action: Action) -> bool:
        """Tell if a final condition asks if the action was run."""
        return action in self._noted

    def place_effect(self, thing: str, support: Support) -> dict[str, str]:
        """Return the effect that `thing` has the support."""
        return {f"at_{identifier(thing)}": _member(support)}

    def fact_effect(self, value: str, *fact: str) -> dict[str, str]:
        """Return the effect on a predicate; none if it has no variable."""
        return {self._name(fact): value} if fact in self._possible else {}

    def contents(self, vessel: str) -> list[str]:
        """List the substances that a vessel may ever contain."""
        return [fact[2] for fact in self._ever() if fact[:2] == ("contains", vessel)]

    def coverings(self, thing: str) -> list[str]:
        """List the substances that may ever cover a thing."""
        return [fact[2] for fact in self._ever() if fact[:2] == ("covered", thing)]

    # Construction

    def _name(self, fact: tuple[str, ...]) -> str:
        return "__".join((fact[0], *map(identifier, fact[1:])))

    def _ever(self) -> list[tuple[str, ...]]:
        return [*sorted(self._constant), *self._possible]

    def _can_end(self, fact: tuple[str, ...]) -> bool:
        """Return True if some action may make the fact false."""
        ending = {
            "open": {"close"},
            "toggled_on": {"toggle_off"},
            "covered": {"wipe", "wait_for_washed"},
            "contains": {"wait_for_cooked"},
            "frozen": {"wait", "wait_for_cooked"},
            "hot": {"wait"},
        }.get(fact[0], set())
        return any(action[0] in ending for action in self.actions)

    def _possible_supports(self) -> dict[str, list[Support]]:
        found: dict[str, list[Support]] = {}
        for name, *things in self.actions:
            if name in {"place_on_top", "place_inside"}:
                first = [self._start[things[0]]] if things[0] in self._start else []
                supports = found.setdefault(things[0], first)
                supports.append(("on" if name == "place_on_top" else "in", things[1]))
        return {thing: list(dict.fromkeys(supports)) for thing, supports in found.items()}

    def _possible_facts(self) -> list[tuple[str, ...]]:
        states = {"open", "toggled_on", "covered", "contains", "frozen", "hot", "cooked", "real", "saturated"}
        found = dict.fromkeys(fact for fact in sorted(self._true) if fact[0] in states)
        size = -1
        while size != len(found):
            size = len(found)
            for name, *things in self.actions:
                found |= dict.fromkeys(_made_possible(self.task, name, things, list(found)))
        return list(found)

    # Places

    def _is_inside(self, thing: str, place: str) -> str:
        is_vessel = self.task.is_able(place, "fillable") and not self.task.is_able(place, "openable")
        return self._reaches(thing, place, ("in", "on") if is_vessel else ("in",), frozenset())

    def _reaches(self, thing: str, place: str, last: tuple[str, ...], seen: frozenset[str]) -> str:
        """Return the formula that a chain of supports leads from `thing` to `place`, at the end by `last`."""
        if thing in seen or thing == place:
            return FALSE
        parts = []
        for support in self._supports_of(thing):
            relation, below = support
            if below == place and relation in last:
                parts.append(self.at(thing, *support))
            elif below != place:
                further = self._reaches(below, place, last, seen | {thing})
                parts.append(conjunction((self.at(thing, *support), further)))
        return disjunction(parts)

    def _supports_of(self, thing: str) -> list[Support]:
        start = [self._start[thing]] if thing in self._start else []
        return self._supports.get(thing, start)

    def _normal_supports(self, thing: str) -> list[Support]:
        found = self._supports_of(thing)
        if thing not in self._start:
            found = [*found, FLOOR]
        return [FLOOR if place.startswith("floor.") else (how, place) for how, place in found]

    def _is_at(self, thing: str, support: Support) -> str:
        """Return the formula that a thing has a support; all floors are one, with what stands alone on it."""
        parts = []
        for how, place in self._supports_of(thing):
            if (FLOOR if place.startswith("floor.") else (how, place)) == support:
                parts.append(self.at(thing, how, place))
        if support == FLOOR and thing not in self._start:
            stands = f"at_{identifier(thing)} == {_member(None)}" if thing in self._supports else TRUE
            parts.append(stands)
        return disjunction(parts)


def sources(task: Task, thing: str) -> list[str]:
    """List the substances that come from a source."""
    return [fact[2] for fact in task.init if fact[:2] == ("insource", thing)]


def soaked_up(task: Task, tool: str, substances: Iterable[str]) -> list[str]:
    """List those of the substances that a cleaning tool takes up."""
    rules = [rule for rule in task.wash_rules if rule.tool == category(tool)]
    known = {rule.system for rule in rules} | {value for rule in rules for _, value in rule.needs}
    return [one for one in substances if category(one) in known]


def cooked_form(task: Task, substance: str) -> str | None:
    """Return the substance that cooking makes of another one."""
    start = f"cooked__{category(substance)}."
    return next((one for one in task.kinds if one.startswith(start)), None)


def _made_possible(
    task: Task, name: str, things: list[str], found: list[tuple[str, ...]]
) -> Iterator[tuple[str, ...]]:
    """Yield the facts that an action may make true, if those of `found` are possible."""

    def contents(vessel: str) -> list[str]:
        return [fact[2] for fact in found if fact[:2] == ("contains", vessel)]

    match name, things:
        case "open", [thing]:
            yield "open", thing
        case "toggle_on", [thing]:
            yield "toggled_on", thing
        case "soak_inside", [tool, vessel]:
            yield from (("saturated", tool, one) for one in soaked_up(task, tool, contents(vessel)))
        case "soak_under", [tool, source]:
            yield from (("saturated", tool, one) for one in soaked_up(task, tool, sources(task, source)))
        case "fill_with", [vessel, source]:
            yield from (("contains", vessel, one) for one in sources(task, source))
        case "pour_into", [vessel, target]:
            yield from (("contains", target, one) for one in contents(vessel))
        case "spread", [vessel, target]:
            how = "saturated" if task.has(target, "cloth") else "covered"
            yield from ((how, target, one) for one in contents(vessel))
        case "wait_for_frozen", [thing, _]:
            yield "frozen", thing
        case "wait_for_cooked", [thing]:
            yield from (("cooked", thing), ("hot", thing))
            for vessel in task.kinds:
                for one in contents(vessel):
                    cooked = cooked_form(task, one)
                    if cooked is not None and thing in {vessel, one}:
                        yield from (("contains", vessel, cooked), ("real", cooked))


def _is_place(fact: tuple[str, ...]) -> bool:
    return fact[0] in {"inside", "ontop"} and not fact[1].startswith("agent.")


def _support(fact: tuple[str, ...]) -> Support:
    return ("in" if fact[0] == "inside" else "on", fact[2])


def _member(support: Support | None) -> str:
    return "unsupported" if support is None else f"{support[0]}_{identifier(support[1])}"
