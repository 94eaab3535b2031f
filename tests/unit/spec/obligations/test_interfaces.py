"""Interfaces of capabilities: alternatives fit exactly where every value does, and keep their promises."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, BoolType, RealType, Type
from aeros.spec.expr.units import FORCE, NUMBER
from aeros.spec.flow import symbolic_paths
from aeros.spec.model.ecm import CapabilityInterface, Ecm
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.interfaces import interface_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.corpus.test_corpus import CORPUS
from tests.hypothesis_profiles import examples
from tests.reports_in_full import claim_lines, compare_with_file


def _loaded(folder: str) -> Ecm:
    found = load_ecm(CORPUS / folder, SITE, Diagnostics())
    assert found is not None
    return found.ecm


_SITE = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
assert _SITE is not None
SITE: Site = _SITE
ECM = _loaded("accepted/always_slow")
HELPER = _loaded("accepted/capability_with_an_interface/helper")
SKILL = next(iter(ECM.skills.values()))
GRID = [Fraction(value) for value in range(5)]


def declared(
    name: str, type_: Type, bounds: tuple[Fraction, Fraction] | None, default: object = None
) -> Declared:
    variable = t.Variable(name, type_, t.VariableRole.INPUT)
    return Declared(variable, ECM.span, range=bounds, default_value=default)


def verdicts(ecm: Ecm, site: Site = SITE) -> dict[str, Verdict]:
    claims = list(interface_obligations(ecm, site))
    found = {str(one.id): one.verdict for one in claims if not isinstance(one, Obligation)}
    asked = [one for one in claims if isinstance(one, Obligation)]
    return found | {str(one.obligation.id): one.verdict for one in discharge_obligations(asked)}


def fits(interface: CapabilityInterface, inputs: dict[str, Declared], outputs: dict[str, Declared]) -> bool:
    skill = replace(SKILL, inputs=inputs, outputs=outputs, precondition=None)
    module = replace(
        ECM,
        skills={skill.id: skill},
        capabilities={"ability": (skill.id,)},
        interfaces={"ability": interface},
    )
    return verdicts(module)[f"interface/ability/{skill.id}/fits"] is Verdict.PROVED


_BOUNDS = st.tuples(st.sampled_from(GRID), st.sampled_from(GRID)).map(lambda pair: (min(pair), max(pair)))
_TYPES: st.SearchStrategy[RealType | BoolType] = st.sampled_from([RealType(NUMBER), RealType(FORCE), BOOL])


@st.composite
def _variables(draw: st.DrawFn, prefix: str = "") -> dict[str, Declared]:
    found = {}
    for name in draw(st.sets(st.sampled_from("ab"))):
        type_ = draw(_TYPES)
        bounds = None if type_ == BOOL else draw(_BOUNDS)
        default = draw(st.sampled_from([None, Fraction(0)]))
        variable = t.Variable(prefix + name, type_, t.VariableRole.INPUT)
        found[name] = Declared(variable, ECM.span, range=bounds, default_value=default)
    return found


def _values(one: Declared) -> set[tuple[Type, Fraction | bool]]:
    if one.range is None:
        return {(BOOL, False), (BOOL, True)}
    low, high = one.range
    return {(one.variable.type, value) for value in GRID if low <= value <= high}


@examples(300)
@given(_variables("inputs."), _variables(), _variables("inputs."), _variables())
def test_an_alternative_fits_exactly_where_each_value_of_the_interface_does(
    asked: dict[str, Declared],
    promised: dict[str, Declared],
    inputs: dict[str, Declared],
    outputs: dict[str, Declared],
) -> None:
    accepted = all(name in inputs and _values(one) <= _values(inputs[name]) for name, one in asked.items())
    complete = all(one.default_value is not None for name, one in inputs.items() if name not in asked)
    kept = all(name in outputs and _values(outputs[name]) <= _values(one) for name, one in promised.items())
    interface = CapabilityInterface(asked, promised, None, None, ECM.span)
    assert fits(interface, inputs, outputs) == (accepted and complete and kept)


@pytest.mark.parametrize(
    ("folder", "refuted"),
    [
        ("accepted/capability_with_an_interface/helper", set()),
        ("rejected/dependencies/interface_where_it_cannot_start", {"interface/picking_up/fetch/ready"}),
        ("rejected/dependencies/interface_without_its_output", {"interface/picking_up/fetch/fits"}),
        ("rejected/dependencies/interface_without_its_success", {"interface/picking_up/fetch/achieved"}),
        (
            "rejected/dependencies/interface_of_a_sequence_that_undoes",
            {"interface/picking_up/fetch+drop/achieved"},
        ),
    ],
)
def test_each_broken_promise_refutes_its_own_claim(folder: str, refuted: set[str]) -> None:
    judged = verdicts(_loaded(folder))
    assert {name for name, verdict in judged.items() if verdict is not Verdict.PROVED} == refuted
    assert len(judged) > len(refuted)


def test_an_interface_that_nobody_could_use_is_refused() -> None:
    weighing = HELPER.interfaces["weighing"]
    assert weighing.precondition is not None
    never = replace(weighing, precondition=replace(weighing.precondition, term=t.FALSE))
    judged = verdicts(replace(HELPER, interfaces={"weighing": never}))
    assert judged["interface/weighing/can-start"] is Verdict.REFUTED


def test_the_precondition_may_read_the_inputs_and_the_defaults_of_others_count() -> None:
    skill = HELPER.skills["weigh"]
    tries = replace(skill.inputs["tries"], default_value=Fraction(4))
    changed = replace(skill, inputs={**skill.inputs, "tries": tries})
    module = replace(HELPER, skills={**HELPER.skills, "weigh": changed})
    assert verdicts(HELPER)["interface/weighing/weigh/ready"] is Verdict.PROVED
    assert verdicts(module)["interface/weighing/weigh/ready"] is Verdict.REFUTED


def test_a_provider_with_too_many_paths_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbolic_paths, "MAX_SYMBOLIC_STATES", 0)
    judged = verdicts(HELPER)
    assert judged["interface/fetching/fetch/achieved"] is Verdict.REFUTED
    assert judged["interface/weighing/weigh/ready"] is Verdict.PROVED


CHANGES = {
    "as it is": ("", ""),
    "an input of the interface alone": ("range: [2, 8]}}", "range: [2, 8]}, calm: {type: bool}}"),
    "a narrower input": ("range: [1, 10]", "range: [3, 10]"),
    "an input without a default": (", default: 2", ""),
    "an output of another type": ("unit: kg, range", "unit: m, range"),
    "an output of the interface alone": ("{found: {type: real, unit: kg", "{total: {type: real, unit: kg"),
    "a wider output": ("range: [0, 4999]", "range: [0, 5001]"),
    "a start in every state": ("      precondition: not stop_pressed or inputs.force <= 4 N\n", ""),
    "a precondition of the composition": (
        "    do: {if: fetched",
        "    precondition: not stop_pressed\n    do: {if: fetched",
    ),
}


def test_the_claims_about_interfaces_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    manifest = (CORPUS / "accepted/capability_with_an_interface/helper/ecm.yaml").read_text()
    (tmp_path / "skills.py").write_text("def rest(observed, inputs):\n    yield\n")
    lines = []
    for name, (old, new) in CHANGES.items():
        assert old in manifest
        (tmp_path / "ecm.yaml").write_text(manifest.replace(old, new, 1))
        found = load_ecm(tmp_path, SITE, Diagnostics())
        assert found is not None, name
        lines += ["", f"# {name}"]
        lines += [line for one in interface_obligations(found.ecm, SITE) for line in claim_lines(one)]
    monkeypatch.setattr(symbolic_paths, "MAX_SYMBOLIC_STATES", 0)
    lines += ["", "# more paths than are explored"]
    lines += [line for one in interface_obligations(HELPER, SITE) for line in claim_lines(one)]
    compare_with_file(Path(__file__).with_name("data") / "interface_claims.txt", "\n".join(lines[1:]) + "\n")


@pytest.mark.parametrize(
    ("promise", "verdict"), [("not table_dull", Verdict.PROVED), ("table_dull", Verdict.REFUTED)]
)
def test_a_promise_about_a_defined_predicate_follows_from_what_defines_it(
    tmp_path: Path, promise: str, verdict: Verdict
) -> None:
    manifest = (CORPUS / "accepted/predicate_by_definition/ecm.yaml").read_text()
    interface = f"interface: {{achieves: {promise}}}, provided_by: [tidy]}}"
    (tmp_path / "ecm.yaml").write_text(manifest.replace("provided_by: [tidy]}", interface))
    found = load_ecm(tmp_path, SITE, Diagnostics())
    assert found is not None
    judged = verdicts(found.ecm, SITE.with_modules(found.ecm.with_owners))
    assert judged["interface/tidying/tidy/achieved"] is verdict
