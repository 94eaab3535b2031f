"""Arguments of commands: what is accepted, and what is refused in which words."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.arguments import (
    add_module_folders,
    add_signature_check,
    as_port,
    available_cpus,
    existing_folder,
    existing_path,
    film_path,
    mcap_path,
    process_count,
    second_solver,
    seconds_from,
    solver_budget,
    writable_film_path,
    writable_path,
)


@pytest.mark.parametrize(("parse", "most"), [(solver_budget, 2**32 - 1), (process_count, 256)])
def test_whole_numbers_within_their_bounds(parse: Callable[[str], int], most: int) -> None:
    assert [parse(text) for text in ("1", "007", str(most))] == [1, 7, most]
    for text in ("0", str(most + 1), "-1", "1.5", "", "x", "²", "٣", " 1", "1e3"):
        with pytest.raises(ArgumentTypeError, match=f"expected a whole number between 1 and {most}"):
            parse(text)


@pytest.mark.parametrize("lowest", [0.0, 0.5, 2.0])
def test_a_time_is_from_the_least_to_an_hour(lowest: float) -> None:
    parse = seconds_from(lowest)
    assert [parse(text) for text in (str(lowest), "2.5", "3600")] == [lowest, 2.5, 3600.0]
    for text in (str(lowest - 0.1), "3600.1", "inf", "nan", "soon", ""):
        with pytest.raises(ArgumentTypeError, match=f"expected a number of seconds from {lowest:g} to 3600"):
            parse(text)


def test_folders_of_modules_add_up(tmp_path: Path) -> None:
    parser = ArgumentParser()
    add_module_folders(parser, "the modules")
    assert parser.parse_args(["--ecms", str(tmp_path), "--ecms", "."]).ecms == [tmp_path, Path()]
    assert parser.parse_args([]).ecms is None


def test_a_path_that_exists(tmp_path: Path) -> None:
    assert existing_path(str(tmp_path)) == tmp_path
    with pytest.raises(ArgumentTypeError, match="no file or folder"):
        existing_path(str(tmp_path / "none"))
    with pytest.raises(ArgumentTypeError, match="not a path"):
        existing_path("a\x00b")
    with pytest.raises(ArgumentTypeError, match="the path is empty"):
        existing_path("")


def test_a_folder_that_exists(tmp_path: Path) -> None:
    assert existing_folder(str(tmp_path)) == tmp_path
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(ArgumentTypeError, match="is a file; give a folder"):
        existing_folder(str(tmp_path / "file"))


def test_a_path_at_which_a_file_can_be(tmp_path: Path) -> None:
    assert writable_path(str(tmp_path / "new")) == tmp_path / "new"
    with pytest.raises(ArgumentTypeError, match="is a folder"):
        writable_path(str(tmp_path))
    with pytest.raises(ArgumentTypeError, match="its folder does not exist"):
        writable_path(str(tmp_path / "none" / "new"))
    for name in ("ecm.yaml", "audit.jsonl", "skills.py"):
        assert writable_path(str(tmp_path / name)) == tmp_path / name
        (tmp_path / name).write_bytes(b"")
        with pytest.raises(ArgumentTypeError, match="would be overwritten; name another file"):
            writable_path(str(tmp_path / name))


@pytest.mark.parametrize("name", ["ecm.yaml", "cell.YAML"])
def test_no_input_is_overwritten_through_a_link(name: str, tmp_path: Path) -> None:
    link = tmp_path / "report.html"
    link.symlink_to(tmp_path / name)
    assert writable_path(str(link)) == link
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(ArgumentTypeError, match="would be overwritten; name another file"):
        writable_path(str(link))


def test_a_link_that_leads_nowhere_is_named_as_one(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").symlink_to("moved.yaml")
    with pytest.raises(ArgumentTypeError, match=r"is a link to `moved\.yaml`, which does not exist"):
        existing_path(str(tmp_path / "cell.yaml"))


def test_a_film_is_written_into_a_folder_that_exists(tmp_path: Path) -> None:
    assert writable_film_path(str(tmp_path / "run.gif")) == tmp_path / "run.gif"
    for text, reason in (("none/run.gif", "its folder does not exist"), ("run.avi", "expected a file named")):
        with pytest.raises(ArgumentTypeError, match=reason):
            writable_film_path(str(tmp_path / text))


@pytest.mark.parametrize(
    ("parse", "taken", "expected"),
    [
        (mcap_path, ["run.mcap"], r"\*\.mcap"),
        (film_path, ["run.webp", "run.gif", "a.b/run.mp4"], r"\*\.mp4, \*\.webp, \*\.gif"),
    ],
)
def test_a_suffix_says_the_format(parse: Callable[[str], Path], taken: list[str], expected: str) -> None:
    assert [parse(text) for text in taken] == [Path(text) for text in taken]
    for text in ("run", "run.avi", "run.MCAP", "mcap", ".gif"):
        with pytest.raises(ArgumentTypeError, match=f"expected a file named {expected}"):
            parse(text)


def test_processors_are_those_that_this_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 5})
    assert available_cpus() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    for count, expected in ((7, 7), (None, 1)):

        def counted(count: int | None = count) -> int | None:
            return count

        monkeypatch.setattr(os, "cpu_count", counted)
        assert available_cpus() == expected


def test_a_log_is_checked_with_one_key_and_any_number_of_anchors(tmp_path: Path) -> None:
    key, one, other = (tmp_path / name for name in ("key.pub", "one", "other"))
    for path in (key, one, other):
        path.touch()
    parser = ArgumentParser()
    add_signature_check(parser)
    found = parser.parse_args(["--public-key", str(key), "--anchor", str(one), "--anchor", str(other)])
    assert (found.public_key, found.anchor) == (key, [one, other])
    assert vars(parser.parse_args([])) == {"public_key": None, "anchor": []}


def test_a_second_solver_is_asked_for_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ArgumentTypeError, match="expected `cvc5`"):
        second_solver("z3")
    gone: Any = None
    monkeypatch.setitem(sys.modules, "aeros.spec.backends.cvc5_solver", gone)
    with pytest.raises(ArgumentTypeError, match=r"pip install '\.\[cvc5\]'"):
        second_solver("cvc5")
    monkeypatch.undo()
    pytest.importorskip("cvc5")
    from aeros.spec.backends.cvc5_solver import Cvc5

    assert isinstance(second_solver("cvc5"), Cvc5)


@pytest.mark.parametrize(
    ("text", "port"),
    [("0", 0), ("65535", 65535), ("65536", None), ("", None), ("-1", None), ("٣", None), ("1" * 5000, None)],
)
def test_a_port_is_a_number_of_sixteen_bits(text: str, port: int | None) -> None:
    assert as_port(text) == port
