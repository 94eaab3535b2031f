"""Errors that one entry under `permissions` cures are one error, with every use marked."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.missing_access import merge_missing_access
from aeros.spec.diagnostics.source import Source

TEXT = Source("ecm.yaml", "abcdefghij")
SCANNER = ("add `scanner` to `permissions.sensors`",)
CAMERA = ("add `camera` to `permissions.sensors`",)
OF_SKILL = ("add it to the skill's `actuators`, or take the action out of its envelope",)


def error(at: int, help_: tuple[str, ...], code: str = "AE405") -> Diagnostic:
    return Diagnostic(code, f"use {at}", SpanLabel(TEXT.span(at, at + 1)), help=help_)


def test_uses_of_one_sensor_are_one_error_at_the_first() -> None:
    first, other, second = error(1, SCANNER), error(2, CAMERA), error(3, SCANNER)
    merged = merge_missing_access([first, other, second, error(3, SCANNER)])
    assert [one.headline for one in merged] == ["use 1", "use 2"]
    assert [(one.span, one.text) for one in merged[0].secondary] == [(TEXT.span(3, 4), "and here")]
    assert merged[1] == other


def test_at_most_five_uses_are_marked() -> None:
    (merged,) = merge_missing_access(error(at, SCANNER) for at in range(8))
    assert [one.span.start for one in merged.secondary] == [1, 2, 3, 4]


def test_errors_with_cures_at_several_places_stay_apart() -> None:
    listed = (error(1, OF_SKILL, "AE402"), error(2, OF_SKILL, "AE402"), error(3, (), "AE407"))
    assert merge_missing_access(listed) == listed


def test_errors_of_two_codes_stay_apart() -> None:
    listed = (error(1, SCANNER), error(2, SCANNER, "AE402"))
    assert merge_missing_access(listed) == listed
