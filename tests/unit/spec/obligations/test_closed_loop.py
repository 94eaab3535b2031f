"""Each claim about a closed loop, refuted with its exact trace, and proved of a near miss."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop import reachability
from aeros.spec.closed_loop.symbolic import certificate
from aeros.spec.diagnostics.codes import Diagnostics, Severity, SpanLabel
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm, Outcome, PlanningRule, Skill, TaskInvariant
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.reports_in_full import claim_lines, compare_with_section
from tests.unit.agent.dumplings import (
    DUMPLING,
    MAKE_DUMPLINGS,
    PREDICATES,
    SPAN,
    given_input,
    module,
    outcome,
    rule,
    site,
    skill,
    task,
    term,
)

DATA = Path(__file__).with_name("data")
CORPUS = Path(__file__).parents[3] / "corpus"
WRAPPED, COOKED = "dumpling_wrapped", "dumpling_cooked"
CLEAN = dict.fromkeys(PREDICATES, False)


def invariant(text: str) -> TaskInvariant:
    return TaskInvariant("kept", term(text), text, SPAN)


def claims(
    skills: tuple[Skill, ...],
    *rules: PlanningRule,
    goal: str = COOKED,
    initial: dict[str, Any] = CLEAN,
    kept: str | None = None,
) -> dict[str, StaticClaim]:
    pursued = replace(
        task("cook", ("cook",), goal, *rules),
        initial=initial,
        invariants=() if kept is None else (invariant(kept),),
    )
    return settled(module("kitchen", skills, pursued))


_LINES: list[str] = []
"""Lines that the claims of one test report."""


@pytest.fixture(autouse=True)
def compare_reports(request: pytest.FixtureRequest) -> Iterator[None]:
    """Compare what the claims of a test report with the section of a file."""
    _LINES.clear()
    yield
    if _LINES and "hypothesis" not in request.keywords:
        text = "".join(f"{line}\n" for line in _LINES)
        compare_with_section(DATA / "closed_loop_reports.txt", request.node.name, text)


def settled(ecm: Ecm, at: Site | None = None) -> dict[str, StaticClaim]:
    claims = closed_loop_obligations(ecm, at or site())
    listed = [one for one in claims if isinstance(one, StaticClaim)]
    for one in listed:
        _LINES.extend(claim_lines(one))
    return {str(one.id).split("/", 2)[2]: one for one in listed}


def refutation(found: StaticClaim, code: str) -> tuple[str, ...]:
    """The lines of the trace, with each state written as the predicates that are true in it."""
    assert found.verdict is Verdict.REFUTED
    assert found.diagnostic is not None
    assert found.diagnostic.code == code
    first, *lines = found.diagnostic.notes[0].splitlines()
    assert first == "for example:"
    return tuple(map(_true_ones, lines))


def _true_ones(line: str) -> str:
    for word in ("start with ", "then "):
        if line.startswith(word):
            values = line.removeprefix(word).split(", ")
            true = [value.removesuffix(" = true") for value in values if value.endswith("= true")]
            return word + ", ".join(true)
    return line


WRAP = skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("torn", {}, failure=True))
BOIL = skill("boil", outcome("cooked", {COOKED: True}), precondition=WRAPPED)
SPOIL = skill(
    "boil",
    outcome("cooked", {COOKED: True}),
    outcome("burst", {WRAPPED: False, "wrapper_aligned": True}, failure=True),
    precondition=WRAPPED,
)


def test_the_reference_task_is_proved_under_its_assumptions() -> None:
    pursued = replace(MAKE_DUMPLINGS, initial=CLEAN)
    found = settled(replace(DUMPLING, tasks={pursued.id: pursued}))
    assert {name: one.verdict for name, one in found.items()} == dict.fromkeys(
        ("dispatch", "progress", "effective"), Verdict.PROVED
    )


def test_a_step_whose_precondition_a_success_before_it_leaves_unmet() -> None:
    halfway = skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("folded", {"wrapper_aligned": True}))
    rules = (rule(f"{WRAPPED} or wrapper_aligned", "wrap"), rule(COOKED, "boil"))
    found = claims((halfway, BOIL), *rules)
    assert refutation(found["dispatch"], "AE801") == ("start with ", "wrap → folded", "then wrapper_aligned")
    assert claims((WRAP, BOIL), *rules)["dispatch"].verdict is Verdict.PROVED


def test_a_step_that_a_failure_before_it_makes_needless_is_followed_by_the_next() -> None:
    odd = skill(
        "wrap", outcome("wrapped", {WRAPPED: True}), outcome("odd", {"wrapper_aligned": True}, failure=True)
    )
    found = claims((odd, BOIL), rule(f"{WRAPPED} or wrapper_aligned", "wrap"), rule(COOKED, "boil"))
    assert refutation(found["dispatch"], "AE801") == ("start with ", "wrap → odd", "then wrapper_aligned")


def test_a_step_that_comes_next_because_one_was_needless_is_hindered_too() -> None:
    align = skill("align", outcome("aligned", {"wrapper_aligned": True}))
    found = claims(
        (align, WRAP, BOIL),
        rule("not wrapper_aligned", "wrap"),  # only the next plan has this
        rule("wrapper_aligned", "align"),
        rule("wrapper_aligned", "align"),
        rule(COOKED, "boil"),
    )
    trace = refutation(found["dispatch"], "AE801")
    assert trace == ("start with ", "align → aligned", "then wrapper_aligned")


def test_a_precondition_on_inputs_is_decided_with_the_inputs_of_the_rule() -> None:
    force = {"force": given_input("force", Fraction(1, 2), (Fraction(0), Fraction(1)))}
    pressed = skill("press", outcome("done", {COOKED: True}), precondition="inputs.force > 0.4", inputs=force)
    press = rule(COOKED, "press")
    assert claims((pressed,), press)["dispatch"].verdict is Verdict.PROVED
    gently = replace(press, inputs={"force": Fraction(1, 4)})
    assert refutation(claims((pressed,), gently)["dispatch"], "AE801") == ("start with ", "then ")


def test_a_failure_that_leads_nowhere() -> None:
    rules = (rule(f"{WRAPPED} or wrapper_aligned", "wrap"), rule(f"{COOKED} or wrapper_aligned", "boil"))
    found = claims((WRAP, SPOIL), *rules)
    assert refutation(found["progress"], "AE802") == (
        "start with ",
        "wrap → wrapped",
        "boil → burst",
        "then wrapper_aligned",
    )
    diagnostic = found["progress"].diagnostic
    assert diagnostic is not None
    assert diagnostic.notes[1:] == ("there, no rule applies, so the plan is empty",)
    assert claims((WRAP, BOIL), *rules)["progress"].verdict is Verdict.PROVED


def test_a_recovery_leads_out_of_a_dead_end() -> None:
    blocked = skill(
        "boil",
        outcome("cooked", {COOKED: True}),
        outcome("burst", {WRAPPED: False}, failure=True),
        precondition=WRAPPED,
    )
    ready = {**CLEAN, WRAPPED: True}
    alone, helped = rule(COOKED, "boil", 1), rule(COOKED, "boil", 1, "wrap")
    assert refutation(claims((WRAP, blocked), alone, initial=ready)["progress"], "AE802") == (
        f"start with {WRAPPED}",
        "boil → burst",
        "then ",
    )
    assert refutation(claims((WRAP, blocked), helped, initial=ready)["progress"], "AE802") == (
        f"start with {WRAPPED}",
        "boil → burst",
        "wrap → wrapped",
        "boil → burst",
        "then ",
    )
    assert claims((WRAP, blocked), rule(WRAPPED, "wrap"), helped)["progress"].verdict is Verdict.PROVED


@pytest.mark.parametrize(
    ("rules", "why"),
    [
        ((rule(COOKED, "boil", 1, "boil"),), "there, a failure leads back to itself"),
        (
            (rule(WRAPPED, "wrap", 1, "boil"), rule(COOKED, "boil", 1, "wrap")),
            "there, a failure leads back to itself",
        ),
        (
            (rule(WRAPPED, "wrap", 1, "press"), rule(COOKED, "boil")),
            "there, `press` runs with default inputs after a failure, but an input has no default",
        ),
        (
            (rule(WRAPPED, "wrap", 4), rule(COOKED, "boil")),
            "there, a step has more than the 3 retries that this site allows",
        ),
        ((rule(WRAPPED, "wrap"),) * 101, "there, the plan has 101 steps; at most 100 are allowed"),
    ],
)
def test_a_plan_that_the_agent_rejects_leads_nowhere(rules: tuple[PlanningRule, ...], why: str) -> None:
    needy = {"force": given_input("force", None, (Fraction(0), Fraction(1)))}
    skills = (WRAP, BOIL, skill("press", outcome("pressed", {}), inputs=needy))
    found = claims(skills, *rules)["progress"]
    assert refutation(found, "AE802") == ("start with ", "then ")
    assert found.diagnostic is not None
    assert found.diagnostic.notes[1] == why


def test_an_outcome_that_the_others_leave_no_probability_is_no_way_to_the_goal_but_may_do_harm() -> None:
    boil = skill("boil", Outcome("raw", {}, False, Fraction(1), None), outcome("cooked", {COOKED: True}))
    found = claims((boil,), rule(COOKED, "boil"), kept=f"not {COOKED}")
    assert refutation(found["progress"], "AE802") == ("start with ", "then ")
    assert refutation(found["invariant/kept"], "AE804")[1] == "boil → cooked"


def test_an_invariant_is_refuted_by_the_shortest_way() -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    found = claims((WRAP, SPOIL), *rules, kept="not wrapper_aligned")
    assert refutation(found["invariant/kept"], "AE804") == (
        "start with ",
        "wrap → wrapped",
        "boil → burst",
        "then wrapper_aligned",
    )
    assert (
        claims((WRAP, BOIL), *rules, kept="not wrapper_aligned")["invariant/kept"].verdict is Verdict.PROVED
    )


def test_an_invariant_holds_where_the_goal_is_reached_too() -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    found = claims((WRAP, BOIL), *rules, kept=f"not {COOKED}")
    assert refutation(found["invariant/kept"], "AE804") == (
        "start with ",
        "wrap → wrapped",
        "boil → cooked",
        f"then {COOKED}, {WRAPPED}",
    )
    assert (
        claims((WRAP, BOIL), *rules, kept=f"{WRAPPED} or not {COOKED}")["invariant/kept"].diagnostic is None
    )


def test_an_invariant_holds_at_every_start_that_initial_leaves_open() -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    kept = f"{WRAPPED} or not {COOKED}"
    found = claims((WRAP, BOIL), *rules, initial={WRAPPED: False}, kept=kept)
    assert refutation(found["invariant/kept"], "AE804") == (f"start with {COOKED}", f"then {COOKED}")


def test_a_task_over_a_quantity_is_analysed_by_the_numbers_that_it_is_compared_with() -> None:
    filled = skill("fill", outcome("filled", {"fill_level": Fraction(1)}))
    spilt = skill("fill", outcome("filled", {"fill_level": Fraction(3, 10)}))
    rules = rule("fill_level > 0.5", "fill")
    start = {"fill_level": Fraction(0)}
    assert claims((filled,), rules, goal="fill_level > 0.5", initial=start)["progress"].diagnostic is None
    found = claims((spilt,), rules, goal="fill_level > 0.5", initial=start)["progress"]
    assert refutation(found, "AE802") == ("start with ", "then ")
    assert found.diagnostic is not None
    assert "start with fill_level = 0" in found.diagnostic.notes[0]


def test_a_task_that_compares_quantities_with_each_other_is_undecided_with_its_invariants() -> None:
    rules = rule("joint[j1] > fill_level", "wrap")
    claimed = claims((WRAP,), rules, goal="fill_level > 0.5", kept="not wrapper_aligned")
    assert claimed.keys() == {"analysed"}
    diagnostic = claimed["analysed"].diagnostic
    assert diagnostic is not None
    assert diagnostic.severity is Severity.ERROR
    assert diagnostic.headline.endswith("`fill_level` is compared with `joint[j1]`")
    assert claimed["analysed"].verdict is Verdict.REFUTED


@pytest.mark.parametrize("limit", ["MAX_STARTS", "MAX_NODES"])
def test_states_too_many_to_list_are_analysed_as_sets_with_a_certificate(
    limit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    listed = claims((WRAP, BOIL), *rules, initial={})
    monkeypatch.setattr(reachability, limit, 3)
    by_sets = claims((WRAP, BOIL), *rules, initial={})
    assert by_sets.keys() == listed.keys()
    assert all(one.verdict is listed[name].verdict for name, one in by_sets.items())
    assert all(one.engine.startswith("dd ") for one in by_sets.values())
    pursued = replace(task("cook", ("cook",), COOKED, *rules), initial={})
    every = closed_loop_obligations(module("kitchen", (WRAP, BOIL), pursued), site())
    certified = [one for one in every if isinstance(one, Obligation)]
    assert len(certified) > 5
    first = certified[0]
    assert (first.code, str(first.id)) == ("AE803", "closed-loop/cook/certificate/0")
    assert first.headline == (
        "undecided, so refused: the solver contradicts the analysis of the rules of `cook`: the start"
    )
    assert first.help == ("please report this: it is a fault of AEROS, and not of the module",)
    assert first.primary == SpanLabel(pursued.span)
    assert {one.verdict for one in discharge_obligations(certified)} == {Verdict.PROVED}


def test_a_certificate_that_is_too_large_is_left_out_and_the_claims_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    monkeypatch.setattr(reachability, "MAX_STARTS", 0)
    whole = claims((WRAP, BOIL), *rules, kept=f"{WRAPPED} or not {COOKED}")
    (engine,) = {one.engine for one in whole.values()}
    assert engine == f"dd {version('dd')}"
    monkeypatch.setattr(certificate, "MAX_SIZE", 0)
    found = claims((WRAP, BOIL), *rules, kept=f"{WRAPPED} or not {COOKED}")
    assert found.keys() == whole.keys()
    assert {one.engine for one in found.values()} == {f"{engine}, without a certificate, which is too large"}


def test_a_task_that_starts_where_its_goal_is_reached_proves_nothing_of_its_rules() -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "boil"))
    found = claims((WRAP, BOIL), *rules, initial={**CLEAN, COOKED: True})["effective"].diagnostic
    assert found is not None
    assert (found.code, found.severity) == ("AE805", Severity.ERROR)
    assert claims((WRAP, BOIL), *rules, initial={WRAPPED: False})["effective"].diagnostic is None


def test_a_refuted_dispatch_is_shown_at_the_rule_and_at_the_precondition() -> None:
    (call,) = rules = (rule(COOKED, "boil"),)
    found = claims((BOIL,), *rules)["dispatch"].diagnostic
    assert found is not None
    assert found.headline == "the rules of `cook` call `boil` where its precondition does not hold"
    assert (found.primary, [one.text for one in found.secondary]) == (
        SpanLabel(call.span, "called here"),
        ["does not hold then"],
    )


# A step by a capability.

OTHER = skill(
    "steam", outcome("cooked", {COOKED: True}), outcome("cold", {}, failure=True), precondition=WRAPPED
)


def with_capability(providers: tuple[str, ...], skills: tuple[Skill, ...], *rules: PlanningRule) -> Ecm:
    pursued = replace(task("cook", ("cook",), COOKED, *rules), initial=CLEAN)
    return replace(module("kitchen", skills, pursued), capabilities={"cooking": providers})


def test_a_step_by_a_capability_is_proved_of_each_provider() -> None:
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "cooking", retry=1))
    found = settled(with_capability(("boil", "steam"), (WRAP, BOIL, OTHER), *rules))
    assert {one.verdict for one in found.values()} == {Verdict.PROVED}


def test_a_provider_that_may_not_start_is_named() -> None:
    fry = skill("fry", outcome("cooked", {COOKED: True}), precondition="wrapper_aligned")
    rules = (rule(WRAPPED, "wrap"), rule(COOKED, "cooking"))
    found = settled(with_capability(("boil", "fry"), (WRAP, BOIL, fry), *rules))
    assert refutation(found["dispatch"], "AE801") == ("start with ", "wrap → wrapped", f"then {WRAPPED}")
    assert found["dispatch"].diagnostic is not None
    assert "call `fry`, which provides `cooking`, where" in found["dispatch"].diagnostic.headline
    # The other one leads to the goal; that this one does not start is no dead end.
    assert found["progress"].verdict is Verdict.PROVED


def test_skills_that_provide_a_capability_only_together_are_no_choice() -> None:
    """Choosing to wait every time never cooks, though each state has a way to the goal by the other skill."""
    wait = skill("wait", outcome("waited", {}))
    eager = skill("boil", outcome("cooked", {COOKED: True}))
    found = settled(with_capability(("boil", "wait"), (eager, wait), rule(COOKED, "cooking")))
    assert refutation(found["progress"], "AE802") == ("start with ", "then ")
    assert found["progress"].diagnostic is not None
    assert found["progress"].diagnostic.notes[1:] == (
        "if a step names a capability, the same skill of it may run each time",
    )
    assert (
        settled(with_capability(("boil",), (eager, wait), rule(COOKED, "cooking")))["progress"].diagnostic
        is None
    )


def test_a_further_try_may_be_by_the_provider_that_still_can() -> None:
    """The first breaks its own precondition, so each further try is the other's."""
    once = skill(
        "boil",
        outcome("cooked", {COOKED: True}),
        outcome("burnt", {"wrapper_aligned": True}, failure=True),
        precondition="not wrapper_aligned",
    )
    steam = skill("steam", outcome("cooked", {COOKED: True}), outcome("cold", {}, failure=True))
    rules = (rule("not wrapper_aligned", "turn"), rule(COOKED, "cooking", retry=2))
    turn = skill("turn", outcome("turned", {"wrapper_aligned": False}))
    found = settled(with_capability(("boil", "steam"), (turn, once, steam), *rules))
    assert {one.verdict for one in found.values()} == {Verdict.PROVED}


