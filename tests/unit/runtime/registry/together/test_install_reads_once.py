"""Installation proves the bytes that it keeps: the source is read once, whatever it changes to meanwhile."""

from __future__ import annotations

import builtins
import io
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.runtime.registry.archive import pack
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import BASE, Author

_UNSAFE = ("speed <= 250 mm/s", "speed <= 900 mm/s")


class Flipping:
    """A source that is the good module or its unsafe twin, and changes at each opening of its manifest."""

    def __init__(self, link: Path, good: Path, unsafe: Path) -> None:
        self.link = link
        self.twins = (good, unsafe)
        self.openings = 0
        self.flips_at: frozenset[int] = frozenset()

    def point(self, which: int) -> None:
        other = self.link.with_name("next")
        other.symlink_to(self.twins[which])
        other.rename(self.link)

    def look(self, path: object) -> None:
        if not isinstance(path, str | Path):
            return
        if str(path).startswith(f"{self.link}/") and str(path).endswith("ecm.yaml"):
            self.openings += 1
            if self.openings in self.flips_at:
                self.point(self.openings % 2)


@pytest.fixture
def flipping(write: Author, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Flipping:
    """Sees each file that is opened.  An audit hook cannot be removed, so it would slow later tests."""
    good, unsafe = write("good"), write("unsafe")
    manifest = unsafe / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace(*_UNSAFE, 1))
    made = Flipping(tmp_path / "tidy", good, unsafe)
    made.point(0)

    def watched(opened: Callable[..., Any]) -> Callable[..., Any]:
        def open_(path: object, *arguments: Any, **options: Any) -> Any:
            made.look(path)
            return opened(path, *arguments, **options)

        return open_

    for module in (builtins, io, os):
        monkeypatch.setattr(module, "open", watched(module.open))
    return made


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("flips", [{1}, {2}, {1, 2}, {2, 3}, {3, 4}, {1, 2, 3, 4, 5, 6}])
def test_a_source_that_changes_between_readings_is_kept_as_it_was_proved(
    registry: Registry, flipping: Flipping, first: int, flips: set[int]
) -> None:
    flipping.point(first)
    flipping.flips_at = frozenset(flips)
    with suppress(UserError):
        registry.install(flipping.link)
    if not registry.snapshot().modules:
        assert not (registry.folder / "modules").exists()
    else:
        (kept,) = registry.snapshot().modules.values()
        assert kept.digest == bundle_digest(module_files(flipping.twins[0]))
        registry.configure("tidy")
    assert flipping.openings == 1


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Proofs read the stored copy only: the source is gone by then."""
    prove = Registry._prove_snapshot

    def without_source(registry: Registry, *given: object) -> object:
        shutil.rmtree("source", ignore_errors=True)
        return prove(registry, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Registry, "_prove_snapshot", without_source)


@pytest.mark.parametrize("kind", ["folder", "bundle", "entry point"])
@pytest.mark.usefixtures("unread")
def test_no_source_of_any_kind_is_read_again(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["policy", str(BASE / "site.yaml"), "--state", "robot"]) == 0
    source = tmp_path / "source"
    shutil.copytree(BASE / "tidy", source / "wares" / "tidy")
    given = "source/wares/tidy"
    if kind == "bundle":
        given = "source/tidy.ecm.zip"
        (tmp_path / given).write_bytes(pack(module_files(source / "wares" / "tidy")))
    elif kind == "entry point":
        metadata = source / "wares-1.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: wares\nVersion: 1\n")
        (metadata / "entry_points.txt").write_text("[aeros.ecms]\ntidy = wares.tidy\n")
        (source / "wares" / "__init__.py").touch()
        monkeypatch.syspath_prepend(str(source))
        given = "tidy"
    assert main(["install", given, "--state", "robot"]) == 0
    assert not source.exists()
    assert main(["configure", "tidy", "--state", "robot"]) == 0


def test_a_policy_is_read_once(registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = tmp_path / "site.yaml"
    site.write_text((BASE / "site.yaml").read_text() + "# another\n")
    prove = Registry._prove_snapshot

    def without_source(self: Registry, *given: object) -> object:
        site.unlink(missing_ok=True)
        return prove(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Registry, "_prove_snapshot", without_source)
    registry.set_policy(site)
    assert not site.exists()


def test_a_refused_module_is_named_as_the_user_named_it(registry: Registry, write: Author) -> None:
    unsafe = write("unsafe")
    manifest = unsafe / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace(*_UNSAFE, 1))
    with pytest.raises(UserError) as refused:
        registry.install(unsafe)
    found = refused.value.diagnostics[0]
    assert found.primary is not None
    assert found.primary.span.source.path == str(manifest)
    assert not (registry.folder / "modules").exists()
