"""Marabou, where it is installed: `pip install '.[learned-proof]'`; no lock file holds it."""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import random
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from math import inf
from types import SimpleNamespace

import pytest

from aeros.spec.backends.network import marabou
from aeros.spec.backends.network.bound_search import BoundSearch, Target, violates
from aeros.spec.backends.network.box_propagation import bound_vectors, propagate
from aeros.spec.backends.network.marabou import decide_with_marabou, marabou_version
from aeros.spec.backends.network.steps import Clip, Join, Linear, Network, Scale, Smooth, Sum
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.spec.backends.network.marabou_by_z3 import MARABOU
from tests.unit.spec.backends.network.networks import TENT, network_of, random_layers, rounded

BOX = {"x": ([0.0], [2.0])}


def test_a_network_that_is_not_piecewise_linear_is_left_open() -> None:
    network = network_of(random_layers(0, activation="Tanh"))
    result = decide_with_marabou(network, {"x": ([0.0] * 3, [1.0] * 3)}, {"y": ((-2.0, 2.0),) * 2})
    assert (result.is_proved, result.witness) == (False, None)


@pytest.mark.skipif(marabou_version() is not None, reason="Marabou is installed")
def test_a_process_that_ends_without_an_answer_leaves_the_bound_open() -> None:
    result = decide_with_marabou(network_of(TENT), BOX, {"y": ((-0.1, 1.1),)})
    assert (result.is_proved, result.witness) == (False, None)


def test_marabou_agrees_with_boxes_and_a_violation_has_a_witness() -> None:
    pytest.importorskip("maraboupy")
    network = network_of(TENT)
    assert decide_with_marabou(network, BOX, {"y": ((-0.1, 1.1),)}).is_proved
    refuted = decide_with_marabou(network, BOX, {"y": ((-0.1, 0.9),)})
    assert refuted.witness is not None
    assert violates(network, refuted.witness, {"y": ((-0.1, 0.9),)})


# Without Marabou: its queries are decided by a stand-in.


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "maraboupy.MarabouCore", MARABOU)


def all_steps(seed: int, *, is_double: bool) -> Network:
    """Three numbers in two inputs, each kind of step that is piecewise linear, two numbers in two outputs."""
    draw = random.Random(seed)  # noqa: S311 - weights, no secrets

    def some(count: int) -> tuple[float, ...]:
        return tuple(draw.choice((-1.5, -1.0, -0.5, 0.5, 0.75, 1.25)) for _ in range(count))

    steps = (
        Linear("a", "x", (some(2), some(2)), some(2)),
        Clip("b", "a", 0.0, inf),
        Scale("c", "z", some(1), some(1)),
        Join("d", ("b", "c")),
        Linear("e", "d", (some(3), some(3), (0.0, 1.0, 0.0)), (*some(2), 0.0)),
        Clip("f", "e", -0.5, 1.0),
        Clip("g", "e", 0.0, 1.25),
        Sum("h", "f", "g", draw.choice((1.0, -1.0))),
        Linear("k", "h", (some(3),), some(1)),
        Scale("l", "h", some(3), some(3)),
    )
    return Network({"x": 2, "z": 1}, {"first": "k", "second": "l"}, steps, is_double)


ANYWHERE = {"x": ([-1.0, -0.75], [1.0, 0.5]), "z": ([-0.5], [1.25])}
FREE = ((-inf, inf),)


