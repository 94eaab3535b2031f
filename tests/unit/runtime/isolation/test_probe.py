from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.probe import probe_layer, probe_sandbox
from aeros.runtime.isolation.zygote_pool import ZygotePool


@pytest.mark.parametrize("layer", APPLY_LAYER)
def test_a_layer_that_has_no_effect_is_missing(
    layer: IsolationLayer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(APPLY_LAYER, layer, lambda: None)
    assert probe_layer(layer) == "it was applied and has no effect"


def test_a_layer_that_cannot_be_put_on_is_missing_with_the_kernels_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def absent() -> None:
        raise OSError(38, "Function not implemented")

    monkeypatch.setitem(APPLY_LAYER, IsolationLayer.LANDLOCK, absent)
    assert probe_layer(IsolationLayer.LANDLOCK) == "[Errno 38] Function not implemented"


def test_a_layer_that_kills_its_probe_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(APPLY_LAYER, IsolationLayer.SECCOMP, lambda: os.kill(os.getpid(), 9))
    assert probe_layer(IsolationLayer.SECCOMP) == "its probe ended with -9"


def test_a_process_that_is_not_closed_off_finds_the_runtime(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    nobody = 2**22 + 1  # beyond the largest number a process can have
    assert probe_sandbox(os.getpid(), str(file), "x") == "the runtime's process can be seen"
    assert probe_sandbox(nobody, str(file), "x") == "the runtime's files can be opened"
    file.unlink()
    with socket.socket(socket.AF_UNIX) as listening:
        name = f"aeros-test-{os.getpid()}"
        listening.bind(f"\0{name}")
        listening.listen()
        assert probe_sandbox(nobody, str(file), name) == "the runtime's network can be reached"
    assert probe_sandbox(nobody, str(file), name) is None


def test_a_zygote_without_bubblewrap_is_found_to_have_none(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    channel.close()
    zygote.end_worker()
    assert zygote.probe()[IsolationLayer.BUBBLEWRAP] == "the runtime's process can be seen"
    bare.release(zygote)
