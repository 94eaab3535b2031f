"""`aeros film` writes the film of a run, or tells why it cannot."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.cli.records import film
from aeros.exit_codes import Exit
from tests.unit.apps.film.runs import RUN


def _film(*arguments: str) -> int:
    return main(["film", *arguments])


def test_a_film_has_the_options_that_were_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[object, ...]] = []

    def made(folder: Path, path: Path, options: object, sites: object, progress: object) -> bytes:
        seen.append((folder, path, options))
        return b"film"

    monkeypatch.setattr(film, "film_run", made)
    out = tmp_path / "demo.webp"
    given = (
        "--speed",
        "4",
        "--from",
        "1",
        "--to",
        "9.5",
        "--camera",
        "fixed",
        "--title",
        "demo",
        "--no-captions",
    )
    assert _film(str(RUN), "--out", str(out), *given) == Exit.SUCCESS
    assert out.read_bytes() == b"film"
    assert f"film       {out}, 0.0 MB" in capsys.readouterr().out
    ((folder, path, options),) = seen
    assert (folder, path) == (RUN, out)
    assert vars(options) == {
        "size": (640, 360),
        "speed": 4.0,
        "camera": "fixed",
        "start": 1.0,
        "end": 9.5,
        "title": "demo",
        "has_captions": False,
        "has_insets": True,
        "has_shadows": True,
    }


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (["--size", "huge"], "expected a width and a height"),
        (["--size", "641x360"], "expected even numbers"),
        (["--size", "8000x4000"], "expected even numbers"),
        (["--speed", "0"], "expected a number from 0.1 to 100"),
        (["--speed", "nan"], "expected a number from 0.1 to 100"),
        (["--from", "-1"], "expected a number of seconds"),
        (["--out", "nodir/film.gif"], "its folder does not exist"),
        (["--out", "film.avi"], r"expected a file named *.mp4, *.webp, *.gif"),
    ],
)
def test_options_of_another_form_are_refused(
    given: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        _film(str(RUN), *given)
    assert ended.value.code == Exit.USAGE
    assert reason in capsys.readouterr().err


def test_a_film_that_cannot_be_made_or_written_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _film(str(RUN), "--from", "5", "--to", "4") == Exit.USAGE
    assert "--to must be after --from" in capsys.readouterr().err
    assert _film(str(tmp_path)) == Exit.REJECTED
    assert "there is no poses.jsonl in" in capsys.readouterr().err

    def drawn(*_: object) -> bytes:
        # Another process takes the name while the film is drawn.
        (tmp_path / "film.mp4").mkdir()
        return b"film"

    monkeypatch.setattr(film, "film_run", drawn)
    assert _film(str(RUN), "--out", str(tmp_path / "film.mp4")) == Exit.REJECTED
    assert "cannot write" in capsys.readouterr().err


def test_a_film_is_not_drawn_for_a_folder_in_which_it_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(film, "TemporaryFile", refuse)
    monkeypatch.setattr(film, "film_run", lambda *_: pytest.fail("it was drawn"))
    assert _film(str(RUN), "--out", str(tmp_path / "film.gif")) == Exit.REJECTED
    assert "film.gif`: Read-only file system; give a file with --out" in capsys.readouterr().err
