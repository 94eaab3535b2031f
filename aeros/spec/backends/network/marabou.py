"""Marabou, a verifier of piecewise linear networks: decides bounds that boxes leave open.

Each violation is one query: the steps as linear equations and clips, and an output beyond its bound. Marabou
computes in doubles, with a tolerance of its own, and decides the network in exact arithmetic; so every bound
is made narrower by the network's rounding errors and by `TOLERANCE`.

Source: Wu and others, Marabou 2.0, CAV 2024; NeuralNetworkVerification/Marabou, maraboupy/MarabouCore.
"""

from __future__ import annotations

import importlib
import importlib.util
import multiprocessing
from collections.abc import Iterator, Mapping
from math import copysign, inf
from multiprocessing.connection import Connection
from typing import Any, Final

from aeros.spec.backends.network.bound_search import BoundSearch, Point, Target, nearest, violates
from aeros.spec.backends.network.box_propagation import Bounds, bound_vectors, rounding_errors
from aeros.spec.backends.network.steps import Clip, Join, Linear, Network, Scale, Smooth, Sum
from aeros.spec.backends.package_versions import package_version
from aeros.spec.diagnostics.errors import MisuseError

EXTRA: Final = "learned-proof"
"""Extra of AEROS that holds Marabou."""

TOLERANCE: Final = 1e-6
"""Margin of each bound, relative to the greatest value of its output; Marabou compares with 1e-9."""

MARABOU_SECONDS: Final = 120
"""Limit on the decision of one bound, s."""


def marabou_version() -> str | None:
    """Return the name and version of Marabou, for certificates.

    Returns:
        As `maraboupy 2.0.0`; None if it is not installed.
    """
    if importlib.util.find_spec("maraboupy") is None:
        return None
    return f"maraboupy {package_version('maraboupy', 'maraboupy')}"


def decide_with_marabou(
    network: Network, given: Mapping[str, Bounds], then: Target, seconds: float = MARABOU_SECONDS
) -> BoundSearch:
    """Decide whether every input in a box has its outputs in another.

    Runs in a process of its own, which is killed when it is late: Marabou's own limit on time is not kept
    while it solves a linear program.

    Args:
        network: the network.
        given: bounds of each input, in the network's units.
        then: bounds of outputs, in the network's units.
        seconds: limit on the decision, s.

    Returns:
        The result; neither proved nor refuted where a step is `Smooth`, where Marabou did not decide in
        time, and where its input did not violate the bound when it was evaluated.
    """
    undecided = BoundSearch(False, None, 0)
    if network.has_smooth:
        return undecided
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_decide, args=(theirs, network, given, then), daemon=True)
    process.start()
    theirs.close()
    try:
        return ours.recv() if ours.poll(seconds) else undecided
    except EOFError:
        return undecided  # it crashed
    finally:
        process.kill()
        process.join()


def _decide(answer: Connection, network: Network, given: Mapping[str, Bounds], then: Target) -> None:
    answer.send(_search(network, given, then))


def _search(network: Network, given: Mapping[str, Bounds], then: Target) -> BoundSearch:
    marabou = importlib.import_module("maraboupy.MarabouCore")
    vectors = bound_vectors(network, given)
    errors = rounding_errors(network, vectors)
    queries = 0
    for vector, at, end, margin in _violations(network, vectors, errors, then):
        # Nearly a violation; if there is one, a point that surely violates, whatever is rounded.
        for sought in (end - margin, end + margin):
            queries += 1
            query, first = _query(marabou, network, vectors)
            is_above = copysign(1.0, margin) > 0  # also where the margin is 0
            limit = query.setLowerBound if is_above else query.setUpperBound
            limit(first[vector] + at, sought)
            options = marabou.Options()
            options._verbosity = 0
            status, values, _ = marabou.solve(query, options, "/dev/null")
            if status == "unsat":
                break
            witness = _witness(network, given, values, first) if status == "sat" else None
            if witness is not None and violates(network, witness, then):
                return BoundSearch(False, witness, queries)
        if status != "unsat" or sought != end - margin:
            return BoundSearch(False, None, queries)
    return BoundSearch(True, None, queries)


