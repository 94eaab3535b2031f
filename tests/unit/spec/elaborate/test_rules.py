"""Rules of a site: which actions they govern, and what they may say of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from tests.unit.spec.faults import TABLE, messages_of_site


def test_a_rule_that_governs_no_action_kind_is_refused(tmp_path: Path) -> None:
    (message,) = messages_of_site(tmp_path, ("on: [throw]", "on: []"))
    assert message == "error[AE112] wrong-length: the rule `soft-throw` governs no action kind"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("on: [throw]", "on: [trow]"), "`trow` is not an action kind"),
        (("id: soft-throw", "id: soft-knock"), "the rule `soft-knock` is declared twice"),
        (("id: wipe-rate", "id: brush-lent"), "the rule `brush-lent` is declared twice"),
        (
            ('attenuate: {pace: "min', 'attenuate: {speed: "min'),
            "`speed` is not a real or vector parameter",
        ),
        (("on: {a: sweep, b: spin}", "on: {a: sweep}"), "a joint rule has two roles"),
        (("on: {a: sweep, b: spin}", "on: {a: sweep, slow: spin}"), "`slow` is already a constant"),
    ],
)
def test_a_fault_of_a_rule_is_reported(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    (found,) = messages_of_site(tmp_path, edit)
    assert message in found


def test_a_rule_without_kinds_governs_all_but_the_protective_stop() -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    stop_button = site.rules[0]
    assert stop_button.id == "stop-button"
    assert set(stop_button.terms) == {kind.name for kind in site.kinds.values() if not kind.protective}
