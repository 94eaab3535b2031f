from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.experiments.trials.synthetic import write_module
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.policy import Durability
from aeros.spec.model.site import Site
from aeros.spec.text.digests import code_digest, code_files
from aeros.spec.text.discovery import module_folders, reference_site_path

CORPUS = Path(__file__).parents[3] / "corpus"


@pytest.fixture
def module(tmp_path: Path) -> Path:
    return Path(shutil.copytree(CORPUS / "accepted" / "always_slow", tmp_path / "always_slow"))


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert found is not None
    return found


def codes(sink: Diagnostics) -> list[str]:
    return [found.code for found in sink]


def test_the_reference_site_comes_with_the_package() -> None:
    sink = Diagnostics()
    found = load_site(reference_site_path(), sink)
    assert codes(sink) == []
    assert found is not None
    assert found.id == "panda_cell"


def test_a_module_is_loaded_with_its_code_and_digests(module: Path, site: Site) -> None:
    found = load_ecm(module, site, Diagnostics())
    assert found is not None
    assert found.ecm.id == "always_slow"
    assert found.ecm.folder == str(module)
    assert found.code == code_files(module)
    assert found.ecm.code_digest == code_digest(found.code)
    assert len({found.ecm.code_digest, found.ecm.manifest_digest, site.digest}) == 3


def test_a_module_is_elaborated_once_under_a_site_and_again_when_anything_of_it_changed(
    module: Path, site: Site
) -> None:
    def loaded(under: Site = site) -> Ecm:
        found = load_ecm(module, under, Diagnostics())
        assert found is not None
        return found.ecm

    first = loaded()
    assert loaded() is first
    assert loaded(replace(site)) is first  # an equal site
    assert loaded(replace(site, span=site.span.source.span(0, 1))) is not first  # messages point elsewhere
    code, manifest = next(module.glob("*.py")), module / "ecm.yaml"
    code.write_text(code.read_text() + "# more\n")
    second = loaded()
    assert second.code_digest != first.code_digest
    manifest.write_text(manifest.read_text() + "# more\n")
    assert loaded().manifest_digest != second.manifest_digest


def test_a_module_is_elaborated_again_when_one_that_it_requires_changed(tmp_path: Path) -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    write_module(tmp_path, 8)
    needing = write_module(tmp_path, 9)

    def loaded() -> Ecm:
        found = load_ecm(needing, site, Diagnostics())
        assert found is not None
        return found.ecm

    first = loaded()
    assert loaded() is first
    write_module(tmp_path, 8, version="1.1.0")
    second = loaded()
    assert second is not first
    assert second.foreign.modules["module_0008"].version == "1.1.0"


def test_a_fault_of_a_module_is_reported_each_time(module: Path, site: Site) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("pace", "pac", 1))
    sinks = [Diagnostics(), Diagnostics()]
    assert [load_ecm(module, site, sink) for sink in sinks] == [None, None]
    assert [*sinks[0]] == [*sinks[1]]
    assert codes(sinks[1])


@pytest.mark.parametrize("path", ["nowhere", "."], ids=["missing", "folder"])
def test_a_site_that_is_no_file_is_reported(tmp_path: Path, path: str) -> None:
    sink = Diagnostics()
    assert load_site(tmp_path / path, sink) is None
    assert codes(sink) == ["AE002"]


def test_a_missing_manifest_is_reported(tmp_path: Path, site: Site) -> None:
    sink = Diagnostics()
    assert load_ecm(tmp_path, site, sink) is None
    assert codes(sink) == ["AE002"]


def test_a_pipe_for_a_manifest_does_not_hang(tmp_path: Path, site: Site) -> None:
    os.mkfifo(tmp_path / "ecm.yaml")
    sink = Diagnostics()
    assert load_ecm(tmp_path, site, sink) is None
    assert codes(sink) == ["AE002"]


def test_code_that_cannot_be_read_is_reported(
    module: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refused)
    sink = Diagnostics()
    assert load_ecm(module, site, sink) is None
    (found,) = sink
    assert found.code == "AE002"
    assert found.headline.endswith("Permission denied")


def test_a_folder_that_cannot_be_read_may_hold_code(
    module: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    (module / "inner").mkdir()
    honest = os.scandir

    def refuse(path: str) -> object:
        if path.endswith("inner"):
            raise PermissionError(13, "Permission denied")
        return honest(path)

    monkeypatch.setattr(os, "scandir", refuse)
    sink = Diagnostics()
    assert load_ecm(module, site, sink) is None
    assert codes(sink) == ["AE002"]


def test_schema_faults_come_before_names_are_looked_at(module: Path, site: Site) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("license:", "licence:").replace("pace", "pac"))
    sink = Diagnostics()
    assert load_ecm(module, site, sink) is None
    assert codes(sink) == ["AE102", "AE101"]


def test_folders_are_found_in_order_and_hidden_ones_are_not(module: Path) -> None:
    for name in ("b", "a", ".hidden", "c/.hidden/d"):
        shutil.copytree(module, module.parent / "many" / name)
    sink = Diagnostics()
    found = module_folders(module.parent / "many", sink)
    assert [path.name for path in found] == ["a", "b"]
    assert codes(sink) == []


def test_a_module_inside_a_module_is_not_another_one(module: Path) -> None:
    shutil.copytree(module, module / "inner")
    assert module_folders(module, Diagnostics()) == [module]


def test_a_manifest_stands_for_its_folder(module: Path) -> None:
    assert module_folders(module / "ecm.yaml", Diagnostics()) == [module]


@pytest.mark.parametrize("name", ["", "nowhere", "skills.py"])
def test_a_path_without_a_module_is_reported(tmp_path: Path, name: str) -> None:
    (tmp_path / "skills.py").touch()
    sink = Diagnostics()
    assert module_folders(tmp_path / name, sink) == []
    assert codes(sink) == ["AE130"]


@pytest.mark.parametrize(
    ("written", "durability"),
    [
        ("", Durability.EVERY_RECORD),
        ("\n  audit: {durability: every-record}", Durability.EVERY_RECORD),
        ("\n  audit: {durability: before-motion}", Durability.BEFORE_MOTION),
        ("\n  audit: {durability: batched}", Durability.BATCHED),
    ],
)
def test_a_site_chooses_when_its_audit_record_is_durable(
    written: str, durability: Durability, tmp_path: Path
) -> None:
    text = (CORPUS / "site" / "table.yaml").read_text()
    path = tmp_path / "site.yaml"
    path.write_text(text.replace("\npolicy:", f"\npolicy:{written}"))
    sink = Diagnostics()
    found = load_site(path, sink)
    assert codes(sink) == []
    assert found is not None
    assert found.durability is durability


def test_equal_texts_share_a_site_and_changed_texts_do_not(tmp_path: Path, site: Site) -> None:
    path = Path(shutil.copy(CORPUS / "site" / "table.yaml", tmp_path))
    first = load_site(path, Diagnostics())
    assert first is not None
    assert load_site(path, Diagnostics()) is first
    assert site is not first  # that of another path
    path.write_text(path.read_text() + "\n")
    second = load_site(path, Diagnostics())
    assert second is not None
    assert second.digest != first.digest


def test_faults_of_a_cached_site_are_reported_every_time(tmp_path: Path) -> None:
    path = tmp_path / "site.yaml"
    path.write_text("schema: aeros/site/1\nid: s\n" + "".join(f"k{n}: 1\n" for n in range(300)))
    message = []
    for _ in range(2):
        sink = Diagnostics()
        assert load_site(path, sink) is None
        message.append(codes(sink))
    assert message[0] == message[1]
    assert len(message[0]) == 200
