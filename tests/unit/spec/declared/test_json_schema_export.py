"""Exported JSON schemas: they accept and refuse the same files as `decode`."""

from __future__ import annotations

import copy
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from aeros.spec.declared.decode import decode
from aeros.spec.declared.json_schema import FILES, json_schema_of
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

ROOT = Path(__file__).parents[4]
CORPUS = ROOT / "tests" / "corpus"
FORM_CODES = {"AE101", "AE102", "AE103", "AE104", "AE105", "AE106", "AE110", "AE111", "AE112", "AE114"}
"""Errors that both report. AE107 to AE109 are about characters, which a schema does not see."""


class EditorLoader(yaml.CSafeLoader):
    """YAML loader that reads as editors do, by the core schema of YAML 1.2: `no` and `on` are text."""


EditorLoader.yaml_implicit_resolvers = {}
for _tag, _regex, _first in (
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
    ("int", r"^[-+]?[0-9]+$", "-+0123456789"),
    ("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", "-+0123456789."),
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
):
    EditorLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(_regex), list(_first))


def files(name: str) -> list[Path]:
    """Return the files of the repository that use the schema `name`."""
    if name == "ecm":
        return sorted([*ROOT.glob("ecms/*/ecm.yaml"), *CORPUS.rglob("ecm.yaml")])
    if name == "overlay":
        return sorted((CORPUS / name).glob("*.yaml"))
    if name in ("people", "faults"):
        return sorted((ROOT / "aeros" / name).glob("*.yaml"))
    return sorted(
        [
            *(ROOT / "aeros" / "sites").glob("*.yaml"),
            CORPUS / "site" / "table.yaml",
            *CORPUS.rglob("site.yaml"),
        ]
    )


def validator(name: str) -> Draft202012Validator:
    return _validators()[name]


@cache
def _validators() -> dict[str, Draft202012Validator]:
    return {name: Draft202012Validator(json_schema_of(name)) for name in FILES}


def decoded(source: Source, name: str) -> tuple[bool, set[str]]:
    """Say if the file was decoded, and return the codes of its errors."""
    sink = Diagnostics()
    node = read_yaml(source, sink)
    found = None if node is None else decode(node, FILES[name], sink)
    return found is not None, {problem.code for problem in sink}


def data_of(path: Path) -> Any:
    return yaml.load(path.read_bytes(), EditorLoader)  # noqa: S506  derived from the safe loader


@pytest.mark.parametrize("name", FILES)
def test_it_is_a_schema(name: str) -> None:
    Draft202012Validator.check_schema(json_schema_of(name))


@pytest.mark.parametrize("name", FILES)
def test_every_field_of_every_record_is_described(name: str) -> None:
    schema = json_schema_of(name)
    for record in (schema, *schema["$defs"].values()):
        assert record["additionalProperties"] is False
        assert record["description"]
        assert [key for key, field in record["properties"].items() if not field["description"]] == []


@pytest.mark.parametrize("name", FILES)
def test_the_json_schema_accepts_every_decoded_file_and_refuses_errors_of_form(name: str) -> None:
    seen = set()
    for path in files(name):
        try:
            source = read_source(path)
        except UserError:
            continue  # bytes that are no text
        whole, codes = decoded(source, name)
        if whole or codes & FORM_CODES:
            errors = [
                f"{error.json_path}: {error.message}" for error in validator(name).iter_errors(data_of(path))
            ]
            assert bool(errors) == bool(codes & FORM_CODES), (path, codes, errors)
            seen |= codes & FORM_CODES
    assert name != "ecm" or len(seen) >= 5


def records(value: Any, schema: dict[str, Any], root: dict[str, Any], at: tuple[Any, ...] = ()) -> list[Any]:
    """Yield the path of every record in `value`, with the fields that it must have."""
    schema = root["$defs"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
    found: list[Any] = []
    if isinstance(value, list):
        for n, item in enumerate(value):
            found += records(item, schema["items"], root, (*at, n))
    elif isinstance(value, dict) and "properties" in schema:
        found.append((at, schema["required"]))
        for key, item in value.items():
            found += records(item, schema["properties"][key], root, (*at, key))
    elif isinstance(value, dict):
        for key, item in value.items():
            found += records(item, schema["additionalProperties"], root, (*at, key))
    return found


def changed(data: Any, at: tuple[Any, ...], *, without: str = "", extra: str = "") -> Any:
    data = copy.deepcopy(data)
    record = data
    for key in at:
        record = record[key]
    record.pop(without, None)
    if extra:
        record[extra] = "x"
    return data


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("ecm", ROOT / "tests/corpus/accepted/left_to_the_gate/ecm.yaml"),
        ("site", CORPUS / "site" / "table.yaml"),
    ],
    ids=str,
)
def test_both_refuse_an_unknown_field_anywhere_and_the_absence_of_any_that_is_required(
    name: str, path: Path
) -> None:
    data, schema = data_of(path), json_schema_of(name)
    assert decoded(Source("a", json.dumps(data)), name)[0]
    places = records(data, schema, schema)
    assert len({len(at) for at, _ in places}) > 2
    for at, required in places:
        cases = [(changed(data, at, extra="unheard_of"), "AE101")]
        cases += [(changed(data, at, without=field), "AE102") for field in required]
        for case, code in cases:
            assert not validator(name).is_valid(case), (at, code)
            assert code in decoded(Source("a", json.dumps(case)), name)[1], (at, code)


@pytest.mark.parametrize(
    ("at", "value"),
    [
        (("skills", "tidy", "risk"), "extreme"),
        (("skills", "tidy", "entry"), "skills.tidy"),
        (("skills", "tidy", "actuators"), "arm"),
        (("skills", "tidy", "actuators"), ["Arm"]),
        (("skills", "tidy", "timeout"), None),
        (("skills", "tidy", "timeout"), ["30 s"]),
        (("schema",), "aeros/ecm/3"),
        (("id",), "Tidy"),
        (("skills",), []),
        (("skills", "Tidy"), {}),
    ],
    ids=str,
)
def test_both_refuse_the_value(at: tuple[str, ...], value: Any) -> None:
    data = data_of(CORPUS / "accepted" / "left_to_the_gate" / "ecm.yaml")
    record = data
    for key in at[:-1]:
        record = record[key]
    record[at[-1]] = value
    assert not validator("ecm").is_valid(data)
    assert decoded(Source("a", json.dumps(data)), "ecm")[1] & FORM_CODES


def test_text_may_look_like_a_number_or_a_truth_value() -> None:
    data = data_of(CORPUS / "accepted" / "left_to_the_gate" / "ecm.yaml")
    assert data["skills"]["tidy"]["outcomes"]["tidied"]["effects"]["table_tidy"] is True
    data["version"] = 1.0
    assert validator("ecm").is_valid(data)
