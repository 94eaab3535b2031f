"""Networks in ONNX format, evaluated by onnxruntime in the calling thread: it starts no thread here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from aeros.distribution import install_command
from aeros.models.interface import ModelFileError, ValueInterface

if TYPE_CHECKING:
    import numpy as np

EXTRA: Final = "learned"
"""Extra of AEROS that holds onnxruntime."""

_TYPES: Final = {"tensor(float)": "float32", "tensor(double)": "float64"}


class OnnxSession:
    """A network that is ready to be evaluated. Not thread-safe.

    Args:
        file: name of the file, for messages.
        content: bytes of the ONNX file, without external data.
        inputs: inputs of the model by name.
        outputs: outputs of the model by name.

    Raises:
        ModelFileError: onnxruntime is not installed or refuses the file, or the network's inputs and outputs
            are others than the declared ones.
    """

    def __init__(
        self,
        file: str,
        content: bytes,
        inputs: Mapping[str, ValueInterface],
        outputs: Mapping[str, ValueInterface],
    ) -> None:
        try:
            import numpy
            import onnxruntime
        except ImportError as failure:
            raise ModelFileError(
                f"`{file}` needs onnxruntime, which is not installed: {install_command(EXTRA)}"
            ) from failure
        self._numpy = numpy
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.use_deterministic_compute = True
        options.log_severity_level = 4
        try:
            self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as failure:  # its exceptions have no common class of their own
            raise ModelFileError(f"onnxruntime refuses `{file}`: {str(failure)[:200]}") from failure
        self._feeds: dict[str, tuple[tuple[int, ...], str]] = {}
        for kind, declared, found in (
            ("input", inputs, self._session.get_inputs()),
            ("output", outputs, self._session.get_outputs()),
        ):
            if {one.name for one in found} != set(declared):
                names = ", ".join(f"`{one.name}`" for one in found)
                raise ModelFileError(f"the {kind}s of `{file}` are {names}, not those that are declared")
            for one in found:
                shape = fitting_shape(one.shape, declared[one.name].shape)
                if shape is None or one.type not in _TYPES:
                    raise ModelFileError(
                        f"the {kind} `{one.name}` of `{file}` is a {one.type} of {one.shape}"
                    )
                self._feeds[one.name] = shape, _TYPES[one.type]
        self._inputs, self._outputs = tuple(inputs), tuple(outputs)

    def evaluate(self, inputs: Mapping[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
        """Evaluate the network.

        Args:
            inputs: components of each input by name, in the file's units.

        Returns:
            Components of each output by name, in the file's units.
        """
        feeds: dict[str, np.ndarray] = {}
        for name in self._inputs:
            shape, type_ = self._feeds[name]
            feeds[name] = self._numpy.array(inputs[name], dtype=type_).reshape(shape)
        results = self._session.run(list(self._outputs), feeds)
        return {
            name: tuple(map(float, result.reshape(-1)))
            for name, result in zip(self._outputs, results, strict=True)
        }


def fitting_shape(found: object, declared: tuple[int, ...]) -> tuple[int, ...] | None:
    """Compare the shape in a file with a declared one; the file may have a batch dimension in front.

    Args:
        found: dimensions in the file: a number, or a name or None where it is open.
        declared: dimensions in the manifest.

    Returns:
        The shape of the array for one evaluation; None if the shapes differ.
    """
    if not isinstance(found, (list, tuple)):
        return None
    for shape in (declared, (1, *declared)):
        if len(found) == len(shape) and all(
            size == dimension or (not isinstance(size, int) and dimension == 1)
            for size, dimension in zip(found, shape, strict=True)
        ):
            return shape
    return None
