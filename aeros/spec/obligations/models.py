"""Claims about the models of a module: the file has the declared interface, and outputs keep their bounds.

They are settled by reading the file and by propagating boxes through it (`backends.network`), without a
formula. A bound that this leaves open is put to Marabou, if it is installed, or is checked at run time if the
manifest says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Final

import aeros
from aeros.distribution import install_command
from aeros.models.interface import ModelFileError, ModelPackage, ValueInterface
from aeros.models.onnx_session import OnnxSession, fitting_shape
from aeros.models.table import Table, read_table
from aeros.spec.backends.network.bound_search import BoundSearch, Point, Target, decide_bound, nearest
from aeros.spec.backends.network.box_propagation import Bounds
from aeros.spec.backends.network.marabou import EXTRA, decide_with_marabou, marabou_version
from aeros.spec.backends.network.onnx_file import OnnxFileError, OnnxGraph, read_onnx
from aeros.spec.backends.network.steps import Network, UnsupportedNetworkError, translate
from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.models import ExactBox, ModelBound, ModuleModel
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.digests import file_digest, model_content

MAX_PROVED_MODEL: Final = 32 * 1024 * 1024
"""Bytes of a model that is evaluated or read by a skill at most."""

_OWN_ENGINE: Final = f"aeros {aeros.__version__}, bounds by intervals"


def model_obligations(ecm: Ecm) -> Iterator[StaticClaim]:
    """Make every claim about the models of a module.

    Args:
        ecm: the module.

    Yields:
        The claims, settled.
    """
    used = ecm.used_models
    for model in ecm.models.values():
        if not model.file or (model.kind == "file" and model.id not in used):
            continue
        problem, subject = _read(ecm, model)
        yield StaticClaim(ClaimForm.MODEL_INTERFACE(model.id), problem)
        for bound in model.bounds if problem is None else ():
            yield _bound_claim(model, bound, subject)


_ROUNDING: Final = Fraction(1, 10**12)
"""Relative distance from the end of a bound that nobody means: a conversion rounds by 2**-53."""


class _Subject:
    """A model that was read: its package, and what bounds are proved of."""

    def __init__(self, package: ModelPackage, read: Table | OnnxGraph | None) -> None:
        self.package = package
        self.read = read


def _read(ecm: Ecm, model: ModuleModel) -> tuple[Diagnostic | None, _Subject]:
    """Read a model's file; return the fault if it lacks the declared interface."""
    package = model.package(b"", checked=False)
    label = SpanLabel(model.file_span)
    try:
        content = model_content(ecm.folder, model.file, MAX_PROVED_MODEL)
        if file_digest(content) != ecm.model_digests.get(model.file):
            changed = f"`{model.file}` changed while it was read"
            return Diagnostic("AE131", changed, label), _Subject(package, None)
        package = model.package(content, checked=False)
        if model.kind == "table":
            table = read_table(model.file, content, package.inputs, package.outputs)
            return _table_fault(model, table, label), _Subject(package, table)
        if model.kind == "onnx":
            graph = read_onnx(content)
            return _graph_fault(model, graph, label), _Subject(package, graph)
    except OSError as failure:
        fault = f"`{model.file}` cannot be used by a skill: {failure.strerror}"
        return Diagnostic("AE131", fault, label), _Subject(package, None)
    except ModelFileError as failure:
        help_ = (failure.cure,) if failure.cure else ()
        return Diagnostic("AE142", f"`{model.id}`: {failure}", label, help=help_), _Subject(package, None)
    except OnnxFileError as failure:
        return Diagnostic("AE142", f"`{model.id}`: {failure}", label), _Subject(package, None)
    return None, _Subject(package, None)


def _table_fault(model: ModuleModel, table: Table, label: SpanLabel) -> Diagnostic | None:
    for name, value in model.outputs.items():
        low, high = (end / value.unit.factor for end in value.range)
        numbers = table.values[name]
        if not low <= Fraction(min(numbers)) <= Fraction(max(numbers)) <= high:
            return Diagnostic(
                "AE142",
                f"`{model.id}`: the column `{name}` holds {min(numbers):g} to {max(numbers):g}, "
                "outside its range",
                SpanLabel(
                    value.span, f"{float(low):g} to {float(high):g} {value.unit.text}".removesuffix(" 1")
                ),
                (label,),
                help=("widen the `range`, or correct the table",),
            )
    return None