@given(st.booleans(), st.booleans(), st.booleans())
def test_a_start_is_refused_exactly_where_it_contradicts_a_definition(
    aligned: bool, dough: bool, wrapped: bool
) -> None:
    text = "wrapper_aligned and not dough_on_workspace"
    start = CLEAN | {"wrapper_aligned": aligned, "dough_on_workspace": dough, WRAPPED: wrapped}
    cook = skill("cook", outcome("cooked", {COOKED: True}))
    pursued = replace(task("cook", ("cook",), COOKED, rule(COOKED, "cook")), initial=start)
    definitions = {WRAPPED: Definition(term(text), text, SPAN)}
    found = settled(replace(module("kitchen", (cook,), pursued), definitions=definitions))
    reported = [one.diagnostic for one in found.values() if one.diagnostic is not None]
    assert [one.code for one in reported] == ([] if wrapped is (aligned and not dough) else ["AE806"])
    if reported:
        stated, other = ("true", "false") if wrapped else ("false", "true")
        assert f"`{WRAPPED}` is {stated}; by its definition it is {other}" in reported[0].headline


def reported_codes(folder: Path, case: str, *edits: tuple[str, str]) -> list[str]:
    """Codes of what is reported on a case of the corpus after these edits of its manifest."""
    place = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert place is not None
    manifest = (CORPUS / case / "ecm.yaml").read_text()
    for old, new in edits:
        assert old in manifest
        manifest = manifest.replace(old, new)
    (folder / "ecm.yaml").write_text(manifest)
    found = load_ecm(folder, place, Diagnostics())
    assert found is not None
    claims = settled(found.ecm, place.with_modules(found.ecm.with_owners)).values()
    return [one.diagnostic.code for one in claims if one.diagnostic is not None]


def test_a_start_that_contradicts_a_definition_is_reported_with_every_value_that_it_states(
    tmp_path: Path,
) -> None:
    case = "rejected/closed_loop/start_that_contradicts_a_definition"
    text = "hand.z >= 10 cm and fetched == sponge and dirt < 50 % and not person_near"
    more = ("definition: hand.z >= 10 cm", f"definition: {text}")
    start = ("initial: {", "initial: {fetched: sponge, dirt: 20 %, ")
    assert reported_codes(tmp_path, case, more, start) == ["AE806"]


def test_a_start_that_no_value_of_a_quantity_allows_is_reported_without_values(tmp_path: Path) -> None:
    case = "rejected/closed_loop/start_that_contradicts_a_definition"
    assert reported_codes(tmp_path, case, ("hand.z >= 10 cm", "dirt > 100 %")) == ["AE806"]


def test_a_composition_that_may_not_start_is_named_with_its_precondition(tmp_path: Path) -> None:
    case = "accepted/capability_by_a_sequence_or_a_composition"
    edit = ("and tidy\n    do:", "and tidy\n    precondition: fetched == sponge\n    do:")
    assert reported_codes(tmp_path, case) == []
    assert reported_codes(tmp_path, case, edit) == ["AE801"]
