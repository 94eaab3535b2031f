"""Sets of compiled rules, explored: the rules of a site that are in them, and their common evaluation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.gate.conditions import ConditionValue
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.monitor.tick_answers import broken_rule, declare_bools

RULES: Final = "aeros.runtime.gate.compiled.rules"

_RULES: Final = {"first": ("a",), "second": ("b", "a"), "third": ("c",)}
_NAMES: Final = ("a", "b", "c")


def evaluation_obligation(code: ModuleSource) -> TheoremObligation:
    """With the conditions put aside; `filter` and the conformance suite are about these."""
    rules = code.module(RULES, RuleViolation=lambda name, term, values: broken_rule(name))

    def run(ask: DecideBranch) -> str:
        values = {name: f"value of {name}" for name in _NAMES if ask(f"has.{name}")}

        def condition(rule: str) -> Any:
            def decide(given: Mapping[str, Any]) -> ConditionValue:
                if given is not values or not values.keys() >= set(_RULES[rule]):
                    raise ValueError(rule)
                if ask(f"{rule}.holds"):
                    return ConditionValue.HOLDS
                return ConditionValue.UNDECIDED if ask(f"{rule}.is-undecided") else ConditionValue.FAILS

            return SimpleNamespace(names=frozenset(_RULES[rule]), decide=decide)

        def evaluate(*given: Any) -> tuple[bool, ...]:
            if given != tuple(values[name] for name in ("c", "a", "b")):
                raise ValueError("values")
            return tuple(ask(f"{rule}.holds") for rule in _RULES)

        truths = SimpleNamespace(argument_names=("c", "a", "b"), evaluate=evaluate)
        made = rules.CompiledRuleSet(
            [(rule, condition(rule), f"term of {rule}") for rule in _RULES],
            {"a": "v", "b": "w", "c": "w", "d": "x"},
            truths if ask("all-at-once") else None,
        )
        if made.reads != ("v", "w"):
            return "wrong"
        found = made.first_violation(values)
        if found is None:
            return "none"
        return f"missing.{found[-1]}" if isinstance(found, str) else f"broken.{found.rule}"

    answer = "none"
    for rule, names in reversed(_RULES.items()):
        answer = f"(ite {rule}.holds {answer} broken.{rule})"
        for name in sorted(names, reverse=True):
            answer = f"(ite has.{name} {answer} missing.{name})"
    answers = [f"missing.{name}" for name in _NAMES] + [f"broken.{rule}" for rule in _RULES]
    return TheoremObligation(
        "`CompiledRuleSet.first_violation` is None exactly where every scalar that a rule reads has a\n"
        "value, and each rule holds of these values; else it names the first that is missing or does not\n"
        "hold.",
        (
            f"(declare-datatypes ((Found 0)) (((none) (wrong) {' '.join(f'({one})' for one in answers)})))",
            *declare_bools("all-at-once", *(f"has.{name}" for name in _NAMES)),
            *declare_bools(*(f"{rule}.{what}" for rule in _RULES for what in ("holds", "is-undecided"))),
        ),
        f"(= found {answer})",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


def _site(ask: DecideBranch) -> Any:
    rules = [
        SimpleNamespace(id=rule, terms={"move": f"{rule} on move", "grip": f"{rule} on grip"})
        for rule in _RULES
        if ask(f"applies.{rule}")
    ]
    kinds = {name: SimpleNamespace(name=name, parameters={"p": f"p of {name}"}) for name in ("move", "grip")}
    return SimpleNamespace(
        rule_variables={"v": "declared v"},
        kinds=kinds,
        rules_for_kind=lambda kind: rules if kind == "move" else [],
        histories=("h",) if ask("has-histories") else (),
        motion=SimpleNamespace(back_off="retreat") if ask("has-motion") else None,
    )


class _Unpackers:
    """Stands for the writer of functions that take values apart."""

    def build_unpacker(self, form: Any) -> str:
        """Name the form."""
        return f"unpacks {form.declared}"


def _set_field(name: str, entries: Iterable[tuple[str, str, str]]) -> list[tuple[str, bool]]:
    entries = list(entries)
    return [
        (f"{name}.{rule}", entries.count((rule, f"{rule} on move", f"{rule} on move")) == 1)
        for rule in _RULES
    ]


def compiled_obligation(code: ModuleSource) -> TheoremObligation:
    """With the compilation of one condition put aside."""
    rules = code.module(RULES)

    def run(ask: DecideBranch) -> str:
        def compile_one(term: str, declared: Iterable[str]) -> str:
            return term if tuple(declared) == ("declared v", "p of move") else "wrong"

        def compile_all(terms: Iterable[str], ranges: str) -> Any:
            return list(terms) if ranges == "ranges" else None

        def checkers(declared: Mapping[str, str]) -> dict[str, Any]:
            return {
                name: SimpleNamespace(names=(f"{name}.x", f"{name}.y"), declared=one)
                for name, one in declared.items()
            }

        def ranges_of(declared: Iterable[str]) -> str:
            return "ranges" if tuple(declared) == ("declared v", "p of move") else ""

        install_stubs(
            rules,
            {
                "CompiledCondition": compile_one,
                "compile_conditions": compile_all,
                "ranges_of": ranges_of,
                "CompiledRuleSet": lambda *given: given,
                "FunctionWriter": _Unpackers,
                "value_checkers": checkers,
                "JointRules": lambda site, compiled: None,
            },
        )
        site = _site(ask)
        made = rules.MonitorRules(site)
        found, variables, truths = made.by_kind["move"]
        fields = dict(_set_field("has", found))
        terms = [term for _, _, term in found]
        applies = len(found) == sum(fields.values()) and made.by_kind["grip"][0] == []
        forms = made.unpackers == {"v": "unpacks declared v"} and made.parameters == {
            kind: {"p": f"unpacks p of {kind}"} for kind in ("move", "grip")
        }
        scalars = {"v.x": "v", "v.y": "v"}
        joint = {
            one: SimpleNamespace(
                id=one, condition=f"{one} c", term=f"{one} t", values=lambda roles, one=one: (one, roles)
            )
            for one in _RULES
        }
        listed = [(joint[one], f"roles of {one}") for one in _RULES if ask(f"applies.{one}")]

        def rules_for_pair(action: str, other: str) -> list[Any]:
            return listed if (action, other) == ("one", "other") else []

        made._joint = SimpleNamespace(rules_for_pair=rules_for_pair)
        pairs = list(made.rules_for_pair("one", "other"))
        expected = [
            (([(one.id, one.condition, one.term)], scalars), (one.id, roles)) for one, roles in listed
        ]
        return smt_apply(
            "compiled",
            *(smt_literal(one) for one in fields.values()),
            smt_literal(applies and truths == terms and variables == scalars),
            smt_literal(pairs == expected),
            smt_literal(forms and made.back_off == ("retreat" if site.motion else None)),
        )

    return TheoremObligation(
        "`MonitorRules` compiles for a kind of action each rule of the site on it, once, its condition\n"
        "and the common function of the same terms; for two actions each joint rule on them, with its\n"
        "roles; and takes the values of each variable and parameter apart by its own form.",
        (
            "(declare-datatypes ((Compiled 0)) (((wrong) (compiled"
            f" {' '.join(f'(has.{rule} Bool)' for rule in _RULES)} (as-one Bool) (of-pairs Bool)"
            " (of-forms Bool)))))",
            *declare_bools("has-histories", "has-motion", *(f"applies.{rule}" for rule in _RULES)),
        ),
        smt_and(
            (
                "(not (= found wrong))",
                *(f"(= (has.{rule} found) applies.{rule})" for rule in _RULES),
                "(as-one found)",
                "(of-pairs found)",
                "(of-forms found)",
            )
        ),
        tables=(SymbolicFunction("found", "Compiled", execute_symbolically(run, raising="wrong")),),
    )


def fast_checks_obligation(code: ModuleSource) -> TheoremObligation:
    """With the writing of the function put aside: see `tick_code`."""
    rules = code.module(RULES)

    def run(ask: DecideBranch) -> str:
        site = _site(ask)

        class Writer:
            def build_fast_check(self, terms: Any, declared: Any, forms: Any) -> Any:
                return lambda: ("made", tuple(terms), tuple(declared), dict(forms))

        install_stubs(rules, {"_TickCheckWriter": Writer})
        made = object.__new__(rules.MonitorRules)
        made.site, made.forms, made._quick = site, {name: f"form of {name}" for name in "abd"}, {}
        names = frozenset("ab") if not ask("measures-undeclared") else frozenset("abc")
        if ask("compiled"):
            made._quick[("move", names)] = lambda: "kept"
        made._quick |= {("grip", names): lambda: "wrong", ("move", frozenset("a")): lambda: "wrong"}
        if ask("is-full"):
            made._quick |= {("move", frozenset((f"{n}",))): lambda: "wrong" for n in range(rules._MAX_CACHED)}
            while len(made._quick) > rules._MAX_CACHED:
                made._quick.popitem()
        found = made.fast_check("move", names)
        if found in (None, "kept"):
            return "none" if found is None else "kept"
        terms = tuple(f"{rule} on move" for rule in _RULES if ask(f"applies.{rule}"))
        forms = {name: f"form of {name}" for name in ("a", "b")}
        right = ("made", terms, ("declared v", "p of move"), forms)
        return "made" if found == right and len(made._quick) <= rules._MAX_CACHED else "wrong"

    return TheoremObligation(
        "`MonitorRules.fast_check` returns None where the site keeps histories, or where a name is no\n"
        "state variable; else a check of each rule of the site on this kind, for exactly these variables.",
        (
            "(declare-datatypes ((Found 0)) (((none) (kept) (made) (wrong))))",
            *declare_bools("has-histories", "has-motion", "measures-undeclared", "compiled", "is-full"),
            *declare_bools(*(f"applies.{rule}" for rule in _RULES)),
        ),
        "(= found (ite (or has-histories measures-undeclared) none (ite compiled kept made)))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )
