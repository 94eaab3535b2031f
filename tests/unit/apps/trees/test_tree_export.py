"""Compositions as XML for Groot2: tries, handlers, ports and conditions."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.apps.trees import tree_export
from aeros.apps.trees.tree_export import UnexportableError, export_tree
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, OutputReference, Part, Step
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
)
from tests.unit.agent.dumplings import FORCE, SPAN, outcome, skill, term

PRESS = skill("press", outcome("pressed", {}), inputs={"force": FORCE})
SKILLS = {
    one.id: one for one in (PRESS, skill("look", outcome("seen", {})), skill("rest", outcome("rested", {})))
}
ECM: Any = SimpleNamespace(callable_skills=SKILLS)
NEAR = "wrapper_aligned"


def step(name: str, **more: Any) -> Step:
    return replace(Step(name, name, {}, {}, 0, None, None, SPAN), **more)


def written(body: Part, **handlers: Step) -> str:
    """The exported tree, as nested names."""
    text = export_tree(ECM, Composition("c", t.TRUE, None, body, handlers, SPAN))
    tree = ET.fromstring(text).find("BehaviorTree")  # noqa: S314 - our own output
    assert tree is not None
    return _names(tree[0])


def _names(element: ET.Element) -> str:
    names = ("expression", "num_attempts", "msec", "name")
    own = next((found for name in names if (found := element.get(name))), "")
    inner = " ".join(_names(one) for one in element)
    return f"{element.tag}{f'[{own}]' if own else ''}" + (f"({inner})" if inner else "")


def test_each_part_is_a_node() -> None:
    check: Part = If(term(NEAR), NEAR, Seq(()), FailingPart(NEAR, SPAN), SPAN)
    assert written(Seq((step("look"), check))) == ("Sequence(Action[look] Condition[wrapper_aligned])")
    assert written(Fallback((step("look"), Seq(())), SPAN)) == "ForceSuccess(Action[look])"
    assert written(Fallback((step("look"), step("rest")), SPAN)) == "Fallback(Action[look] Action[rest])"
    assert written(RetriedPart(step("look"), 2, SPAN)) == "RetryUntilSuccessful[3](Action[look])"
    assert written(Par((step("look"), step("rest")), SPAN)) == "Parallel(Action[look] Action[rest])"
    held = HeldPart(step("look"), SPAN, True, ActionCondition(term(NEAR), NEAR, SPAN))
    # BehaviorTree.CPP reads leaves in no other form there.
    assert written(held) == "ReactiveSequence(StateCondition[wrapper_aligned] look[look])"
    timed = TimedPart(step("look"), SPAN, True, Fraction(3, 2))
    assert written(timed) == "Timeout[1500](Action[look])"
    choice = If(term(NEAR), NEAR, step("look"), Seq(()), SPAN)
    assert written(choice) == "IfThenElse(Condition[wrapper_aligned] Action[look] AlwaysSuccess)"


def test_a_time_of_part_of_a_millisecond_is_refused() -> None:
    with pytest.raises(UnexportableError, match="no whole number of milliseconds"):
        written(TimedPart(step("look"), SPAN, True, Fraction(1, 3000)))


def test_handlers_are_written_out() -> None:
    handlers = {"rest": step("rest")}
    assert written(step("look", retry=1, between_tries="rest"), **handlers) == (
        "Fallback(Action[look] Sequence(Action[rest] Action[look]))"
    )
    assert written(step("look", retry=1, on_failure="rest"), **handlers) == (
        "Fallback(RetryUntilSuccessful[2](Action[look]) ForceFailure(Action[rest]))"
    )


def test_inputs_and_outputs_are_ports() -> None:
    flows = {"force": OutputReference("look", "width", SPAN)}
    body = Seq(
        (
            step("look"),
            step("press", output_references=flows),
            step("press", id="two", inputs={"force": Fraction(2)}),
        )
    )
    text = export_tree(ECM, Composition("c", t.TRUE, None, body, {}, SPAN))
    assert '<Action ID="look" name="look" width="{look.width}" />' in text
    assert 'force="{look.width}"' in text
    assert 'name="two" force="2"' in text


def test_a_capability_is_the_action_that_the_file_declares() -> None:
    body = replace(step("tidying"), choices=("look", "press"))
    text = export_tree(ECM, Composition("c", t.TRUE, None, body, {}, SPAN))
    assert re.findall('<Action ID="(.*?)"', text) == ["tidying", "tidying"]
    assert text.count("_port name=") == 2  # the expression, and the force of `press`


def test_ports_have_any_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        SKILLS, "odd", skill("odd", outcome("seen", {}), inputs=dict.fromkeys(("parent", "tag"), FORCE))
    )
    body = step("odd", inputs={"parent": Fraction(1), "tag": Fraction(2)})
    assert 'parent="1" tag="2"' in export_tree(ECM, Composition("c", t.TRUE, None, body, {}, SPAN))


def test_a_composition_that_no_file_can_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    named = skill("odd", outcome("seen", {}), inputs={"name": FORCE})
    monkeypatch.setitem(SKILLS, "odd", named)
    with pytest.raises(UnexportableError, match="`odd` has the port `name`"):
        written(step("odd"))
    monkeypatch.setattr(tree_export, "MAX_ELEMENTS", 3)
    with pytest.raises(UnexportableError, match="more than 3 elements"):
        written(Seq((step("look"),) * 4))


def test_ids_are_those_that_the_library_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """BehaviorTree.CPP 4.10 refuses IDs with a `.`, and the ID `root`."""
    monkeypatch.setitem(SKILLS, "other.look", skill("other.look", outcome("seen", {})))
    text = export_tree(ECM, Composition("c", t.TRUE, None, step("other.look"), {}, SPAN))
    assert text.count('<Action ID="other-look"') == 2
    with pytest.raises(UnexportableError, match="reserves the name `root`"):
        export_tree(ECM, Composition("root", t.TRUE, None, step("look"), {}, SPAN))