def sampled(network: Network) -> Iterator[tuple[str, int, float, float]]:
    """Each component of each output, with its least and greatest value on a grid."""
    sides = [pair for lows, highs in ANYWHERE.values() for pair in zip(lows, highs, strict=True)]
    grid = [[low + (high - low) * step / 8.0 for step in range(9)] for low, high in sides]
    points = [propagate(network, {"x": ([x, y],) * 2, "z": ([z],) * 2}) for x, y, z in product(*grid)]
    for name, size in (("first", 1), ("second", 3)):
        for at in range(size):
            values = [point[name][0][at] for point in points]
            yield name, at, min(values), max(values)


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize("seed", range(3))
def test_each_end_of_each_output_is_proved_above_what_is_reached_and_refuted_below(seed: int) -> None:
    network = all_steps(seed, is_double=bool(seed % 2))
    for name, at, least, most in sampled(network):
        rest: dict[str, tuple[tuple[float, float], ...]] = {"first": FREE, "second": FREE * 3}
        for ends, is_kept in (
            ((least - 0.2, most + 0.2), True),
            ((least - 0.2, most - 0.01), False),
            ((least + 0.01, most + 0.2), False),
        ):
            then: Target = {**rest, name: (*rest[name][:at], ends, *rest[name][at + 1 :])}
            found = marabou._search(network, ANYWHERE, then)
            assert found.is_proved is is_kept, (name, at, ends)
            assert (found.witness is None) is is_kept
            if found.witness is not None:
                assert violates(network, found.witness, then)
                for key, (lows, highs) in ANYWHERE.items():
                    rows = zip(lows, found.witness[key], highs, strict=True)
                    assert all(low <= one <= high for low, one, high in rows)


def test_a_query_numbers_its_inputs_and_outputs() -> None:
    network = all_steps(0, is_double=True)
    query, first = marabou._query(MARABOU, network, bound_vectors(network, ANYWHERE))
    x, z, k, place = (first[name] for name in "xzkl")
    assert query.marked == {"in": [x, x + 1, z], "out": [k, place, place + 1, place + 2]}


@pytest.mark.usefixtures("stand_in")
def test_a_bound_is_asked_about_only_where_boxes_leave_it_open() -> None:
    network = network_of(TENT)
    (low,), (high,) = propagate(network, BOX)["y"]
    assert low < -0.5
    assert high > 1.5
    assert marabou._search(network, BOX, {"y": ((low, high),)}) == BoundSearch(True, None, 0)
    assert marabou._search(network, BOX, {"y": ((low, 1.1),)}) == BoundSearch(True, None, 1)
    assert marabou._search(network, BOX, {"y": ((-0.1, 1.1),)}) == BoundSearch(True, None, 2)


@pytest.mark.usefixtures("stand_in")
def test_a_bound_that_is_just_kept_or_just_not_is_left_open() -> None:
    """The greatest value of the tent is 1, the least 0, and the margin a millionth of the box around it."""
    network = replace(network_of(TENT), is_double=True)
    left_open = BoundSearch(False, None, 2)
    for ends in ((-9.0, 1.0 - 1e-6), (-9.0, 1.0), (-9.0, 1.0 + 1e-6), (0.0, 9.0), (-1e-6, 9.0)):
        assert marabou._search(network, BOX, {"y": (ends,)}) == left_open
    for ends in ((-9.0, 1.0 + 1e-5), (-1e-5, 9.0)):
        assert marabou._search(network, BOX, {"y": (ends,)}) == BoundSearch(True, None, 1)
    for ends in ((-9.0, 1.0 - 1e-5), (1e-5, 9.0)):
        found = marabou._search(network, BOX, {"y": (ends,)})
        assert found == BoundSearch(False, found.witness, found.parts)
        assert found.witness is not None
        assert found.parts in (1, 2), "the first input may be too near to the end"


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize("status", ["TIMEOUT", "unknown", "ERROR"])
def test_a_bound_that_marabou_leaves_open_is_left_open(status: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MARABOU, "solve", lambda *_: (status, {}, None))
    found = marabou._search(network_of(TENT), BOX, {"y": ((-0.1, 1.1),)})
    assert (found.is_proved, found.witness) == (False, None)


