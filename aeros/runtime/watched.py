"""What is watched of actions under one site, compiled: forms of what is measured, and rules on each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from operator import itemgetter
from typing import Any

from aeros.runtime.beside import Begun, JointRules
from aeros.runtime.conditions import CompiledCondition, Condition, Truth
from aeros.runtime.form import Form, Scalars, forms_of
from aeros.runtime.writing import Writer
from aeros.spec.backends.closure import Truths, compile_truths
from aeros.spec.model import ActionKind, Site, ranges_of


class Rules:
    """Rules that are decided together.

    truths: the same conditions as one function, where there is one.
    reads: the state variables that they read.
    """

    def __init__(
        self,
        rules: Iterable[tuple[str, Condition]],
        variables: Mapping[str, str],
        truths: Truths | None = None,
    ) -> None:
        self._rules = tuple(rules)
        self._truths = truths if truths is not None and len(truths.read) > 1 else None
        self._values = itemgetter(*self._truths.read) if self._truths is not None else None
        names = frozenset[str]().union(*(condition.names for _, condition in self._rules))
        self.reads = tuple(sorted({variables[name] for name in names if name in variables}))

    def broken(self, values: Scalars) -> str | None:
        """The id of the first that does not hold, or `input:NAME` of what it lacks."""
        if self._truths is not None and self._values is not None:
            try:
                if all(self._truths.at(*self._values(values))):
                    return None
            except KeyError:
                pass  # below it is found which, and whether another rule comes first
        for rule, condition in self._rules:
            if not condition.names <= values.keys():
                return f"input:{min(condition.names - values.keys())}"
            if condition.decide(values) is not Truth.HOLDS:
                return rule
        return None


class Watched:
    """Of one site, for as many monitors as there are runs under it.

    forms: of each state variable.
    taking: for each state variable, its scalars from a value, or None of a value without its form.
    parameters: for each action kind, the same of its parameters.
    """

    def __init__(self, site: Site) -> None:
        self.forms = forms_of(site.observed)
        self.taking = {name: _Writer().taking(form) for name, form in self.forms.items()}
        self.parameters = {
            name: {one: _Writer().taking(form) for one, form in forms_of(kind.parameters).items()}
            for name, kind in site.kinds.items()
        }
        self._variables = {scalar: name for name, form in self.forms.items() for scalar in form.names}
        self._rules = {name: self._of_kind(site, kind) for name, kind in site.kinds.items()}
        self._joint = JointRules(site, compiled=True)

    def of(self, kind: str) -> Rules:
        """The rules on actions of a kind."""
        return self._rules[kind]

    def of_both(self, one: Begun, other: Begun) -> Iterable[tuple[Rules, Scalars]]:
        """The rules on two actions together, each with the parameters that it reads."""
        for rule, roles in self._joint.of(one, other):
            yield Rules([(rule.id, rule.condition)], self._variables), rule.values(roles)

    def _of_kind(self, site: Site, kind: ActionKind) -> Rules:
        declared = (*site.observed.values(), *kind.parameters.values())
        terms = {rule.id: rule.terms[kind.name] for rule in site.rules_on(kind.name)}
        rules = [(name, CompiledCondition(term, declared)) for name, term in terms.items()]
        return Rules(rules, self._variables, compile_truths(terms.values(), ranges_of(declared)))


class _Writer(Writer):
    def taking(self, form: Form) -> Callable[[Any], Scalars | None]:
        """A function that takes a value apart as `form` does, and gives None where that finds a fault."""
        self.take(form, "value")
        scalars = ", ".join(f"{name!r}: {self.local[name]}" for name in form.names)
        self.line(f"return {{{scalars}}}")
        return self.function("taking", ["def taking(value):", *self.lines])
