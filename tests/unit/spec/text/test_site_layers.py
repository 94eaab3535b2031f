"""A site file and the overlays on it are one text, in which every place has its own file."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.files import MAX_BYTES
from aeros.spec.text.site_layers import (
    is_reference_site,
    layer_span,
    layers_of,
    read_site,
    site_content,
    whole_offset,
)

HEAD = "schema: aeros/overlay/1\n"
SITE = "schema: aeros/site/1\nid: cell\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "deep").mkdir()
    (tmp_path / "site.yaml").write_text(SITE)
    (tmp_path / "deep" / "lower.yaml").write_text(f"{HEAD}base: ../site.yaml")  # no end of the last line
    (tmp_path / "upper.yaml").write_text(f"{HEAD}base: deep/lower.yaml\ngrants: {{}}\n")
    return tmp_path


def test_a_site_file_is_its_only_layer(folder: Path) -> None:
    source = read_site(folder / "site.yaml")
    assert source == Source(str(folder / "site.yaml"), SITE)
    assert layers_of(source) == (source,)
    assert site_content(folder / "site.yaml", SITE.encode()) == SITE.encode()


def test_overlays_come_before_the_site_that_they_are_based_on(folder: Path) -> None:
    path = folder / "upper.yaml"
    source = read_site(path)
    assert source.text == (
        f"{HEAD}base: deep/lower.yaml\ngrants: {{}}\n--- # deep/lower.yaml\n"
        f"{HEAD}base: ../site.yaml\n--- # ../site.yaml\n{SITE}"
    )
    layers = layers_of(source)
    assert [Path(one.path).resolve() for one in layers] == [
        folder / "upper.yaml", folder / "deep" / "lower.yaml", folder / "site.yaml"
    ]  # fmt: skip
    assert layers[-1].text == SITE
    assert site_content(path, path.read_bytes()) == source.text.encode()


def test_a_stored_copy_of_all_layers_is_the_same_text_without_the_files(folder: Path, tmp_path: Path) -> None:
    text = read_site(folder / "upper.yaml").text
    copy = tmp_path / "elsewhere" / f"{hashlib.sha256(text.encode()).hexdigest()}.yaml"
    copy.parent.mkdir()
    copy.write_text(text)
    assert read_site(copy).text == text
    assert [one.text for one in layers_of(read_site(copy))] == [
        one.text for one in layers_of(read_site(folder / "upper.yaml"))
    ]


def test_every_place_keeps_its_file_through_offsets_in_the_whole_text(folder: Path) -> None:
    source = read_site(folder / "upper.yaml")
    for layer in layers_of(source):
        span = layer.span(2, len(layer.text))
        first = whole_offset(source, span)
        assert layer_span(source, first + span.start, first + span.end) == span
        assert source.text[first + span.start : first + span.end] == span.text
    with pytest.raises(MisuseError):
        whole_offset(source, Source("other.yaml", SITE).span(0, 1))


def test_an_overlay_without_a_base_adds_to_the_reference_site(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(HEAD)
    upper, base = layers_of(read_site(tmp_path / "cell.yaml"))
    assert upper.text == HEAD
    assert base.path == str(reference_site_path())
    assert base.text == reference_site_path().read_text()
    assert is_reference_site(base)
    assert is_reference_site(Source("copy.yaml", base.text))
    assert not is_reference_site(Source(str(reference_site_path()), SITE))
    assert not is_reference_site(upper)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f"{HEAD}base: cell.yaml\n", "based on more than 8 files, or on itself"),
        (f"{HEAD}base: none.yaml\n", "cannot be read: no such file"),
        (f"{HEAD}base: [site.yaml]\n", "`base` is not the path of a site file"),
        (f'{HEAD}base: ""\n', "`base` is not the path of a site file"),
    ],
)
def test_a_base_that_cannot_be_read_is_refused(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "cell.yaml").write_text(text)
    with pytest.raises(UserError) as raised:
        read_site(tmp_path / "cell.yaml")
    (found,) = raised.value.diagnostics
    assert found.code == "AE002"
    assert reason in found.headline


def test_layers_are_too_large_together_if_they_could_not_be_read_again(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text(f"{SITE}# {'x' * (MAX_BYTES - len(SITE) - 3)}\n")
    read_site(tmp_path / "site.yaml")
    (tmp_path / "cell.yaml").write_text(f"{HEAD}base: site.yaml\n")
    with pytest.raises(UserError) as raised:
        read_site(tmp_path / "cell.yaml")
    assert [one.code for one in raised.value.diagnostics] == ["AE003"]


def test_a_file_that_looks_like_an_overlay_brings_no_site_of_its_own(folder: Path) -> None:
    text = read_site(folder / "upper.yaml").text
    (folder / "mine.yaml").write_text(text)
    with pytest.raises(UserError, match="are two files"):
        read_site(folder / "mine.yaml")


def test_a_base_with_a_line_that_begins_a_layer_is_refused(folder: Path) -> None:
    (folder / "site.yaml").write_text(f"--- # my cell\n{SITE}")
    assert read_site(folder / "site.yaml").text.endswith(SITE)
    with pytest.raises(UserError, match="write `---` alone"):
        read_site(folder / "upper.yaml")
