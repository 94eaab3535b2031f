"""Lists of what the monitor watches, explored: after an action was added or removed, from every state."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.ports import Reading
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.monitor.tick_answers import MONITOR, declare_bools

_ACTIONS: Final = ("1", "2", "3")
_PAIRS: Final = tuple("".join(pair) for pair in combinations(_ACTIONS, 2))
_JOINT_RULES: Final = ("x", "y")
_PARAMETERS: Final = ("p", "q")

_WATCH_FIELDS: Final = (
    *(f"watches.{one}" for one in _ACTIONS),
    *(f"watches.{pair}.{rule}" for pair in _PAIRS for rule in _JOINT_RULES),
    *(f"lists.{one}" for one in _ACTIONS),
)


class _Site:
    """A monitor of a site with three actions, perhaps two joint rules on each pair, and perhaps histories."""

    def __init__(self, monitor: ModuleType, ask: DecideBranch, under_way: tuple[str, ...]) -> None:
        self._monitor, self._ask = monitor, ask
        self.calls: list[tuple[str, ...]] = []
        self.are_calls_wrong = False
        self.values = {one: {name: object() for name in _PARAMETERS} for one in _ACTIONS}
        self.actions = {
            one: SimpleNamespace(
                name=one,
                record_number=f"number {one}",
                readings={"r": Reading(f"decided {one}", 0.0), "h": Reading(True, 0.0)},
                action=SimpleNamespace(kind=f"kind {one}", parameters=self.values[one]),
            )
            for one in _ACTIONS
        }
        self.by_kind = {f"kind {one}": object() for one in _ACTIONS}
        self.joint = {(pair, rule): (object(), object()) for pair in _PAIRS for rule in _JOINT_RULES}
        self.monitor = self._make_monitor(under_way)

    def _make_monitor(self, under_way: tuple[str, ...]) -> Any:
        made = object.__new__(self._monitor.RuntimeMonitor)
        made._compiled = SimpleNamespace(
            by_kind=self.by_kind,
            parameters={
                f"kind {one}": {name: (lambda value, name=name: {name: value}) for name in _PARAMETERS}
                for one in _ACTIONS
            },
            rules_for_pair=self._rules_for_pair,
            fast_check=lambda kind, names: ("fast", kind, names),
        )
        made.tracker = SimpleNamespace(
            add=lambda number, plan: self._call("tracks", number, plan),
            remove=lambda number: self._call("forgets", number),
        )
        made.stops = SimpleNamespace(are_open=self._ask("recording"), clear=lambda: self._call("clears"))
        made._histories = SimpleNamespace(names=frozenset("h") if self._ask("has-histories") else frozenset())
        made._measured_name_sets = {frozenset("a"), frozenset("ab")}
        made._fast_checks = {("kind 3", frozenset("a")): "kept"} if self._ask("compiled") else {}
        made._measured = frozenset("a")
        made._has_changed = False
        made._readings = {"r": Reading("earlier", 0.0), "s": Reading("earlier", 0.0)}
        made._active_actions = [self.actions[one] for one in under_way]
        made._watches = [
            self._monitor._MonitoredActions(
                (self.actions[one],), self.by_kind[f"kind {one}"], dict(self.values[one])
            )
            for one in under_way
        ]
        for pair in combinations(under_way, 2):
            made._watches += [
                self._monitor._MonitoredActions((self.actions[pair[1]], self.actions[pair[0]]), *watched)
                for watched in self._rules_of("".join(sorted(pair)))
            ]
        return made

    def _call(self, *given: Any) -> None:
        self.calls.append(given)

    def _rules_of(self, pair: str) -> Iterator[tuple[Any, Any]]:
        return (self.joint[pair, rule] for rule in _JOINT_RULES if self._ask(f"joint.{rule}.{pair}"))

    def _rules_for_pair(self, one: Any, other: Any) -> Iterator[tuple[Any, Any]]:
        return self._rules_of("".join(sorted((one.name, other.name))))

    def watched(self) -> dict[str, bool] | None:
        """Tell for each field if its watch exists; None if a watch exists twice or has the wrong contents."""
        found = dict.fromkeys(_WATCH_FIELDS, False)
        for watch in self.monitor._watches:
            names = sorted(one.name for one in watch.actions)
            if len(names) == 1:
                field, rules, values = f"watches.{names[0]}", self.by_kind[f"kind {names[0]}"], None
                right = watch.requested_values == self.values[names[0]]
            else:
                pair = "".join(names)
                rule = next(
                    (r for r in _JOINT_RULES if self.joint.get((pair, r), "?")[0] is watch.rules), "x"
                )
                field, (rules, values) = f"watches.{pair}.{rule}", self.joint[pair, rule]
                right = watch.requested_values is values
            if found[field] or not right or watch.rules is not rules or watch.values is not None:
                return None
            found[field] = True
        for one in self.monitor._active_actions:
            if found[f"lists.{one.name}"]:
                return None
            found[f"lists.{one.name}"] = True
        return found


def _declarations(*more: str) -> tuple[str, ...]:
    fields = " ".join(f"({field} Bool)" for field in (*_WATCH_FIELDS, *more))
    return (
        f"(declare-datatypes ((State 0)) (((wrong) (state {fields}))))",
        *declare_bools("recording", "has-histories", "compiled"),
        *declare_bools(*(f"is-under-way.{one}" for one in _ACTIONS)),
        *declare_bools(*(f"joint.{rule}.{pair}" for pair in _PAIRS for rule in _JOINT_RULES)),
    )


def _exactly_watched(under_way: dict[str, str]) -> str:
    """The watches are those of the actions under way, and of every pair of them that a joint rule is on."""
    return smt_and(
        (
            *(f"(= (watches.{one} after) {under_way[one]})" for one in _ACTIONS),
            *(f"(= (lists.{one} after) {under_way[one]})" for one in _ACTIONS),
            *(
                f"(= (watches.{pair}.{rule} after)"
                f" {smt_and((under_way[pair[0]], under_way[pair[1]], f'joint.{rule}.{pair}'))})"
                for pair in _PAIRS
                for rule in _JOINT_RULES
            ),
        )
    )


def _state(watched: dict[str, bool] | None, *more: bool) -> str:
    return "wrong" if watched is None else smt_apply("state", *map(smt_literal, (*watched.values(), *more)))


def added_obligation(code: ModuleSource) -> TheoremObligation:
    """With joint rules, tracker and compilation put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        under_way = tuple(one for one in _ACTIONS[:2] if ask(f"is-under-way.{one}"))
        site = _Site(monitor, ask, under_way)
        made, plan = site.monitor, object()
        made.add(cast("Any", site.actions["3"]), plan)
        checks = {
            key: "kept" if found == "kept" and key == ("kind 3", frozenset("a")) else found == ("fast", *key)
            for key, found in made._fast_checks.items()
        }
        names = {("kind 3", frozenset("a")), ("kind 3", frozenset("ab"))}
        decided = Reading("decided 3", 0.0)
        earlier = Reading("earlier", 0.0)
        return _state(
            site.watched(),
            site.calls == [("tracks", "number 3", plan)],
            made._has_changed is True and made._measured == frozenset("a"),
            checks.keys() == names and all(checks.values()),
            made._readings == {"r": decided, "s": earlier},
            made._readings == {"r": decided},
            made._readings == {"r": earlier, "s": earlier},
        )

    under_way = {"1": "is-under-way.1", "2": "is-under-way.2", "3": "true"}
    return TheoremObligation(
        "After `RuntimeMonitor.add`, exactly the actions under way are watched, by the rules on their\n"
        "kinds and their own parameters, and every two of them by each joint rule on them, if so it was\n"
        "before. The tracker has the plan; the fast check is chosen anew; histories begin with what was\n"
        "decided on.",
        _declarations("tracks", "changed", "compiles", "adds-readings", "begins-readings", "leaves-readings"),
        smt_and(
            (
                "(not (= after wrong))",
                _exactly_watched(under_way),
                "(tracks after)",
                "(changed after)",
                "(compiles after)",
                "(ite (not has-histories) (leaves-readings after)"
                " (ite (or is-under-way.1 is-under-way.2) (adds-readings after) (begins-readings after)))",
            )
        ),
        tables=(SymbolicFunction("after", "State", execute_symbolically(run, raising="wrong")),),
    )


