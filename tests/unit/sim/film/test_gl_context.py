"""A context is opened by the first back end that works, or the reasons of all are told."""

from __future__ import annotations

import importlib

import pytest

from aeros.sim.film.gl_context import OpenGlError, offscreen_context


def test_without_opengl_the_cure_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def missing(name: str) -> None:
        tried.append(name)
        raise ImportError(f"no library for {name}")

    monkeypatch.setattr(importlib, "import_module", missing)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    reasons = r"no library for mujoco\.egl; osmesa: .*apt install libegl1"
    with pytest.raises(OpenGlError, match=reasons), offscreen_context(64, 48):
        pass
    assert tried == ["mujoco.egl", "mujoco.osmesa", "mujoco.glfw"]
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(OpenGlError), offscreen_context(64, 48):
        pass
    assert tried[3:] == ["mujoco.osmesa"]


def test_a_context_has_the_name_of_its_back_end(opengl: str) -> None:
    assert opengl in ("egl", "osmesa", "glfw")
