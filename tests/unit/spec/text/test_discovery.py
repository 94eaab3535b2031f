"""The modules at a path, and the site that comes with AEROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.text.discovery import (
    MANIFEST,
    Surroundings,
    all_module_folders,
    may_provide,
    module_folders,
    reference_modules_path,
    reference_site_path,
    shipped_folder,
)


def found(path: Path) -> list[Path]:
    sink = Diagnostics()
    folders = module_folders(path, sink)
    assert sink.has_errors is (not folders)
    return folders


def refused(path: Path) -> str:
    sink = Diagnostics()
    assert module_folders(path, sink) == []
    (problem,) = sink
    assert problem.code == "AE130"
    return problem.headline


def module(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "ecm.yaml").write_text("")
    return folder


def test_the_reference_site_is_a_file_of_the_package() -> None:
    assert reference_site_path().is_file()
    assert reference_site_path().name == "panda_cell.yaml"


def test_links_to_modules_count_once_and_stored_modules_do_not(tmp_path: Path) -> None:
    own, other = module(tmp_path / "mine" / "own"), module(tmp_path / "elsewhere" / "other")
    for name, target in (
        ("a", other),
        ("b", other),
        ("c", own),
        ("d", tmp_path / "elsewhere"),
        ("e", tmp_path),
    ):
        (tmp_path / "mine" / name).symlink_to(target, target_is_directory=True)
    module(tmp_path / "mine" / "robot" / "registry" / "modules" / "1" / "own")
    (tmp_path / "mine" / "robot" / "registry" / "registry.sqlite3").touch()
    assert found(tmp_path / "mine") == [tmp_path / "mine" / "a", own]
    sink = Diagnostics()
    every = all_module_folders([tmp_path / "mine", tmp_path / "elsewhere", own], sink)
    assert (every, sink.has_errors) == ([tmp_path / "mine" / "a", own], False)
    assert all_module_folders([own, tmp_path / "none"], sink) == [own]
    assert sink.has_errors


def test_a_manifest_and_its_folder_are_the_module(tmp_path: Path) -> None:
    folder = module(tmp_path / "it")
    module(folder / "inside")
    assert found(folder) == found(folder / "ecm.yaml") == [folder]


def test_modules_are_found_at_any_depth_sorted(tmp_path: Path) -> None:
    folders = [module(tmp_path / name) for name in ("b", "a/deep/er", "a/x", "c")]
    assert found(tmp_path) == sorted(folders)


def test_modules_inside_modules_are_found_too(tmp_path: Path) -> None:
    outer, inner = module(tmp_path / "a"), module(tmp_path / "a" / "b")
    assert found(tmp_path) == [outer, inner]


def test_hidden_folders_and_links_to_folders_of_modules_are_skipped(tmp_path: Path) -> None:
    kept = module(tmp_path / "some" / "a")
    module(tmp_path / "some" / ".hidden" / "b")
    (tmp_path / "some" / "link").symlink_to(module(tmp_path / "elsewhere" / "deep").parent)
    assert found(tmp_path / "some") == [kept]


def test_a_folder_called_as_a_manifest_and_a_link_to_nothing(tmp_path: Path) -> None:
    (tmp_path / "odd" / "ecm.yaml").mkdir(parents=True)
    (tmp_path / "gone").mkdir()
    (tmp_path / "gone" / "ecm.yaml").symlink_to("nothing")
    assert found(tmp_path) == [tmp_path / "odd"]


def test_a_path_without_modules_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert refused(tmp_path) == f"there is no `ecm.yaml` in or below `{tmp_path}`"
    assert refused(tmp_path / "file") == f"`{tmp_path / 'file'}` is neither a folder nor an `ecm.yaml`"
    for name in ("nothing", "ecm.yaml"):
        assert refused(tmp_path / name) == f"there is no file or folder `{tmp_path / name}`"


@pytest.mark.parametrize(
    ("manifest", "provides"),
    [
        ("id: near\n", True),
        ("capabilities: {sweeping: {}}\n", True),
        ("id: other\n", False),
        ('id: "ne\\x61r"\n', True),  # YAML reads it as `near`
    ],
)
def test_a_manifest_provides_what_it_spells_or_may_spell(manifest: str, provides: bool) -> None:
    assert may_provide(manifest, {"near", "sweeping"}) is provides


def test_named_modules_come_first_and_wherever_they_lie(tmp_path: Path) -> None:
    asker, beside = module(tmp_path / "a" / "asker"), module(tmp_path / "a" / "beside")
    together, apart = module(tmp_path / "a" / "together"), module(tmp_path / "b" / "apart")
    named = Surroundings(named=(asker, apart, together))
    assert named.around(asker) == (together, apart, beside)
    assert named.around(apart) == (asker, together)
    assert Surroundings(named=(asker, together)).around(asker) == (together, beside)
    assert Surroundings().around(asker) == (beside, together)


def test_a_named_link_is_the_folder_that_it_leads_to(tmp_path: Path) -> None:
    asker, helper = module(tmp_path / "a" / "asker"), module(tmp_path / "b" / "helper")
    (tmp_path / "a" / "link").symlink_to(helper, target_is_directory=True)
    assert Surroundings(named=(asker, helper)).around(asker) == (tmp_path / "a" / "link",)


def test_reference_modules_are_those_of_the_clone_or_of_the_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert (reference_modules_path() / "make_dumplings" / MANIFEST).is_file()
    monkeypatch.setattr("aeros.__file__", str(tmp_path / "aeros" / "__init__.py"))
    assert reference_modules_path() == tmp_path / "aeros_reference" / "ecms"
    assert shipped_folder("proofs") == tmp_path / "aeros_reference" / "proofs"
