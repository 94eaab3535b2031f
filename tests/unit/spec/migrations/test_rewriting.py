from __future__ import annotations

from pathlib import Path, PurePath

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.ecm import Ecm
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.diagnostics.source import Source
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, Kind, UnmigratableError, Version
from aeros.spec.migrations.rewriting import format_of, has_known_name, rewrite
from aeros.spec.text.yaml_reader import read_yaml
from tests.unit.spec.migrations.migrating import OLD_ECM, as_imagined_version, with_imagined_version

ROOT = Path(__file__).parents[4]
MANIFEST = PurePath("tidy/ecm.yaml")


def shipped() -> list[Path]:
    return sorted(ROOT.glob("ecms/*/ecm.yaml"))


@pytest.mark.parametrize("path", shipped(), ids=lambda path: path.parent.name)
def test_a_shipped_manifest_comes_back_byte_for_byte(path: Path) -> None:
    text = path.read_bytes().decode()
    old = as_imagined_version(text)
    assert old != text
    assert rewrite(path, old, OLD_ECM).text == text
    assert rewrite(path, text, OLD_ECM).text == text


def test_an_older_manifest_is_refused_at_its_schema(monkeypatch: pytest.MonkeyPatch) -> None:
    with_imagined_version(monkeypatch)
    sink = Diagnostics()
    source = Source("tidy/ecm.yaml", "id: it\nschema: aeros/ecm/1\n")
    node = read_yaml(source, sink)
    assert node is not None
    assert decode(node, Ecm, sink) is None
    (problem,) = sink
    assert problem.code == "AE114"
    assert problem.primary is not None
    assert problem.primary.span.line == 2
    assert problem.help[0] == "run `aeros migrate tidy/ecm.yaml`"


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("any.yaml", "schema: aeros/site/9\n", "site"),
        ("any.yml", '{"schema": "aeros/people/1"}', "people"),
        ("any.yaml", "schema: aeros/unheard-of/1\n", None),
        ("any.yaml", "a: &anchor aeros/ecm\n", None),
        ("ecm.yaml", "id: it\n", "ecm"),
        ("ecm.lock", '{"schema": "aeros/certificate/1"}', "certificate"),
        ("results.json", '{"schema": "aeros/experiments/1"}', "experiments"),
        ("results.json", '{"tests": 3}', None),
        ("results.json", "{", None),
        ("phase.json", '{"phase": "created"}', "phase"),
        ("crashes.json", "[]", "crashes"),
        ("phase.json", "[]", None),
        ("trials.jsonl", '{"condition": "", "seed": 1, "found": {}}\n{"con', "trial"),
        ("other.json", "{}", None),
    ],
)
def test_a_format_is_known_by_name_and_content(name: str, text: str, found: str | None) -> None:
    format_ = format_of(PurePath(name), text)
    assert (None if format_ is None else format_.name) == found
    assert has_known_name(PurePath(name)) == (name != "other.json")


def test_lines_are_as_old_as_the_oldest() -> None:
    step = Version("more", lambda text: text.replace("trial/1", "trial/2"))
    two = Format("trial", "", ("trials.jsonl",), Kind.JSON_LINES, (Version("first"), step))
    text = '{"schema": "aeros/trial/2"}\n{"schema": "aeros/trial/1"}\n'
    new = rewrite(PurePath("trials.jsonl"), text, two)
    assert new.version == 1
    assert new.text == '{"schema": "aeros/trial/2"}\n' * 2
    with pytest.raises(UnmigratableError):
        rewrite(PurePath("trials.jsonl"), text + '{"schema": "aeros/other/1"}\n', two)


def test_a_schema_of_the_first_line_is_that_of_the_file() -> None:
    text = '{"schema":"aeros/poses/1","actors":[]}\n{"t":0.0333}\n'
    path = PurePath("poses.jsonl")
    found = format_of(path, text)
    assert found is not None
    assert (found.name, rewrite(path, text, found).text) == ("poses", text)


def test_a_file_without_its_schema_is_not_migrated() -> None:
    with pytest.raises(UnmigratableError, match="`aeros/ecm/2`"):
        rewrite(MANIFEST, "id: it\n", formats.ECM)


def test_a_step_that_leaves_another_version_is_an_internal_error() -> None:
    forgetful = Format("ecm", "", (), Kind.YAML, (Version("first"), Version("more", lambda text: text)))
    with pytest.raises(InternalError, match="left another version"):
        rewrite(MANIFEST, "schema: aeros/ecm/1\n", forgetful)
    without = Format("ecm", "", (), Kind.YAML, (Version("first"), Version("more")))
    with pytest.raises(InternalError, match="has no step"):
        rewrite(MANIFEST, "schema: aeros/ecm/1\n", without)