@pytest.mark.usefixtures("stand_in")
def test_an_input_that_does_not_violate_is_no_witness(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = MARABOU.solve
    monkeypatch.setattr(
        MARABOU, "solve", lambda *given: (solve(*given)[0], dict.fromkeys(range(9), 0.5), None)
    )
    found = marabou._search(network_of(TENT), BOX, {"y": ((-0.1, 0.9),)})
    assert (found.is_proved, found.witness) == (False, None)


@pytest.mark.usefixtures("stand_in")
def test_a_process_of_its_own_answers_or_is_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forked here, so that it has the stand-in, too."""
    network, then, fork = network_of(TENT), {"y": ((-0.1, 1.1),)}, multiprocessing.get_context("fork")
    monkeypatch.setattr(multiprocessing, "get_context", {"spawn": fork}.__getitem__)
    assert decide_with_marabou(network, BOX, then) == BoundSearch(True, None, 2)

    ours = os.getpid()

    def seen(*given: object) -> object:
        process = multiprocessing.current_process()
        return os.getppid() == ours, process.daemon, given == (network, BOX, then)

    monkeypatch.setattr(marabou, "_search", seen)
    assert decide_with_marabou(network, BOX, then) == (True, True, True)  # type: ignore[comparison-overlap]
    monkeypatch.setattr(marabou, "_search", lambda *_: time.sleep(60.0))
    started = time.monotonic()
    assert decide_with_marabou(network, BOX, then, 0.1) == BoundSearch(False, None, 0)
    assert time.monotonic() - started < 30.0
    assert multiprocessing.active_children() == []


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    ("ends", "is_kept"), [((-2.0, -1.0), False), ((1.0, 2.0), False), ((-1.0, 1.0), True), ((0.0, 0.0), True)]
)
def test_an_output_that_is_always_0_is_judged_without_a_margin(
    ends: tuple[float, float], is_kept: bool
) -> None:
    network = Network({"x": 1}, {"y": "y"}, (Clip("y", "x", 0.0, 0.0),), is_double=True)
    found = marabou._search(network, BOX, {"y": (ends,)})
    assert found.is_proved is is_kept
    assert (found.witness is None) is is_kept


@pytest.mark.usefixtures("stand_in")
def test_the_process_sends_what_the_search_finds() -> None:
    sent: list[object] = []
    network, then = network_of(TENT), {"y": ((-0.1, 1.1),)}
    marabou._decide(SimpleNamespace(send=sent.append), network, BOX, then)  # type: ignore[arg-type]
    assert sent == [BoundSearch(True, None, 2)]


@pytest.mark.parametrize(("is_double", "found"), [(True, 0.1), (False, rounded(0.1))])
def test_a_witness_is_a_number_of_the_networks_format_in_the_box(is_double: bool, found: float) -> None:
    network = replace(network_of(TENT), is_double=is_double)
    for value, expected in ((0.1, found), (-0.1, 0.0), (2.1, 2.0)):
        assert marabou._witness(network, BOX, {7: value}, {"x": 7}) == {"x": (expected,)}


@pytest.mark.usefixtures("stand_in")
def test_a_smooth_step_is_no_query() -> None:
    network = Network({"x": 1}, {"y": "y"}, (Smooth("y", "x", "tanh"),), is_double=True)
    with pytest.raises(MisuseError, match=r"^Marabou is given piecewise linear networks only$"):
        marabou._query(MARABOU, network, {"x": ([0.0], [1.0]), "y": ([0.0], [1.0])})


def test_the_version_is_that_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", {"maraboupy": object()}.get)
    monkeypatch.setattr(marabou, "package_version", lambda module, package: f"of {module} {package}")
    assert marabou_version() == "maraboupy of maraboupy maraboupy"
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert marabou_version() is None


def test_layers_of_another_length_are_refused_and_not_cut_off() -> None:
    one, pair = ([0.0], [1.0]), ([0.0, 0.0], [1.0, 1.0])
    steps = (
        Linear("y", "x", ((1.0,), (1.0,)), (1.0,)),
        Linear("y", "x", ((1.0,),), (1.0, 1.0)),
        Scale("y", "x", (1.0, 1.0), (1.0,)),
        Scale("y", "x", (1.0,), (1.0, 1.0)),
    )
    for step in steps:
        network = Network({"x": 1}, {"y": "y"}, (step,), is_double=True)
        with pytest.raises(ValueError, match="argument 2 is"):
            marabou._query(MARABOU, network, {"x": one, "y": pair})
    network = Network({"x": 1}, {"y": "y"}, (Clip("y", "x", 0.0, inf),), is_double=True)
    for box in (([0.0], [1.0, 2.0]), ([0.0, 0.0], [1.0])):
        with pytest.raises(ValueError, match="argument 2 is"):
            marabou._query(MARABOU, network, {"x": box, "y": one})
        with pytest.raises(ValueError, match="argument 2 is"):
            marabou._witness(network, {"x": box}, {0: 0.5, 1: 0.5}, {"x": 0})
