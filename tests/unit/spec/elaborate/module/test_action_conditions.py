"""Conditions on actions in envelopes and permissions."""

from __future__ import annotations

from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from tests.unit.spec.faults import CORPUS, TABLE, messages_of_module


def test_a_condition_keeps_its_text_and_the_parts_that_are_explained() -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    loaded = load_ecm(CORPUS / "accepted" / "hold_at_the_edge", site, Diagnostics())
    assert loaded is not None
    (skill,) = (one for one in loaded.ecm.skills.values() if one.hold_condition is not None)
    hold = skill.hold_condition
    assert hold is not None
    assert hold.text == "dirt <= 50 % and not person_near"
    assert [part.span.text for part in hold.conjuncts] == ["dirt <= 50 %", "not person_near"]


def test_an_unknown_action_kind_of_an_envelope_is_reported(tmp_path: Path) -> None:
    (message,) = messages_of_module(tmp_path, ("wait: duration <= 10 s", "weight: duration <= 10 s"))
    assert "`weight` is neither an action kind of this site nor a need" in message


def test_a_permission_may_not_read_inputs(tmp_path: Path) -> None:
    (message,) = messages_of_module(tmp_path, ("wait: true", "wait: duration <= inputs.pace"))
    assert "there is no input `pace`" in message
