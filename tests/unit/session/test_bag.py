"""Recordings and live views of a run: a bag, an MCAP file, a server, none, or why there can be none."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import aeros.runtime.bus
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.viewer.things import cameras_of_perceivers
from aeros.runtime.bus.viewer.topics import topics_of
from aeros.runtime.proving import prove_configuration
from aeros.session.bag import BagOutputError, open_bag, open_live_view
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.unit.runtime.bench import configuration


def test_where_nothing_is_asked_for_nothing_is_opened() -> None:
    with open_bag(None, None, configuration()) as feed:
        assert feed is None


@pytest.mark.parametrize("is_file", [False, True])
def test_a_recording_is_there_when_the_block_ends(tmp_path: Path, *, is_file: bool) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    folder, file = (None, tmp_path / "run.mcap") if is_file else (tmp_path / "bag", None)
    with open_bag(folder, file, configuration()) as feed:
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
        open_bag(None if is_file else path, path if is_file else None, configuration()),
    ):
        pass
    assert str(refused.value).endswith(ending)
    assert path.read_text() == "mine"


@pytest.mark.parametrize(("is_file", "option"), [(False, "--bag"), (True, "--mcap")])
def test_without_the_library_the_error_names_what_to_install(
    tmp_path: Path, option: str, monkeypatch: pytest.MonkeyPatch, *, is_file: bool
) -> None:
    monkeypatch.setitem(sys.modules, "aeros.runtime.bus.recording.bag", None)
    path = tmp_path / "run"
    with (
        pytest.raises(BagOutputError, match=rf"^{option} needs `pip install '\.\[ros\]'`"),
        open_bag(None if is_file else path, path if is_file else None, configuration()),
    ):
        pass


def test_an_error_of_the_run_is_not_taken_for_one_of_the_recording(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="needs `pip install '.[ros]'`")
    with pytest.raises(ZeroDivisionError), open_bag(tmp_path / "bag", None, configuration()):
        raise ZeroDivisionError


CONFIGURATION = configuration()


def test_without_a_port_nothing_is_opened() -> None:
    with open_live_view(None, CONFIGURATION, None) as feed:
        assert feed is None


def test_the_address_is_printed_and_the_run_never_waits() -> None:
    pytest.importorskip("foxglove", reason="the extra `live` is not installed")
    printed = io.StringIO()
    with open_live_view(0, CONFIGURATION, printed) as feed:
        assert isinstance(feed, BusFeed)
        assert not feed._is_whole
    assert printed.getvalue().startswith("live       ws://127.0.0.1:")


def test_a_port_in_use_is_refused_with_a_cure() -> None:
    pytest.importorskip("foxglove", reason="the extra `live` is not installed")
    printed = io.StringIO()
    with open_live_view(0, CONFIGURATION, printed):
        port = int(printed.getvalue().rpartition(":")[2])
        with (
            pytest.raises(BagOutputError, match="give another port with --live"),
            open_live_view(port, CONFIGURATION, None),
        ):
            pass


def test_without_the_server_the_error_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "aeros.runtime.bus.live_view", None)
    with (
        pytest.raises(BagOutputError, match=r"^--live needs `pip install '\.\[live\]'`"),
        open_live_view(0, CONFIGURATION, None),
    ):
        pass


def test_the_shipped_layout_shows_topics_that_runs_have() -> None:
    layout = json.loads((Path(aeros.runtime.bus.__path__[0]) / "foxglove-layout.json").read_text())
    panels, topics = layout["configById"], set()
    for panel in panels.values():
        image = panel.get("imageMode", {})
        topics |= set(panel.get("topics", ())) | set(image.get("annotations", ()))
        topics |= {panel.get("topicToRender"), panel.get("topicPath"), image.get("imageTopic")}
        topics |= {one["value"].rpartition(".")[0] for one in panel.get("paths", ())}
    certified, _ = prove_configuration([ROOT / "ecms"], reference_site_path(), certified=True)
    cameras = cameras_of_perceivers(certified.modules.values())
    assert topics - {None} <= set(topics_of(certified.site, cameras))
    assert {one for one in topics_of(certified.site, cameras) if "/camera/" in one} <= topics
    shown = set(panel_ids(layout["layout"])) | {
        one for panel in panels.values() for tab in panel.get("tabs", ()) for one in panel_ids(tab["layout"])
    }
    assert shown == set(panels)


def panel_ids(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from panel_ids(layout["first"])
        yield from panel_ids(layout["second"])
