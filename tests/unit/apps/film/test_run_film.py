"""A film of a run needs its recording and a sound audit log."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import pytest

from aeros.apps.film.run_film import FilmError, film_run, instruction_of
from aeros.apps.report_page.run_data import RunData, read_run_data
from aeros.sim.film.film import FilmOptions
from aeros.sim.film.gl_context import OpenGlError, offscreen_context
from tests.unit.apps.film.runs import RUN, sites
from tests.unit.sim.films import frames_of

SMALL = FilmOptions(size=(320, 180), start=4.9)


def test_a_stored_second_becomes_a_film(tmp_path: Path) -> None:
    try:
        with offscreen_context(64, 48):
            pass
    except OpenGlError as error:
        pytest.skip(str(error))
    film = tmp_path / "film.gif"
    film.write_bytes(film_run(RUN, film, SMALL, sites()))
    (first, *_) = frames_of(film)
    assert first.shape == (180, 320, 3)
    # The panel has the red of who waits at its left edge.
    assert first[160, 6, 0] > first[160, 6, 1] + 80


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (
            lambda run: (run / "poses.jsonl").unlink(),
            r"there is no poses\.jsonl in `.*`: `aeros run` records",
        ),
        (lambda run: (run / "audit.jsonl").unlink(), r"there is no audit\.jsonl in"),
        (lambda run: (run / "poses.jsonl").write_text(""), "has no picture"),
        (
            lambda run: (run / "audit.jsonl").write_text(
                (run / "audit.jsonl").read_text().replace('"verdict":"DENY"', '"verdict":"ALLOW"')
            ),
            "is not sound, and a film shows its decisions: record",
        ),
    ],
)
def test_a_run_with_a_missing_or_damaged_file_has_no_film(damage, reason: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    run = shutil.copytree(RUN, tmp_path / "run")
    damage(run)
    with pytest.raises(FilmError, match=reason):
        film_run(run, tmp_path / "film.gif", SMALL, {})


def test_without_the_extra_the_cure_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("aeros.sim.film.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "aeros.sim.mujoco.client", raising=False)
    with pytest.raises(FilmError, match=r"\[film\]'` in the clone of AEROS \(mujoco is missing\)"):
        film_run(RUN, tmp_path / "film.gif", SMALL, {})


@pytest.mark.parametrize(
    ("selected", "failure"),
    [
        ("osmesa", AttributeError("'NoneType' object has no attribute 'glGetError'")),
        ("bogus", RuntimeError("invalid value for environment variable MUJOCO_GL: bogus")),
    ],
)
def test_an_opengl_that_mujoco_cannot_open_is_named_with_its_cure(
    selected: str, failure: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken:
        def find_spec(self, name: str, *_: object) -> None:
            if name == "mujoco":
                raise failure

    for name in [name for name in sys.modules if name.startswith(("aeros.sim.film.", "mujoco"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "aeros.sim.mujoco.client", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    monkeypatch.setenv("MUJOCO_GL", selected)
    reason = f"OpenGL, and MuJoCo has none with MUJOCO_GL=`{selected}`: {re.escape(str(failure))}. Unset it"
    with pytest.raises(FilmError, match=reason):
        film_run(RUN, tmp_path / "film.gif", SMALL, {})


def test_the_instruction_is_that_of_the_log() -> None:
    assert instruction_of(read_run_data(RUN)) == "make dumplings"
    assert instruction_of(RunData()) == ""
