"""Compiled rules for monitors: checkers of measured values, and the rules on each action kind of a site."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from operator import itemgetter
from typing import Any, Final, NamedTuple

from aeros.runtime.gate.compiled.codegen import FunctionWriter
from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue, DecidableCondition
from aeros.runtime.gate.joint_rules import ActiveAction, JointRules
from aeros.runtime.gate.value_check import Scalars, ValueChecker, value_checkers
from aeros.runtime.gate.violation import RuleViolation
from aeros.spec.backends.compiled import CompiledConditions, compile_conditions
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.types import FamilyType, IntegerType
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared, ranges_of

_MAX_CACHED: Final = 256


class CompiledRuleSet:
    """Rules that are evaluated together.

    Args:
        rules: id, condition and term of each.
        variables: the state variable that each scalar variable belongs to.
        truths: one compiled function of all these conditions; None if each is evaluated alone.

    Attributes:
        reads: the state variables that the rules read.
    """

    def __init__(
        self,
        rules: Iterable[tuple[str, DecidableCondition, t.Term]],
        variables: Mapping[str, str],
        truths: CompiledConditions | None = None,
    ) -> None:
        self._rules = tuple(rules)
        self._at_once: tuple[Callable[[Scalars], tuple[Any, ...]], CompiledConditions] | None = None
        if truths is not None and len(truths.argument_names) > 1:
            self._at_once = itemgetter(*truths.argument_names), truths
        names = frozenset[str]().union(*(condition.names for _, condition, _ in self._rules))
        self.reads = tuple(sorted({variables[name] for name in names if name in variables}))

    def first_violation(self, values: Scalars) -> RuleViolation | str | None:
        """Evaluate the rules.

        Args:
            values: float, bool or str by scalar variable.

        Returns:
            The first rule that does not hold, `input:NAME` of a scalar that is missing, or None.
        """
        if self._at_once is not None:
            values_of, truths = self._at_once
            try:
                if all(truths.evaluate(*values_of(values))):
                    return None
            except KeyError:
                pass  # the loop below finds which, and if another rule comes first
        for rule, condition, term in self._rules:
            if not condition.names <= values.keys():
                return f"input:{min(condition.names - values.keys())}"
            if condition.decide(values) is not ConditionValue.HOLDS:
                return RuleViolation(rule, term, {name: values[name] for name in condition.names})
        return None


class FastTickCheck(NamedTuple):
    """Check of control ticks that all measure the same variables; it outlasts an action.

    Attributes:
        decide: sets the parameters and the state that the action was decided on; raises KeyError if one is
            missing.
        holds: True if every measured value is well-formed and all rules hold; False if not, or in doubt.
    """

    decide: Callable[[Scalars], None]
    holds: Callable[[Mapping[str, Any]], bool]


class MonitorRules:
    """The compiled rules of one site, shared by all monitors under it.

    Attributes:
        forms: the checker of each state variable that the invariants Φ may read.
        unpackers: for each state variable a function from a value to its scalars, or to None if it is
            malformed.
        parameters: for each action kind such a function for each of its parameters.
        by_kind: for each action kind the rules on its actions.
        back_off: the action kind with the rules on backing off from a contact; None if the site names none.
        site: the site.
    """

    def __init__(self, site: Site) -> None:
        self.forms = value_checkers(site.rule_variables)
        self.unpackers = {name: FunctionWriter().build_unpacker(form) for name, form in self.forms.items()}
        self.parameters = {
            name: {
                parameter: FunctionWriter().build_unpacker(form)
                for parameter, form in value_checkers(kind.parameters).items()
            }
            for name, kind in site.kinds.items()
        }
        self._variables = {scalar: name for name, form in self.forms.items() for scalar in form.names}
        self.by_kind = {name: self._compile_kind(site, kind) for name, kind in site.kinds.items()}
        self.back_off = None if site.motion is None else site.motion.back_off
        self._joint = JointRules(site, compiled=True)
        self.site = site
        self._quick: dict[tuple[str, frozenset[str]], Callable[[], FastTickCheck]] = {}

    def rules_for_pair(
        self, action: ActiveAction, active_action: ActiveAction
    ) -> Iterable[tuple[CompiledRuleSet, Scalars]]:
        """List the joint rules on two actions that are under way together.

        Args:
            action: one action.
            active_action: the other.

        Yields:
            Each rule, with the scalars of the parameters that it reads.
        """
        for rule, roles in self._joint.rules_for_pair(action, active_action):
            yield CompiledRuleSet([(rule.id, rule.condition, rule.term)], self._variables), rule.values(roles)

    def fast_check(self, kind: str, measured: frozenset[str]) -> FastTickCheck | None:
        """Make a fast check for one monitor, of ticks that measure exactly these variables.

        Args:
            kind: the action kind under way.
            measured: the names of the measured variables.

        Returns:
            The check; None if the site keeps histories, or if a name is no state variable.
        """
        if self.site.histories or not measured <= self.forms.keys():
            return None
        make_check = self._quick.get((kind, measured))
        if make_check is None:
            if len(self._quick) == _MAX_CACHED:
                self._quick.clear()
            rules = self.site.rules_for_kind(kind)
            declared = (*self.site.rule_variables.values(), *self.site.kinds[kind].parameters.values())
            forms = {name: self.forms[name] for name in sorted(measured)}
            make_check = _TickCheckWriter().build_fast_check(
                [rule.terms[kind] for rule in rules], declared, forms
            )
            self._quick[kind, measured] = make_check
        return make_check()

    def _compile_kind(self, site: Site, kind: ActionKind) -> CompiledRuleSet:
        declared = (*site.rule_variables.values(), *kind.parameters.values())
        terms = {rule.id: rule.terms[kind.name] for rule in site.rules_for_kind(kind.name)}
        rules = [(name, CompiledCondition(term, declared), term) for name, term in terms.items()]
        return CompiledRuleSet(
            rules, self._variables, compile_conditions(terms.values(), ranges_of(declared))
        )


class _TickCheckWriter(FunctionWriter):
    def build_fast_check(
        self, terms: Sequence[t.Term], declared: Sequence[Declared], checkers: Mapping[str, ValueChecker]
    ) -> Callable[[], FastTickCheck]:
        """Write a function that makes a `FastTickCheck`.

        The check remembers, for each variable that rules compute with, the last value and its scalars: if the
        value is the same object as at the previous tick, it is well-formed. Rules that read nothing but
        unchanged values still hold; a flag `still` says so for all rules that read the same variables.
        Variables that rules only compare with bounds are checked anew every tick, because remembering them
        would take longer.
        """
        self.exit_statement = "return False"
        self.names |= {"nothing": object(), "Quick": FastTickCheck}
        self.implied, computed = _split_interval_bounds(terms, checkers.values())
        kept = {
            name: f"last{n}" for n, (name, form) in enumerate(checkers.items()) if computed & {*form.names}
        }
        of_scalar = {scalar: name for name, form in checkers.items() for scalar in form.names}
        reads = [
            frozenset(of_scalar[one] for one in t.variables_of(lower(term)) if one in of_scalar)
            for term in terms
        ]
        alike = [one for one in dict.fromkeys(reads) if one <= kept.keys()]
        still = {one: f"still{number}" for number, one in enumerate(alike)}
        for name, form in checkers.items():
            self.add_line(f"value = measured[{name!r}]")
            if name in kept:
                self._write_value_check(
                    form, kept[name], [flag for one, flag in still.items() if name in one]
                )
            else:
                self.write_unpack(form, "value")
        measured = dict(self.local)
        read = {name for term in terms for name in t.variables_of(lower(term))}
        given = sorted(read - measured.keys())
        for name in given:
            self.local[name] = f"x{len(self.local)}"
        codes = self.condition_codes(terms, declared)
        for one in dict.fromkeys(reads):
            self._decide([code for code, by in zip(codes, reads, strict=True) if by == one], still.get(one))
        self.add_line("return True")
        parameters = [self.local[name] for name in given]
        flags = [*still.values()]
        outlasting = [
            *kept.values(),
            *flags,
            *(measured[one] for name in kept for one in checkers[name].names),
        ]
        source = [
            "def deciding():",
            *(f"  {name} = nothing" for name in [*outlasting, *parameters]),
            "  def decide(values):",
            *([f"    nonlocal {', '.join([*flags, *parameters])}"] if flags or parameters else []),
            *(f"    {flag} = False" for flag in flags),
            *(f"    {self.local[name]} = values[{name!r}]" for name in given),
            "    return None",
            "  def holds(measured):",
            *([f"    nonlocal {', '.join(outlasting)}"] if outlasting else []),
            "    try:",
            f"      if len(measured) != {len(checkers)}: return False",
            *(f"    {line}" for line in self.lines),
            "    except KeyError: return False",
            "  return Quick(decide, holds)",
        ]
        return self.compile_function("deciding", source)

    def _write_value_check(self, checker: ValueChecker, last: str, flags: Sequence[str]) -> None:
        """Add code that unpacks `value` and clears `flags` (rules that still hold), unless it is `last`."""
        self.add_line(f"if value is not {last}:")
        start = len(self.lines)
        self.add_line(f"{last} = nothing")
        if flags:
            self.add_line(" = ".join([*flags, "False"]))
        self.write_unpack(checker, "value")
        self.add_line(f"if type(value) is not list: {last} = value")
        self.indent(start)

    def _decide(self, codes: Sequence[str], flag: str | None) -> None:
        """Add code that returns False unless these conditions hold; skipped if `flag` says that they do."""
        if flag is None:
            self.write_guard(" and ".join(codes))
            return
        self.add_line(f"if not {flag}:")
        start = len(self.lines)
        self.write_guard(" and ".join(codes))
        self.add_line(f"{flag} = True")
        self.indent(start)


def _split_interval_bounds(
    terms: Iterable[t.Term], checkers: Iterable[ValueChecker]
) -> tuple[frozenset[str], frozenset[str]]:
    """Find the reals that `terms` only bound, within their declared range, and all other variables they read.

    If all of `terms` hold, the former are in range. Nothing is computed from them that could go wrong before.
    """
    low: dict[str, Fraction] = {}
    high: dict[str, Fraction] = {}
    others: set[str] = set()
    parts = [lower(term) for term in terms]
    while parts:
        match part := parts.pop():
            case t.And(operands=operands):
                parts += operands
            case t.Compare(
                left=t.Variable(name=name), right=t.Literal(value=Fraction() as bound), op="<" | "<="
            ):
                high[name] = min(bound, high.get(name, bound))
            case t.Compare(
                left=t.Literal(value=Fraction() as bound), right=t.Variable(name=name), op="<" | "<="
            ):
                low[name] = max(bound, low.get(name, bound))
            case t.Compare(
                left=t.Absolute(operand=t.Variable(name=name)),
                right=t.Literal(value=Fraction() as bound),
                op="<" | "<=",
            ):
                low[name] = max(-bound, low.get(name, -bound))
                high[name] = min(bound, high.get(name, bound))
            case _:
                others.update(t.variables_of(part))
    bounded = set()
    for form in checkers:
        least, most = form.declared.range or (None, None)
        if least is None or most is None or _is_whole(form):
            continue
        bounded |= {
            name
            for name in form.names
            if name in low and name in high and least <= low[name] and high[name] <= most
        }
    return frozenset(bounded - others), frozenset(others)


def _is_whole(checker: ValueChecker) -> bool:
    type_ = checker.declared.variable.type
    return isinstance(type_.element if isinstance(type_, FamilyType) else type_, IntegerType)
