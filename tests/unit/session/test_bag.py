"""Recordings of a run: a bag, an MCAP file, none, or the reason why there can be none."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from aeros.runtime.bus.feed import BusFeed
from aeros.session.bag import BagOutputError, open_bag
from tests.unit.runtime.bench import configuration


def test_where_nothing_is_asked_for_nothing_is_opened() -> None:
    with open_bag(None, None, configuration().site) as feed:
        assert feed is None


@pytest.mark.parametrize("is_file", [False, True])
def test_a_recording_is_there_when_the_block_ends(tmp_path: Path, *, is_file: bool) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    folder, file = (None, tmp_path / "run.mcap") if is_file else (tmp_path / "bag", None)
    with open_bag(folder, file, configuration().site) as feed:
        assert isinstance(feed, BusFeed)
        assert feed._is_whole  # nothing is dropped
    if is_file:
        assert (tmp_path / "run.mcap").read_bytes().startswith(b"\x89MCAP")
    else:
        assert (tmp_path / "bag" / "metadata.yaml").exists()


@pytest.mark.parametrize(
    ("is_file", "ending"),
    [(False, "; give a new folder with --bag"), (True, "; give a new file with --mcap")],
)
def test_existing_files_are_not_overwritten(tmp_path: Path, ending: str, *, is_file: bool) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    path = tmp_path / "run.mcap"
    path.write_text("mine")
    with (
        pytest.raises(BagOutputError) as refused,
        open_bag(None if is_file else path, path if is_file else None, configuration().site),
    ):
        pass
    assert str(refused.value).endswith(ending)
    assert path.read_text() == "mine"


@pytest.mark.parametrize(("is_file", "option"), [(False, "--bag"), (True, "--mcap")])
def test_without_the_library_the_error_names_what_to_install(
    tmp_path: Path, option: str, monkeypatch: pytest.MonkeyPatch, *, is_file: bool
) -> None:
    monkeypatch.setitem(sys.modules, "aeros.runtime.bus.bag", None)
    path = tmp_path / "run"
    with (
        pytest.raises(BagOutputError, match=rf"^{option} needs `pip install '\.\[ros\]'`"),
        open_bag(None if is_file else path, path if is_file else None, configuration().site),
    ):
        pass


def test_an_error_of_the_run_is_not_taken_for_one_of_the_recording(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    with pytest.raises(ZeroDivisionError), open_bag(tmp_path / "bag", None, configuration().site):
        raise ZeroDivisionError
