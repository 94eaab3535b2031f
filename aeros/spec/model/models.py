"""Resolved models of a module: interface and bounds, exact and in SI.

Only `elaborate` builds them; obligations and the runtime read them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import prod

from aeros.models.interface import CheckedBound, ModelKind, ModelPackage, ValueInterface
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.units import Unit

ExactBox = tuple[tuple[Fraction, Fraction], ...]
"""Least and greatest value of each component, SI."""


@dataclass(frozen=True)
class ModelValue:
    """Input or output of a model.

    Attributes:
        name: its name.
        shape: its dimensions; empty for a number.
        unit: unit of the numbers in the file.
        range: least and greatest value of each component, SI.
        span: place in the manifest.
    """

    name: str
    shape: tuple[int, ...]
    unit: Unit
    range: tuple[Fraction, Fraction]
    span: SourceSpan

    @property
    def size(self) -> int:
        """The number of its components."""
        return prod(self.shape)


@dataclass(frozen=True)
class ModelBound:
    """Claim that every input in `given` has outputs in `then`.

    Attributes:
        id: name of the bound in its model.
        given: a box for every input, by name.
        then: a box for each output that is bounded, by name.
        runtime_checked: True if it may be checked at each call where it cannot be proved.
        span: place in the manifest.
    """

    id: str
    given: Mapping[str, ExactBox]
    then: Mapping[str, ExactBox]
    runtime_checked: bool
    span: SourceSpan


@dataclass(frozen=True)
class ModuleModel:
    """Model of a module.

    Attributes:
        id: name of the model in its module.
        kind: `onnx`, `table` or `file`.
        file: path of its file in the module; empty for one without a file, which no skill can use.
        inputs: its inputs by name.
        outputs: its outputs by name.
        bounds: bounds of its outputs.
        span: place of its name.
        file_span: place of its file.
    """

    id: str
    kind: ModelKind
    file: str
    inputs: Mapping[str, ModelValue]
    outputs: Mapping[str, ModelValue]
    bounds: tuple[ModelBound, ...]
    span: SourceSpan
    file_span: SourceSpan

    def package(self, content: bytes, checked: bool = True) -> ModelPackage:
        """Pack the model for the process that evaluates it.

        Args:
            content: bytes of its file, whose digest was checked.
            checked: True to have the bounds that are left to run time checked at each call.

        Returns:
            The model as plain data, numbers in SI.
        """
        bounds = tuple(
            CheckedBound(
                one.id,
                {name: _doubles(box) for name, box in one.given.items()},
                {name: _doubles(box) for name, box in one.then.items()},
            )
            for one in self.bounds
            if one.runtime_checked and checked
        )
        return ModelPackage(
            self.id,
            self.kind,
            self.file,
            content,
            {name: _interface(value) for name, value in self.inputs.items()},
            {name: _interface(value) for name, value in self.outputs.items()},
            bounds,
        )


def _interface(value: ModelValue) -> ValueInterface:
    lower, upper = _inner_doubles(value.range)
    return ValueInterface(value.shape, float(value.unit.factor), value.unit.text, lower, upper)


def _doubles(box: ExactBox) -> tuple[tuple[float, float], ...]:
    return tuple(map(_inner_doubles, box))


def _inner_doubles(ends: tuple[Fraction, Fraction]) -> tuple[float, float]:
    """Return the least and the greatest double between two ends."""
    return adjacent_doubles(ends[0])[1], adjacent_doubles(ends[1])[0]
