"""The reference modules, for tests of instructions; read once for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

from aeros.runtime.proving import prove_configuration
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, IntegerType
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from aeros.spec.text.discovery import reference_site_path
from tests.unit.agent.dumplings import SPAN

REPOSITORY = Path(__file__).parents[5]
LISTS = Path(__file__).parent
LETTERS = {
    "make_dumplings": "d",
    "clean_table": "t",
    "fetch_object": "f",
    "inspect_table": "i",
    "serve_table": "s",
}
SIDES = EnumType("test.region", ("whole", "left", "right"))
REGION = TaskParameter(
    "region",
    Declared(t.Variable("clean_table.region", SIDES, t.VariableRole.STATE), SPAN),
    "whole",
    {
        side: (side, f"{side} half", f"{side} side", f"{side} part", f"{side} hand side")
        if side != "whole"
        else (side,)
        for side in SIDES.members
    },
)
COUNT = TaskParameter(
    "count",
    Declared(
        t.Variable("make_dumplings.count", IntegerType(), t.VariableRole.STATE),
        SPAN,
        range=(Fraction(1), Fraction(2)),
    ),
    Fraction(1),
)


@cache
def reference_modules() -> Mapping[str, Ecm]:
    configuration, _ = prove_configuration([REPOSITORY / "ecms"], reference_site_path(), certified=True)
    return configuration.modules


@cache
def parametric_modules() -> Mapping[str, Ecm]:
    """The reference modules, of which tasks without parameters have a region or a count."""
    modules = dict(reference_modules())
    for name, parameter in (("clean_table", REGION), ("make_dumplings", COUNT)):
        task = modules[name].tasks[name]
        if not task.parameters:
            with_one = replace(task, parameters={parameter.name: parameter})
            modules[name] = replace(modules[name], tasks={name: with_one})
    return modules
