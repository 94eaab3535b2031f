"""Sources of modules: folders, bundles and distributions, of which nothing is executed."""

from __future__ import annotations

import re
import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.cli.robot.module_source import BUNDLE, module_source
from aeros.runtime.registry.archive import pack
from aeros.spec.diagnostics.errors import UserError
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot with the site of docs/codes in force; commands are run beside its folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["policy", str(BASE / "site.yaml"), "--state", "robot"]) == 0
    return tmp_path / "robot"


def run(*arguments: str) -> int:
    return main([*arguments, "--state", "robot"])


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed distribution that offers the module `tidy`, and whose code must not be executed."""
    package, metadata = tmp_path / "site" / "tidy_wares", tmp_path / "site" / "tidy_wares-1.dist-info"
    shutil.copytree(BASE / "tidy", package / "tidy")
    metadata.mkdir(parents=True)
    for folder in (package, package / "tidy"):
        (folder / "__init__.py").write_text("X = 1 // 0  # executed before it was proved\n")
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: tidy_wares\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text(
        "[aeros.ecms]\ntidy = tidy_wares.tidy\ngone = tidy_wares.gone\nodd = no.such:place\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return package


@pytest.mark.usefixtures("robot", "distribution")
def test_a_module_comes_out_of_an_installed_distribution_and_nothing_of_it_is_imported() -> None:
    assert run("install", "tidy") == 0
    assert "tidy_wares" not in sys.modules


@pytest.mark.parametrize("name", ["gone", "odd"])
@pytest.mark.usefixtures("robot", "distribution")
def test_an_entry_point_that_names_no_folder_is_refused(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("install", name) == 1
    assert "is not a folder of a package" in capsys.readouterr().err


def test_a_folder_is_its_own_source(tmp_path: Path) -> None:
    with module_source(str(tmp_path)) as found:
        assert found == tmp_path


def test_a_bundle_is_unpacked_under_its_name_and_gone_after(tmp_path: Path) -> None:
    bundle = tmp_path / f"tidy-1.0.0{BUNDLE}"
    bundle.write_bytes(
        pack({path.name: path.read_bytes() for path in (BASE / "tidy").iterdir() if path.is_file()})
    )
    with module_source(str(bundle)) as found:
        assert found.name == "tidy-1.0.0"
        assert (found / "ecm.yaml").read_bytes() == (BASE / "tidy" / "ecm.yaml").read_bytes()
    assert not found.exists()
    assert not found.parent.exists()


def test_a_file_that_is_no_bundle_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no archive")
    with pytest.raises(UserError), module_source(str(tmp_path / "notes.txt")):
        pass


def test_a_name_that_nothing_provides_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with (
        pytest.raises(UserError, match=r"`wares` is not a folder, a file or an entry point of `aeros\.ecms`"),
        module_source("wares"),
    ):
        pass


@pytest.mark.usefixtures("distribution")
def test_an_entry_point_leads_to_the_folder_of_its_package(distribution: Path) -> None:
    with module_source("tidy") as found:
        assert found == distribution / "tidy"
    assert "tidy_wares" not in sys.modules
    with (
        pytest.raises(UserError, match=r"entry point `gone` is `tidy_wares\.gone`, which is not a folder"),
        module_source("gone"),
    ):
        pass


def bundle(path: Path, **files: str) -> Path:
    with zipfile.ZipFile(path, "w") as written:
        for name, text in files.items():
            written.writestr(name, text)
    return path


BUNDLES: list[tuple[dict[str, str], str]] = [
    ({}, "holds no module: it has no `ecm.yaml` at its top"),
    ({"tidy/ecm.yaml": "id: tidy"}, "holds no module: it has no `ecm.yaml` at its top"),
    ({"ecm.yaml/a": ""}, "ecm.yaml` cannot be read: it is a directory"),
    ({"ecm.yaml": "id: tidy"}, "the field"),
    ({"ecm.yaml": "", "x" * 300: ""}, "File name too long"),
    ({"ecm.yaml": "", "a": "", "a/b": ""}, "`a/b` is both a file and a folder in it"),
    ({"ecm.yaml": "", "a/b": "", "a": ""}, "`a` is both a file and a folder in it"),
]


@pytest.mark.usefixtures("robot")
def test_a_bundle_and_its_member_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for files, message in BUNDLES:
        assert run("install", str(bundle(tmp_path / "x.zip", **files))) == 1
        shown = capsys.readouterr().err
        assert message in shown
        assert "x.zip" in shown
        assert not re.search(r"/aeros-\d+/|<|Errno", shown)


def test_an_encrypted_bundle_is_refused_in_words(tmp_path: Path) -> None:
    path = bundle(tmp_path / "x.zip", **{"ecm.yaml": "id: tidy"})
    content = bytearray(path.read_bytes())
    content[content.find(b"PK\3\4") + 6] |= 1
    content[content.find(b"PK\1\2") + 8] |= 1
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"`ecm\.yaml` is encrypted"), module_source(str(path)):
        pass