def _graph_fault(model: ModuleModel, graph: OnnxGraph, label: SpanLabel) -> Diagnostic | None:
    for what, declared, found in (
        ("input", model.inputs, graph.inputs),
        ("output", model.outputs, graph.outputs),
    ):
        if declared.keys() != found.keys():
            names = ", ".join(f"`{name}`" for name in found) or "none"
            return Diagnostic(
                "AE142",
                f"`{model.id}`: the {what}s of `{model.file}` are {names}, not those that are declared",
                label,
                (SpanLabel(model.span),),
                help=(f"name each of them under `{what}s`",),
            )
        for name, value in declared.items():
            shape = found[name]
            dimensions = [one if one is not None else "?" for one in shape.dimensions]
            if not shape.is_number or fitting_shape(dimensions, value.shape) is None:
                listed = ", ".join(map(str, dimensions))
                return Diagnostic(
                    "AE142",
                    f"`{model.id}`: the {what} `{name}` of `{model.file}` has the shape [{listed}]"
                    + ("" if shape.is_number else " and no floating-point numbers"),
                    SpanLabel(value.span, f"declared as {list(value.shape)}"),
                    help=("declare the shape without the batch dimension, and use float32 or float64",),
                )
    return None


def _bound_claim(model: ModuleModel, bound: ModelBound, subject: _Subject) -> StaticClaim:
    claim = ClaimForm.MODEL_BOUND(model.id, bound.id)
    label = SpanLabel(bound.span)
    result, engine, reason = _decide(model, bound, subject)
    if result.is_proved:
        needless = Diagnostic(
            "AE505",
            f"the bound `{bound.id}` of `{model.id}` is proved, so it need not be checked at run time",
            label,
            help=("remove `runtime_checked`",),
            severity=Severity.WARNING,
        )
        return StaticClaim(claim, needless if bound.runtime_checked else None, engine)
    if bound.runtime_checked:
        return StaticClaim(claim, None, engine, runtime_checked_rule=bound.id)
    if result.witness is not None:
        return StaticClaim(claim, _refutation(model, bound, subject, result.witness, label), engine)
    return StaticClaim(
        claim,
        Diagnostic(
            "AE509",
            f"undecided, so refused: {claim}",
            label,
            notes=(reason,),
            help=(
                f"install Marabou, a network verifier: {install_command(EXTRA)}"
                if marabou_version() is None
                else "use a wider bound, a smaller box, or a smaller network",
                "or write `runtime_checked: true`, to check the bound at each call",
            ),
        ),
        engine,
    )


def _decide(model: ModuleModel, bound: ModelBound, subject: _Subject) -> tuple[BoundSearch, str, str]:
    """Decide a bound; return the result, the engine that decided last, and why it is undecided."""
    given = {name: _bounds_in_file(subject.package.inputs[name], box) for name, box in bound.given.items()}
    then = {name: _target_in_file(subject.package.outputs[name], box) for name, box in bound.then.items()}
    if isinstance(subject.read, Table):
        return _decide_table(subject.read, given, then), _OWN_ENGINE, ""
    undecided = BoundSearch(False, None, 0)
    if not isinstance(subject.read, OnnxGraph):
        return undecided, _OWN_ENGINE, "the file was not read"
    try:
        network = translate(subject.read, {name: value.size for name, value in model.inputs.items()})
    except UnsupportedNetworkError as failure:
        return undecided, _OWN_ENGINE, f"`{model.file}` is not understood: {failure}"
    given = {name: _rounded(ends, network) for name, ends in given.items()}
    result = decide_bound(network, given, then)
    reason = f"{result.parts} boxes of inputs were examined, and some were still open"
    version = marabou_version()
    if result.is_proved or result.witness is not None or version is None:
        return result, _OWN_ENGINE, reason
    return decide_with_marabou(network, given, then), version, f"{reason}; {version} did not decide it either"


