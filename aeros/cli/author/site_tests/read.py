"""Reading of site tests: check the file, report every problem with its place, resolve names and units."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from aeros.cli.author.site_tests.cases import DecisionCase, VerdictCase
from aeros.runtime.gate.decision import Caller
from aeros.runtime.ports import Reading
from aeros.skill import Action
from aeros.spec.declared.decode import decode
from aeros.spec.declared.testing.site_tests import SiteTest, SiteTests, Value
from aeros.spec.diagnostics.codes import CODES, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.expressions import elaborate_constant, elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.scopes import constant_scope
from aeros.spec.expr.types import FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import TIME
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.fields import MappingField, TextField
from aeros.spec.text.yaml_reader import read_yaml

NOW: Final = 1000.0
"""Time of every request, s; values are measured then, or as much earlier as their age says."""

_DECISIONS: Final = ("ALLOW", "ATTENUATE", "DENY")


def parse_site_tests(source: Source) -> SiteTests:
    """Parse a file of site tests.

    Args:
        source: Its text and path.

    Returns:
        The tests as they are declared.

    Raises:
        UserError: The file has problems; it lists all of them.
    """
    diagnostics = Diagnostics()
    node = read_yaml(source, diagnostics)
    tests = None if node is None else decode(node, SiteTests, diagnostics)
    if tests is not None:
        for name, test in tests.tests:
            _check_form(str(name), test, diagnostics)
    if tests is None or diagnostics.has_errors:
        raise UserError(diagnostics)
    return tests


def asks_for_decisions(tests: SiteTests) -> bool:
    """Tell if any test is of a decision, so that the modules are needed.

    Args:
        tests: The tests.

    Returns:
        True if there is one.
    """
    return any(test.expect.value in _DECISIONS for _, test in tests.tests)


def _check_form(name: str, test: SiteTest, diagnostics: Diagnostics) -> None:
    """Report fields that the kind of test lacks, or that only the other kind has."""
    request: dict[str, object] = {"skill": test.skill, "action": test.action}
    module: dict[str, object] = {"verify": test.verify}
    if test.expect.value in _DECISIONS:
        needed, others, kind = request, {**module, "codes": test.codes}, "decision"
    else:
        more: dict[str, object] = {"by": test.by, "becomes": test.becomes.items, "state": test.state.items}
        needed, others, kind = module, {**request, **more}, "verdict"
    for word, value in needed.items():
        if value is None:
            diagnostics.error("AE102", f"`{name}` expects a {kind} and has no `{word}`", test.span)
    for word, value in others.items():
        if value:
            diagnostics.error("AE101", f"`{name}` expects a {kind}, which has no `{word}`", test.span)
    if len(test.becomes) and test.expect.value != "ATTENUATE":
        diagnostics.error("AE101", "only a test that expects `ATTENUATE` has `becomes`", test.span)


class CaseReader:
    """Reader of the tests of one file under a site; reports problems to its diagnostics.

    Args:
        tests: The tests as they are declared.
        folder: Folder that paths are relative to.
        site: The site.
        modules: The modules whose skills may ask, by name.
        diagnostics: Receives the problems.
    """

    def __init__(
        self,
        tests: SiteTests,
        folder: Path,
        site: Site,
        modules: Mapping[str, Ecm],
        diagnostics: Diagnostics,
    ) -> None:
        self._tests = tests
        self._folder = folder
        self._site = site
        self._modules = modules
        self._diagnostics = diagnostics
        self._rules = _rule_names(site)

    def cases(self) -> list[DecisionCase | VerdictCase]:
        """Resolve all tests.

        Returns:
            The tests without faults, in the order of the file.
        """
        state = self._values(self._tests.state, self._site.observed_variables, "a state variable")
        resolved = [
            self._decision(name, test, state)
            if test.expect.value in _DECISIONS
            else self._verdict(name, test)
            for name, test in self._tests.tests
        ]
        return [one for one in resolved if one is not None]

    def _verdict(self, name: TextField, test: SiteTest) -> VerdictCase | None:
        if test.verify is None:
            return None
        module = self._folder / test.verify.value
        if not module.exists():
            self._diagnostics.error("AE130", f"`{module}` does not exist", test.verify.span)
            return None
        for code in test.codes or ():
            resolve_name(code, CODES, "a code of a diagnostic", self._diagnostics)
        codes = None if test.codes is None else frozenset(code.value for code in test.codes)
        return VerdictCase(name.value, name.span, module, Conclusion(test.expect.value), codes)

    def _decision(self, name: TextField, test: SiteTest, shared: Mapping[str, Any]) -> DecisionCase | None:
        if test.skill is None or test.action is None:
            return None
        found = self._skill(test.skill)
        kind = resolve_name(test.action, self._site.kinds, "an action of the site", self._diagnostics)
        if found is None or kind is None:
            return None
        module, skill = found
        what = f"a parameter of `{test.action.value}`"
        parameters = self._values(test.parameters, kind.parameters, what)
        inputs = {one.name.removeprefix("inputs."): one for one in skill.inputs.values()}
        given = self._values(test.inputs, inputs, f"an input of `{skill.id}`")
        own = self._values(test.state, self._site.observed_variables, "a state variable")
        state = {**shared, **own}
        for unmeasured in test.unmeasured:
            resolve_name(unmeasured, state, "a state variable with a value", self._diagnostics)
            state.pop(unmeasured.value, None)
        ages = self._ages(test.ages, state)
        quotas = {quota.id: quota for quota in self._site.quotas}
        for quota, _ in test.usage:
            resolve_name(quota, quotas, "a quota of the site", self._diagnostics)
        for rule in test.by:
            resolve_name(rule, self._rules, "a rule, quota, block or code", self._diagnostics)
        return DecisionCase(
            name.value,
            name.span,
            Caller(module.id, skill.id, given),
            Action(test.action.value, parameters),
            {one: Reading(value, NOW - ages.get(one, 0.0)) for one, value in state.items()},
            NOW,
            dict.fromkeys(quotas, 0) | {quota.value: count.value for quota, count in test.usage},
            test.expect.value,
            tuple(rule.value for rule in test.by),
            self._values(test.becomes, kind.parameters, what),
        )

    def _skill(self, name: TextField) -> tuple[Ecm, Skill] | None:
        skills = {
            f"{module.id}.{skill.id}": (module, skill)
            for module in self._modules.values()
            for skill in module.skills.values()
        }
        return resolve_name(name, skills, "a skill of the modules of this file", self._diagnostics)

    def _ages(self, ages: MappingField[TextField], state: Mapping[str, Any]) -> dict[str, float]:
        found: dict[str, float] = {}
        for name, text in ages:
            resolve_name(name, state, "a state variable with a value", self._diagnostics)
            age = elaborate_quantity(text, TIME, self._diagnostics)
            found[name.value] = 0.0 if age is None else float(age)
        return found

    def _values(
        self, entries: MappingField[Value], declared: Mapping[str, Declared], what: str
    ) -> dict[str, Any]:
        """Evaluate values as the gate gets them, numbers as doubles in SI units."""
        values: dict[str, Any] = {}
        for name, value in entries:
            variable = resolve_name(name, declared, what, self._diagnostics)
            if variable is not None:
                values[name.value] = self._value(name, value, variable.variable.type)
        return values

    def _value(self, name: TextField, value: Value, type_: Type) -> Any:
        element, length = _element(type_)
        scope = constant_scope(self._site)
        if not isinstance(value, tuple) and length is None:
            return _plain(elaborate_constant(value, scope, self._diagnostics, type_), type_)
        if not isinstance(value, tuple) or length is None or len(value) != length:
            needed = "one value" if length is None else f"a list of {length} values"
            self._diagnostics.error("AE112", f"`{name.value}` needs {needed}", name.span)
            return None
        parts = (elaborate_constant(part, scope, self._diagnostics, element) for part in value)
        return tuple(_plain(part, element) for part in parts)


def _element(type_: Type) -> tuple[Type, int | None]:
    """Return the type of the parts of a value and their number; None for a value without parts."""
    if isinstance(type_, VectorType):
        return RealType(type_.dimension), 3
    if isinstance(type_, FamilyType):
        return type_.element, len(type_.index.members)
    return type_, None


def _plain(value: Any, type_: Type) -> Any:
    if isinstance(value, Fraction):
        return int(value) if isinstance(type_, IntegerType) and value.denominator == 1 else float(value)
    return value


def _rule_names(site: Site) -> dict[str, object]:
    """Return the names that a reason of a decision can have."""
    names = [rule.id for rule in site.rules] + [rule.id for rule in site.joint_rules]
    names += [one.id for one in site.quotas] + [one.id for one in site.blocks]
    return {**dict.fromkeys(names), **{code: one for code, one in CODES.items() if one.group == "decision"}}
