from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.agent.instructions.named_task import named_tasks
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH, Unit
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, SPAN


def test_a_routed_task_is_written_as_module_and_task() -> None:
    assert str(RoutedTask("dumpling", MAKE_DUMPLINGS)) == "dumpling.make_dumplings"


CENTIMETRE = Unit("cm", Fraction(1, 100), LENGTH)


def test_a_task_with_arguments_is_written_formally_and_as_an_instruction() -> None:
    length = Declared(
        t.Variable("m.depth", RealType(LENGTH), t.VariableRole.STATE),
        SPAN,
        CENTIMETRE,
        (Fraction(0), Fraction(1)),
    )
    quick = Declared(t.Variable("m.quick", BOOL, t.VariableRole.STATE), SPAN)
    parameters = {"depth": TaskParameter("depth", length), "quick": TaskParameter("quick", quick)}
    task = replace(MAKE_DUMPLINGS, parameters=parameters)
    routed = RoutedTask("m", task, {"depth": Fraction(5, 100), "quick": True})
    assert routed.formal_text == "m.make_dumplings(depth = 5 cm, quick = true)"
    assert routed.instruction == "m.make_dumplings depth=5cm quick=true"
    assert routed.variables == {"m.depth": Fraction(5, 100), "m.quick": True}
    assert routed.task_at_start.initial["m.quick"] is True
    (again,) = named_tasks(routed.instruction, [RoutedTask("m", task)])
    assert again == routed


def test_a_task_covers_those_with_every_argument_that_it_has() -> None:
    every, some, other = (RoutedTask("m", MAKE_DUMPLINGS, one) for one in ({}, {"to": "a"}, {"to": "b"}))
    assert every.covers(some)
    assert not some.covers(every)
    assert not some.covers(other)
    assert not every.covers(RoutedTask("n", MAKE_DUMPLINGS))