def removed_obligation(code: ModuleSource) -> TheoremObligation:
    """With the tracker and the records of stops put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        under_way = tuple(one for one in ("2", "1", "3") if one == "1" or ask(f"is-under-way.{one}"))
        site = _Site(monitor, ask, under_way)
        made = site.monitor
        made.remove(cast("Any", site.actions["1"]))
        calls = [one for one in site.calls if one != ("clears",)]
        return _state(
            site.watched(),
            calls == [("forgets", "number 1")],
            made._has_changed is True,
            made._measured == frozenset("a"),
            made._measured == frozenset(),
            ("clears",) in site.calls,
        )

    under_way = {"1": "false", "2": "is-under-way.2", "3": "is-under-way.3"}
    return TheoremObligation(
        "After `RuntimeMonitor.remove`, exactly the other actions under way are watched, alone and in\n"
        "pairs. What was measured has to be measured still, and a stop goes on, as long as any is under\n"
        "way.",
        _declarations("forgets", "changed", "asks-for-all", "asks-for-none", "clears"),
        smt_and(
            (
                "(not (= after wrong))",
                _exactly_watched(under_way),
                "(forgets after)",
                "(changed after)",
                "(ite (or is-under-way.2 is-under-way.3) (and (asks-for-all after) (not (clears after)))"
                " (and (asks-for-none after) (= (clears after) recording)))",
            )
        ),
        tables=(SymbolicFunction("after", "State", execute_symbolically(run, raising="wrong")),),
    )


_SETS: Final = {"a": frozenset("a"), "ab": frozenset("ab")}


def fast_check_obligation(code: ModuleSource) -> TheoremObligation:
    """With compiled checks and the values of the decision put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        decided: list[tuple[str, object]] = []

        def check(kind: str, names: frozenset[str]) -> Any:
            def decide(values: object) -> None:
                decided.append((kind, values))
                if ask("a-value-is-missing"):
                    raise KeyError

            return SimpleNamespace(kind=kind, names=names, decide=decide)

        made = object.__new__(monitor.RuntimeMonitor)
        requested, complete = object(), object()
        number = 0 if ask("watches-none") else 1 if ask("watches-one") else 2
        watch = SimpleNamespace(
            actions=(SimpleNamespace(action=SimpleNamespace(kind="move")),),
            requested_values=requested,
            rules=SimpleNamespace(reads=("a", "b") if ask("reads-b") else ("a",)),
        )
        made._watches = [watch, SimpleNamespace(actions=())][:number] if number else []
        made._values = lambda of: complete if of is watch else None
        made._measured = frozenset("ab") if ask("measured-b") else frozenset("a")
        names = _SETS["ab"] if ask("measures-b") else _SETS["a"]
        known = [*(frozenset((f"{n}",)) for n in range(6)), _SETS["a"]]
        if ask("is-known") or names == _SETS["a"]:
            known.append(_SETS["ab"])
        elif ask("is-full"):
            known.append(frozenset("c"))
        made._measured_name_sets = set(known)
        made._fast_checks = {
            (kind, one): check(kind, one)
            for kind in ("move", "grip")
            for one in _SETS.values()
            if one in known and ask(f"has-check.{kind}")
        }
        found = made._fast_check_for(dict.fromkeys(names))
        remembered = names in made._measured_name_sets
        is_small = len(made._measured_name_sets) <= monitor._MAX_NAME_SETS
        if not remembered or not is_small:
            return "wrong"
        if found is None:
            return "one-by-one"
        if (found.kind, found.names) != ("move", names) or made._measured != names or len(decided) != 1:
            return "wrong"
        return (
            "fast-requested"
            if decided == [("move", requested)]
            else ("fast-complete" if decided == [("move", complete)] else "wrong")
        )

    known = "(or is-known (not measures-b))"
    is_fast = (
        "(and (not watches-none) watches-one (=> measured-b measures-b) (not a-value-is-missing)"
        f" has-check.move {known})"
    )
    return TheoremObligation(
        "`RuntimeMonitor._fast_check_for` returns a check only where exactly one action is watched, and\n"
        "all that the tick before measured is measured: the check of its kind and of these variables,\n"
        "which has just been given the parameters, and the state of the decision unless all that rules\n"
        "read is measured. It keeps a bounded number of checks.",
        (
            "(declare-datatypes ((Check 0)) (((one-by-one) (fast-requested) (fast-complete) (wrong))))",
            *declare_bools("watches-none", "watches-one", "reads-b", "measured-b", "measures-b", "is-known"),
            *declare_bools("is-full", "a-value-is-missing", "has-check.move", "has-check.grip"),
        ),
        f"(= found (ite {is_fast} (ite (=> reads-b measures-b) fast-requested fast-complete) one-by-one))",
        tables=(SymbolicFunction("found", "Check", execute_symbolically(run, raising="wrong")),),
    )