def _decide_table(table: Table, given: Mapping[str, Bounds], then: Target) -> BoundSearch:
    box = {
        name: (max(lows[0], table.axes[name][0]), min(highs[0], table.axes[name][-1]))
        for name, (lows, highs) in given.items()
    }
    found = table.bounds(box)
    kept = all(ends[0][0] <= found[name][0] and found[name][1] <= ends[0][1] for name, ends in then.items())
    if kept:
        return BoundSearch(True, None, 1)
    # An output is extreme at a corner of a cell or of the box: one of these violates unless it is very near.
    for point in table.corners(box):
        values = table.lookup(point)
        if any(not ends[0][0] <= values[name] <= ends[0][1] for name, ends in then.items()):
            return BoundSearch(False, {name: (value,) for name, value in point.items()}, 1)
    return BoundSearch(False, None, 1)


def _refutation(
    model: ModuleModel, bound: ModelBound, subject: _Subject, witness: Point, label: SpanLabel
) -> Diagnostic:
    inputs = [
        f"{name} = {_shown(tuple(one * value.factor for one in witness[name]))}"
        for name, value in subject.package.inputs.items()
    ]
    found, engine = _replayed(subject, witness)
    outputs = [
        f"{name} = {_shown(tuple(one * subject.package.outputs[name].factor for one in found[name]))}, "
        f"outside ({', '.join(f'{float(low):g} to {float(high):g}' for low, high in box)})"
        for name, box in bound.then.items()
        if name in found
    ]
    shown = "\n".join(f"  {line}" for line in (*inputs, *outputs))
    cures = ["widen the bound, or make the box of `given` smaller"]
    if _is_missed_by_rounding(bound, subject, found):
        cures = [
            "only the rounding of a conversion of units is outside: 44 mm is 0.044 m, which no double is; "
            "widen the bound by its last digit"
        ]
    elif isinstance(subject.read, OnnxGraph):
        cures.append("or train the network again")
    return Diagnostic(
        "AE511",
        f"the outputs of `{model.id}` leave the bound `{bound.id}`",
        label,
        notes=(f"for example, in SI units{engine}, with\n{shown}",),
        help=tuple(cures),
    )


def _is_missed_by_rounding(
    bound: ModelBound, subject: _Subject, found: Mapping[str, tuple[float, ...]]
) -> bool:
    """Tell whether every output is inside, or outside by less than people write."""
    return bool(found) and all(
        low - _ROUNDING * abs(low)
        <= one * subject.package.outputs[name].factor
        <= high + _ROUNDING * abs(high)
        for name, box in bound.then.items()
        for one, (low, high) in zip(found[name], box, strict=True)
    )


def _replayed(subject: _Subject, witness: Point) -> tuple[Mapping[str, tuple[float, ...]], str]:
    """Evaluate a witness as a run would; return the outputs in the file's units, and what evaluated them."""
    package = subject.package
    if isinstance(subject.read, Table):
        values = subject.read.lookup({name: one[0] for name, one in witness.items()})
        return {name: (value,) for name, value in values.items()}, ""
    try:
        session = OnnxSession(package.file, package.content, package.inputs, package.outputs)
    except ModelFileError:
        return {}, ""  # the witness violates the bound whatever is rounded: `bound_search.violates`
    return session.evaluate(witness), " and by onnxruntime"


def _bounds_in_file(value: ValueInterface, box: ExactBox) -> Bounds:
    """Return the box of an input as the numbers that a run would make of its ends."""
    ends = [
        (adjacent_doubles(low)[1] / value.factor, adjacent_doubles(high)[0] / value.factor)
        for low, high in box
    ]
    return [low for low, _ in ends], [high for _, high in ends]


def _rounded(ends: Bounds, network: Network) -> Bounds:
    lows, highs = ([nearest(one, is_double=network.is_double) for one in each] for each in ends)
    return lows, highs


def _target_in_file(value: ValueInterface, box: ExactBox) -> tuple[tuple[float, float], ...]:
    """Return the box of an output in the file's units; its products with the factor stay inside of `box`."""
    target = []
    for low, high in box:
        inner_low, inner_high = adjacent_doubles(low)[1], adjacent_doubles(high)[0]
        margin = 2.0**-51
        target.append(
            (
                inner_low / value.factor + margin * abs(inner_low / value.factor) * (value.factor != 1.0),
                inner_high / value.factor - margin * abs(inner_high / value.factor) * (value.factor != 1.0),
            )
        )
    return tuple(target)


def _shown(numbers: tuple[float, ...]) -> str:
    return f"{numbers[0]:.6g}" if len(numbers) == 1 else f"({', '.join(f'{one:.6g}' for one in numbers)})"
