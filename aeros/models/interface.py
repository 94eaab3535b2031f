"""Interface of a model as plain data, which a worker receives with the model's bytes.

Numbers at the interface are SI. A file holds numbers in the unit that the manifest declares, so each value
has the factor between the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Literal

ModelKind = Literal["onnx", "table", "file"]

Box = tuple[tuple[float, float], ...]
"""Least and greatest value of each component, SI."""


@dataclass(frozen=True)
class ValueInterface:
    """One input or output of a model.

    Attributes:
        shape: its dimensions; empty for a number.
        factor: SI value of 1 in the model's file.
        unit: the unit in the model's file, as written.
        lower: least value of each component, SI.
        upper: greatest value of each component, SI.
    """

    shape: tuple[int, ...]
    factor: float
    unit: str
    lower: float
    upper: float

    @property
    def size(self) -> int:
        """The number of its components."""
        return prod(self.shape)


@dataclass(frozen=True)
class CheckedBound:
    """Bound that is checked at each call: if the inputs are in `given`, the outputs must be in `then`.

    Attributes:
        name: its name in the manifest.
        given: a box for each input that is restricted, by name.
        then: a box for each output that is bounded, by name.
    """

    name: str
    given: dict[str, Box]
    then: dict[str, Box]


@dataclass(frozen=True)
class ModelPackage:
    """A model with its certified bytes.

    Attributes:
        name: its name in the module.
        kind: `onnx`, `table` or `file`.
        file: path of its file in the module; the suffix tells the format of a table.
        content: bytes of the file, whose digest was checked.
        inputs: its inputs by name.
        outputs: its outputs by name.
        bounds: bounds that are checked at each call.
    """

    name: str
    kind: ModelKind
    file: str
    content: bytes
    inputs: dict[str, ValueInterface]
    outputs: dict[str, ValueInterface]
    bounds: tuple[CheckedBound, ...] = ()


class ModelFileError(ValueError):
    """The file of a model cannot be used; the message says why.

    Attributes:
        cure: what to do about it, for people; empty if there is no one way.
    """

    def __init__(self, message: str, cure: str = "") -> None:
        super().__init__(message)
        self.cure = cure
