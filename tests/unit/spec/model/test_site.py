"""Sites: access of modules, operator overrides, observed variables, and rules by action kind."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import PerceptionPolicy
from aeros.spec.model.policy import Access, OperatorOverride
from aeros.spec.model.rules import Rule
from aeros.spec.model.variables import History
from tests.unit.agent.dumplings import STATE, build, site, state, term

SITE = site()


def test_a_module_has_the_access_of_all_and_its_own_grants() -> None:
    one = replace(
        SITE,
        access=Access(actuators=frozenset(("arm",))),
        grants={"driver": Access(actuators=frozenset(("wheels",)))},
    )
    assert one.access_of("driver").actuators == {"arm", "wheels"}
    assert one.access_of("other").actuators == {"arm"}


def test_overrides_change_the_digest_and_no_overrides_change_nothing() -> None:
    override = OperatorOverride("id", "reason", "kitchen", None, None)
    assert SITE.with_overrides(()) is SITE
    blocked = SITE.with_overrides([override])
    assert blocked.blocks == (*SITE.blocks, override)
    assert blocked.digest != SITE.digest
    assert SITE.with_overrides([replace(override, reason="other")]).digest != blocked.digest


def test_histories_are_observed_like_measured_variables() -> None:
    history = state("previously dumpling_wrapped")
    one = replace(SITE, histories=(History(history, t.Previously(term("dumpling_wrapped"))),))
    assert one.observed_variables == {**STATE, history.name: history}


def test_rules_are_found_by_the_kind_of_action_that_they_govern() -> None:
    first, second = (build(Rule, id=name, terms={name: t.TRUE, "both": t.TRUE}) for name in ("one", "two"))
    site_with_rules = replace(SITE, rules=(first, second))
    assert site_with_rules.rules_for_kind("two") == (second,)
    assert site_with_rules.rules_for_kind("both") == (first, second)
    assert site_with_rules.rules_for_kind("neither") == ()


def test_modules_bring_their_variables_and_take_them_with_them() -> None:
    kettle, pot = (build(Ecm, state={name: state(name)}) for name in ("kettle.hot", "pot.full"))
    assert SITE.with_modules(()) is SITE
    both = SITE.with_modules([kettle, pot])
    assert both.state == {**STATE, "kettle.hot": state("kettle.hot"), "pot.full": state("pot.full")}
    assert both.digest == SITE.digest
    assert both.with_modules([kettle, pot]) is both
    assert both.with_modules([pot]).state == {**STATE, "pot.full": state("pot.full")}
    assert both.module_variables == {"kettle.hot", "pot.full"}
    assert both.rule_variables == STATE


def test_a_sites_own_declaration_of_what_it_shares_stands() -> None:
    shared = replace(state("kettle.hot"), max_age=Fraction(3))
    perception = PerceptionPolicy({"kettle.hot": shared}, frozenset(("kettle.hot",)))
    one = replace(SITE, state={**STATE, "kettle.hot": shared}, perception=perception)
    both = one.with_modules([build(Ecm, state={"kettle.hot": state("kettle.hot")})])
    assert both is one
    assert both.state["kettle.hot"].max_age == 3
    assert both.module_variables == {"kettle.hot"}
    assert "kettle.hot" in both.rule_variables
