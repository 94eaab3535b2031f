"""A worker closes what it inherited, drops its privileges, and applies the layers in their order."""

from __future__ import annotations

import os
from functools import partial
from typing import Any

import pytest

from aeros.runtime.isolation import layers as module
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer, apply_layers, close_all_but
from aeros.runtime.isolation.limits import MEMORY
from tests.unit.runtime.isolation.support.forked import in_child


def open_descriptors() -> list[int]:
    found = []
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        try:
            os.fstat(descriptor)
        except OSError:
            continue  # that of the listing
        found.append(descriptor)
    return sorted(found)


def test_only_the_standard_descriptors_and_one_stay_open() -> None:
    def closed(keep: int) -> list[int]:
        for _ in range(3):
            os.open(os.devnull, os.O_RDONLY)
        close_all_but(keep)
        return [number if number < 3 else number - keep + 3 for number in open_descriptors()]

    assert in_child(closed) == [0, 1, 2, 3]


def test_output_leads_where_input_does() -> None:
    def leads(keep: int) -> list[Any]:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        apply_layers([], keep)
        return [os.readlink(f"/proc/self/fd/{number}") for number in (0, 1, 2)]

    assert in_child(leads) == ["/dev/null"] * 3


@pytest.mark.parametrize(
    ("requested", "applied"),
    [
        ([], []),
        (IsolationLayer, ["rlimits", "landlock", "seccomp"]),
        ([IsolationLayer.SECCOMP, IsolationLayer.RLIMITS], ["rlimits", "seccomp"]),
        ([IsolationLayer.BUBBLEWRAP], []),
        ([IsolationLayer.LANDLOCK] * 2, ["landlock"]),
    ],
)
def test_privileges_are_dropped_before_the_requested_layers_in_their_order(
    requested: Any, applied: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []

    def note(layer: str, *memory: int) -> None:
        assert memory == ((MEMORY,) if layer == "rlimits" else ())
        done.append(layer)

    monkeypatch.setattr(module, "close_all_but", lambda keep: done.append(f"closed but {keep}"))
    monkeypatch.setattr(module, "drop_privileges", lambda: done.append("dropped"))
    monkeypatch.setattr(os, "dup2", lambda source, target: done.append(f"{target} as {source}"))
    for layer in APPLY_LAYER:
        monkeypatch.setitem(APPLY_LAYER, layer, partial(note, layer.value))
    apply_layers(requested, 7)
    assert done == ["1 as 0", "2 as 0", "closed but 7", "dropped", *applied]


def test_a_layer_that_cannot_be_applied_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(memory: int) -> None:
        raise PermissionError

    monkeypatch.setitem(APPLY_LAYER, IsolationLayer.RLIMITS, refused)

    def fails(keep: int) -> str:
        with pytest.raises(PermissionError):
            apply_layers([IsolationLayer.RLIMITS, IsolationLayer.SECCOMP], keep)
        return "raised"

    assert in_child(fails) == "raised"


def test_the_names_are_those_of_site_files_and_records() -> None:
    names = ["landlock", "seccomp", "rlimits", "bubblewrap", "cgroups"]
    assert [layer.value for layer in IsolationLayer] == names
