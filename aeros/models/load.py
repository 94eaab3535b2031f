"""Loading of models from their certified bytes, and calls whose values are checked on the way in and out.

Runs in workers and in the runtime's own process. It imports no library of an engine before a model needs it;
where files cannot be opened any more, `modules_to_preload` names what must be imported before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from aeros.descriptions import type_name
from aeros.models.interface import Box, ModelFileError, ModelKind, ModelPackage, ValueInterface
from aeros.skill import ModelError

_NUMPY: Final = ("numpy", "numpy.fft", "numpy.linalg", "numpy.polynomial", "numpy.random")

Evaluate = Callable[[Mapping[str, tuple[float, ...]]], Mapping[str, tuple[float, ...]]]
"""Evaluates a model: components of inputs and outputs by name, in the units of the file."""


class ModelBoundError(BaseException):
    """A model's output is outside a bound that is checked at run time, so the skill is halted.

    Not an `Exception`: skill code cannot catch it.
    """


class LoadedModel:
    """A model that is ready to be called; implements `aeros.skill.Model`.

    Attributes:
        content: bytes of the model's file.

    Args:
        package: the model with its certified bytes.

    Raises:
        ModelFileError: the file cannot be used, or lacks what the interface declares.
    """

    def __init__(self, package: ModelPackage) -> None:
        self.content = package.content
        self._package = package
        self._evaluate = _engine(package)

    def run(self, **inputs: Any) -> dict[str, Any]:
        """Implements `aeros.skill.Model.run`.

        Raises:
            ModelError: an input is missing, unknown, of another shape, not finite or out of its range; or an
                output is not finite or out of its range.
            ModelBoundError: an output is outside a bound that is checked at run time.
        """
        package = self._package
        if self._evaluate is None:
            raise ModelError(f"`{package.name}` is a file: read its `content`")
        if inputs.keys() != package.inputs.keys():
            raise ModelError(
                f"`{package.name}` takes {_names(package.inputs)}, and was given {_names(inputs)}"
            )
        given = {
            name: self._checked(
                name, _components(inputs[name], value.shape, f"`{package.name}`: `{name}`"), value
            )
            for name, value in package.inputs.items()
        }
        found = self._evaluate(
            {
                name: tuple(one / package.inputs[name].factor for one in components)
                for name, components in given.items()
            }
        )
        outputs = {
            name: self._checked(name, tuple(one * value.factor for one in found[name]), value)
            for name, value in package.outputs.items()
        }
        self._check_bounds(given, outputs)
        return {name: _shaped(outputs[name], value.shape) for name, value in package.outputs.items()}

    def _checked(self, name: str, components: tuple[float, ...], value: ValueInterface) -> tuple[float, ...]:
        for one in components:
            if not value.lower <= one <= value.upper:  # false for NaN
                raise ModelError(
                    f"`{self._package.name}`: `{name}` is {one:.6g}, outside its range "
                    f"{value.lower:.6g} to {value.upper:.6g} (SI)"
                )
        return components

    def _check_bounds(
        self, given: Mapping[str, tuple[float, ...]], outputs: Mapping[str, tuple[float, ...]]
    ) -> None:
        for bound in self._package.bounds:
            if all(_in_box(given[name], box) for name, box in bound.given.items()):
                for name, box in bound.then.items():
                    if not _in_box(outputs[name], box):
                        raise ModelBoundError(
                            f"`{self._package.name}`: the output `{name}` is "
                            f"({', '.join(f'{one:.6g}' for one in outputs[name])}), outside the bound "
                            f"`{bound.name}`"
                        )


def load_models(packages: Iterable[ModelPackage]) -> dict[str, LoadedModel]:
    """Load models.

    Args:
        packages: the models with their certified bytes.

    Returns:
        The models by name.

    Raises:
        ModelFileError: a file cannot be used.
    """
    return {package.name: LoadedModel(package) for package in packages}


def modules_to_preload(kinds: Iterable[ModelKind]) -> tuple[str, ...]:
    """List the Python modules that a process has to import before it can open no file any more.

    Args:
        kinds: kinds of the models that it is to load.

    Returns:
        Names of modules.
    """
    wanted = set(kinds)
    names: list[str] = []
    if "onnx" in wanted:
        names += [*_NUMPY, "onnxruntime", "aeros.models.onnx_session"]
    if "table" in wanted:
        names.append("aeros.models.table")
    return tuple(names)


def _engine(package: ModelPackage) -> Evaluate | None:
    if package.kind == "onnx":
        from aeros.models.onnx_session import OnnxSession

        return OnnxSession(package.file, package.content, package.inputs, package.outputs).evaluate
    if package.kind == "table":
        from aeros.models.table import read_table

        table = read_table(package.file, package.content, package.inputs, package.outputs)

        def evaluate(inputs: Mapping[str, tuple[float, ...]]) -> Mapping[str, tuple[float, ...]]:
            # Division by a factor may round past the end of an axis, by less than one part in 2**52.
            point = {
                name: min(max(components[0], table.axes[name][0]), table.axes[name][-1])
                for name, components in inputs.items()
            }
            return {name: (value,) for name, value in table.lookup(point).items()}

        return evaluate
    if package.kind != "file":
        raise ModelFileError(f"`{package.name}` is of an unknown kind, `{package.kind}`")
    return None


def _components(value: Any, shape: Sequence[int], what: str) -> tuple[float, ...]:
    """Return the numbers in nested sequences of a shape, the last dimension fastest.

    Raises:
        ModelError: the value has another shape, or holds something other than numbers.
    """
    if not shape:
        if isinstance(value, bool) or not isinstance(value, int | float):
            as_number = getattr(value, "item", None)  # a number of NumPy
            if as_number is None or getattr(value, "shape", None) != ():
                raise ModelError(f"{what} is a `{type_name(value)}` where a number is needed")
            value = as_number()
        return (float(value),)
    if getattr(value, "shape", None) is not None and hasattr(value, "tolist"):  # an array of NumPy
        if value.shape == tuple(shape) and value.dtype.kind in "iuf":
            return tuple(map(float, value.ravel().tolist()))  # the parts of a picture one by one take long
        value = value.tolist()
    if not isinstance(value, list | tuple) or len(value) != shape[0]:
        size = f"of {len(value)}" if isinstance(value, list | tuple) else f"`{type_name(value)}`"
        raise ModelError(f"{what} is a value {size} where {shape[0]} numbers are needed")
    return tuple(one for part in value for one in _components(part, shape[1:], what))


def _shaped(components: tuple[float, ...], shape: Sequence[int]) -> Any:
    if not shape:
        return components[0]
    size = len(components) // shape[0] if shape[0] else 0
    return tuple(_shaped(components[at * size : (at + 1) * size], shape[1:]) for at in range(shape[0]))


def _in_box(components: tuple[float, ...], box: Box) -> bool:
    return all(low <= one <= high for one, (low, high) in zip(components, box, strict=True))


def _names(values: Mapping[str, object]) -> str:
    return ", ".join(f"`{name}`" for name in values) or "nothing"