def _violations(
    network: Network,
    vectors: Mapping[str, Bounds],
    errors: Mapping[str, list[float]],
    then: Target,
) -> Iterator[tuple[str, int, float, float]]:
    """Yield each violation that boxes do not rule out: vector, component, end, and margin.

    The margin has the sign + for a violation above the end, and - for one below, also where it is 0.
    """
    for name, ends in then.items():
        vector = network.outputs[name]
        for at, (lower, upper) in enumerate(ends):
            low, high = vectors[vector][0][at], vectors[vector][1][at]
            margin = errors[vector][at] + TOLERANCE * max(abs(low), abs(high))
            if high > upper:
                yield vector, at, upper, margin
            if low < lower:
                yield vector, at, lower, -margin


def _query(marabou: Any, network: Network, vectors: Mapping[str, Bounds]) -> tuple[Any, dict[str, int]]:
    """Build the query for the whole network: a variable for each component of each vector.

    Raises:
        MisuseError: a step is not piecewise linear.
    """
    first: dict[str, int] = {}
    count = 0
    for name, (lows, _) in vectors.items():
        first[name] = count
        count += len(lows)
    query = marabou.InputQuery()
    query.setNumberOfVariables(count)
    for name, (lows, highs) in vectors.items():
        for at, (low, high) in enumerate(zip(lows, highs, strict=True)):
            query.setLowerBound(first[name] + at, low)
            query.setUpperBound(first[name] + at, high)

    def equate(target: int, terms: list[tuple[float, int]], constant: float) -> None:
        equation = marabou.Equation()
        for factor, variable in terms:
            if factor:
                equation.addAddend(factor, variable)
        equation.addAddend(-1.0, target)
        equation.setScalar(-constant)
        query.addEquation(equation)

    for step in network.steps:
        at = first[step.target]
        match step:
            case Linear(_, source, weights, bias):
                for row, (numbers, offset) in enumerate(zip(weights, bias, strict=True)):
                    equate(at + row, [(one, first[source] + i) for i, one in enumerate(numbers)], offset)
            case Scale(_, source, factors, offsets):
                for i, (factor, offset) in enumerate(zip(factors, offsets, strict=True)):
                    equate(at + i, [(factor, first[source] + i)], offset)
            case Sum(_, one, other, sign):
                for i in range(len(vectors[one][0])):
                    equate(at + i, [(1.0, first[one] + i), (sign, first[other] + i)], 0.0)
            case Join(_, sources):
                for source in sources:
                    for i in range(len(vectors[source][0])):
                        equate(at + i, [(1.0, first[source] + i)], 0.0)
                    at += len(vectors[source][0])
            case Clip(_, source, lower, upper):
                for i in range(len(vectors[source][0])):
                    if (lower, upper) == (0.0, inf):
                        marabou.addReluConstraint(query, first[source] + i, at + i)
                    else:
                        marabou.addClipConstraint(query, first[source] + i, at + i, lower, upper)
            case Smooth():
                raise MisuseError("Marabou is given piecewise linear networks only")
    for mark, names in (
        (query.markInputVariable, network.inputs),
        (query.markOutputVariable, network.outputs.values()),
    ):
        number = 0
        for name in names:
            for at in range(len(vectors[name][0])):
                mark(first[name] + at, number)
                number += 1
    return query, first


def _witness(
    network: Network, given: Mapping[str, Bounds], values: Mapping[int, float], first: Mapping[str, int]
) -> Point:
    """Return Marabou's input, rounded to the network's format inside of the box."""
    return {
        name: tuple(
            min(max(nearest(values[first[name] + at], is_double=network.is_double), low), high)
            for at, (low, high) in enumerate(zip(*given[name], strict=True))
        )
        for name in network.inputs
    }
