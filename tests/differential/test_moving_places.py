"""Closed loop, compositions and planners against a robot on a line, whose places are enumerated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.planning.classical import find_classical_plan
from aeros.spec.closed_loop.invocation import Invocation
from aeros.spec.consequences.consequences import with_consequences
from aeros.spec.expr import terms as t
from aeros.spec.flow.symbolic_paths import explore_paths
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.step_graph import Seq
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.plan_check import find_step_problems
from aeros.spec.planning.shortest import shortest_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.differential.moving_places import NAMES, World, values_of, worlds
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import SPAN, state

Standing = tuple[Fraction, dict[str, bool]]


def test_placeholder() -> None:
    assert find_classical_plan is not None
