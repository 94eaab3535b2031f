"""Every part of a planned motion is looked at: none may be another type, and no number may be infinite."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from math import inf, nan
from typing import Any

import pytest

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.ports import Ball, Hull, ServoBounds
from tests.unit.runtime.motion.test_trajectory import APART, BODY, FOLDING, POLICY, decided, motion

PLAN = motion(
    joint_paths=(motion(-0.5).joint_paths[0], motion(-0.5).joint_paths[0]),
    body=replace(
        FOLDING,
        dh_rows=((0.0, 0.0, 0.0, 0.0),),
        balls=(BODY.balls[0], Ball("post", 0, (0.4, 0.1, 0.5), 0.0)),
        hulls=(*FOLDING.hulls, Hull("lamp", 0, ((0.0, 0.0, 1.0),), 0.0)),
        exempt_pairs=(("lamp", "post"), ("lamp", "arm")),
    ),
    servo=ServoBounds((0.01,), (0.5,), (2.0,), (50.0,), 0.1, 1.0, 10.0),
)
"""Under feedback, with two balls and three hulls, some of which are points."""


class OtherText(str):
    __slots__ = ()


def changes(part: Any, change: Callable[[Any], Any]) -> Iterator[Any]:
    """Yield copies of a part, each with one change in it; `change` returns None for what it leaves."""
    changed = change(part)
    if changed is not None:
        yield changed
    if is_dataclass(part):
        for field in fields(part):
            for one in changes(getattr(part, field.name), change):
                yield replace(part, **{field.name: one})  # type: ignore[type-var]
    elif isinstance(part, tuple):
        for number, inner in enumerate(part):
            for one in changes(inner, change):
                yield tuple.__new__(type(part), (*part[:number], one, *part[number + 1 :]))


def test_a_motion_of_all_parts_is_allowed() -> None:
    assert decided(PLAN, "slide", APART) == []


@pytest.mark.parametrize(
    ("change", "least"),
    [
        (lambda part: nan if type(part) is float else None, 50),
        (lambda part: inf if type(part) is float else None, 50),
        (lambda part: Fraction(part) if type(part) is float else None, 50),
        (lambda part: [*part] if isinstance(part, tuple) else None, 40),
        (lambda part: tuple.__new__(type(part), part[:-1]) if type(part) in (Ball, Hull) else None, 5),
        (lambda part: tuple(part) if type(part) in (Ball, Hull) else None, 5),
        (lambda part: OtherText(part) if isinstance(part, str) else None, 8),
        (lambda part: bool(part) if type(part) is int else None, 5),
    ],
    ids=[
        "no number",
        "infinite",
        "a fraction",
        "a list",
        "cut short",
        "a plain tuple",
        "another text",
        "a truth value",
    ],
)
def test_a_motion_with_one_part_of_another_form_is_denied(change: Callable[[Any], Any], least: int) -> None:
    plans = [*changes(PLAN, change)]
    assert len(plans) >= least
    assert [plan for plan in plans if decided(plan, "slide", APART) != [("AE760", "slide")]] == []


def test_a_fault_without_a_text_is_named_by_its_type() -> None:
    class Silent:
        def __iter__(self) -> Iterator[Any]:
            raise ValueError

    from tests.unit.runtime.motion.test_reasons_of_motions import texts

    assert texts(motion(joint_paths=Silent())) == ["760 move: the motion is malformed: ValueError"]


def test_a_prismatic_joint_beside_others_is_named_by_its_number() -> None:
    from tests.unit.runtime.motion.test_reasons_of_motions import texts

    rows = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, PRISMATIC))
    two = replace(
        POLICY,
        lowest=POLICY.lowest * 2,
        highest=POLICY.highest * 2,
        joint_limits=tuple(one * 2 for one in POLICY.joint_limits),  # type: ignore[arg-type]
    )
    still = motion(joint_paths=((((0.0, 0.0),) * 4,),), body=replace(BODY, dh_rows=rows))
    assert texts(still, policy=two) == [
        "760 move: the motion is malformed: "
        "joint 2 is prismatic, and the site has joint positions in rad, not in jpos"
    ]
