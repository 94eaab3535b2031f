from __future__ import annotations

import hashlib
import re
import subprocess
import tomllib
from collections.abc import Iterable, Iterator
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import aeros
from aeros.distribution import NAME
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT, text_of

_PROJECT: dict[str, Any] = tomllib.loads(text_of("pyproject.toml"))
_TOWNCRIER: dict[str, Any] = tomllib.loads(text_of("towncrier.toml"))["tool"]["towncrier"]


def test_the_licence_is_the_whole_apache_2_0_unchanged() -> None:
    # The digest of https://www.apache.org/licenses/LICENSE-2.0.txt.
    expected = "cfc7749b96f63bd31c3c42b5c471bf756814053e847c10f3eb003417bc523d30"
    assert hashlib.sha256((ROOT / "LICENSE").read_bytes()).hexdigest() == expected
    assert _PROJECT["project"]["license"] == "Apache-2.0"


def test_files_needed_at_run_time_are_part_of_the_package() -> None:
    # Hatchling packs every file of the package that git does not ignore, and folders beside it.
    beside = {
        "docs/codes": "aeros/docs/codes",
        "experiments": "aeros/experiments/data",
        "ecms": "aeros_reference/ecms",
        "proofs": "aeros_reference/proofs",
    }
    assert _PROJECT["tool"]["hatch"]["build"]["targets"] == {
        "wheel": {"packages": ["aeros"], "force-include": beside}
    }
    ignored = text_of(".gitignore").split()
    for needed in ("py.typed", "sites/panda_cell.yaml", "schemas/report.json", "scenes/bare.yaml"):
        path = ROOT / "aeros" / needed
        assert path.is_file()
        assert not {path.name, f"*{path.suffix}", f"{path.parent.name}/"} & set(ignored)


def test_the_solver_is_pinned_exactly() -> None:
    (pin,) = (one for one in _PROJECT["project"]["dependencies"] if one.startswith("z3-solver"))
    assert re.fullmatch(r"z3-solver==[\d.]+", pin)


def test_the_changelog_begins_with_this_version() -> None:
    notes = text_of("CHANGELOG.md").split(_TOWNCRIER["start_string"])[1]
    assert re.findall(r"^## \[(\d[^\]]*)\]", notes, re.MULTILINE)[0] == aeros.__version__


def test_changelog_fragments_are_named_after_an_issue_and_a_kind() -> None:
    kinds = "|".join(one["directory"] for one in _TOWNCRIER["type"])
    folder = ROOT / _TOWNCRIER["directory"]
    for path in folder.iterdir():
        assert path.name in _TOWNCRIER["ignore"] or re.fullmatch(rf"(\d+|\+[\w-]+)\.({kinds})\.md", path.name)


def test_the_citation_names_this_version() -> None:
    citation = yaml.safe_load(text_of("CITATION.cff"))
    assert (citation["version"], citation["license"]) == (aeros.__version__, _PROJECT["project"]["license"])


def test_one_place_says_where_the_repository_is() -> None:
    repository = _PROJECT["project"]["urls"]["Repository"]
    owner = repository.removeprefix("https://github.com/").removesuffix("/aeros")
    assert re.fullmatch(r"[\w-]+", owner)
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in files.stdout.split("\0"):
        path = ROOT / name
        if (
            name
            and name != "pyproject.toml"
            and path.suffix in {".cff", ".md", ".py", ".toml", ".yaml", ".yml"}
        ):
            text = path.read_text(encoding="utf-8", errors="replace")
            named = re.findall(r"github\.com/([\w-]+)/aeros\b|\buses: ([\w-]+)/aeros@", text)
            assert {one or other for one, other in named} <= {owner}, name


def test_no_text_tells_to_install_somebody_elses_package() -> None:
    """On PyPI `aeros` is another project; the distribution is not there yet: extras come from the clone."""
    assert _PROJECT["project"]["name"] == NAME
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in files.stdout.split("\0"):
        path = ROOT / name
        if path.suffix in {".cff", ".md", ".py", ".template", ".toml", ".yaml", ".yml", ".in", ".txt"}:
            text = path.read_text(encoding="utf-8", errors="replace")
            assert not re.findall(r"\baeros\[|\b(?:pip|pipx|uv|uvx) [^\n`]*[ '\"]aeros(?![\w/.-])", text), (
                name
            )
            assert not re.findall(r"pip install ['\"]?aeros-robot\[[\w,]+\]['\"]?(?! @)", text), name


def _locked(name: str) -> dict[str, list[str]]:
    """Versions of a lock file by package, whose hashes are checked to be there."""
    found: dict[str, list[str]] = {}
    text = text_of(f"requirements/{name}.txt")
    assert not re.search(r"://|--(index|extra-index|find-links|trusted-host)", text), "a lock names no host"
    for entry in re.findall(r"^\w.*(?:\n +--hash.*)+", text, re.MULTILINE):
        pinned = Requirement(entry.splitlines()[0].rstrip(" \\"))
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry)
        (version,) = pinned.specifier
        assert version.operator == "=="
        found.setdefault(canonicalize_name(pinned.name), []).append(version.version)
    assert len(re.findall(r"^\w", text, re.MULTILINE)) == sum(map(len, found.values()))
    return found


def _required(extras: Iterable[str], groups: Iterable[str] = ()) -> Iterator[Requirement]:
    project = _PROJECT["project"]
    texts = [one for extra in extras for one in project["optional-dependencies"][extra]]
    texts += [one for group in groups for one in _PROJECT["dependency-groups"][group]]
    for one in map(Requirement, texts + ([] if groups else project["dependencies"])):
        if one.name == NAME:
            yield from _required(one.extras)
        else:
            yield one


@pytest.mark.parametrize(
    ("locks", "extras", "groups"),
    [
        (("install", "simulator"), ("sim",), ()),
        (("test", "simulator"), ("test",), ()),
        (("tools",), (), ("tools",)),
    ],
    ids=lambda one: "-".join(one) or "none",
)
def test_the_locks_hold_what_the_project_needs(
    locks: tuple[str, ...], extras: tuple[str, ...], groups: tuple[str, ...]
) -> None:
    """`make lock` renews them."""
    locked = {name: versions for lock in locks for name, versions in _locked(lock).items()}
    for one in _required(extras, groups):
        versions = locked[canonicalize_name(one.name)]
        assert all(one.specifier.contains(version) for version in versions), one


def test_the_locks_agree_with_each_other() -> None:
    test = _locked("test")
    for lock in ("install", "tools"):
        for name, versions in _locked(lock).items():
            assert set(versions) <= set(test.get(name, versions)), name
    assert _locked("uv") == {"uv": _locked("tools")["uv"]}


def test_ci_runs_what_a_person_runs() -> None:
    commands = [line for line in text_of(".ci/run").splitlines() if line and not line.startswith("#")]
    assert commands == ["set -euo pipefail", 'cd "$(dirname "${BASH_SOURCE[0]}")/.."', "make test"]
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111
    assert "run: .ci/run" in text_of(".github/workflows/ci.yml")


def test_every_module_folder_is_a_module() -> None:
    for folder in (path for path in (ROOT / "ecms").iterdir() if path.is_dir() and path.name[0] not in "._"):
        assert (folder / "ecm.yaml").is_file(), folder
        assert (folder / "ecm.lock").is_file(), folder


def test_exit_codes_are_documented() -> None:
    rows = dict(re.findall(r"^\| (\d+) \| (.+?) \|", text_of("docs/exit-codes.md"), re.MULTILINE))
    assert {int(code) for code in rows} == {code.value for code in Exit}
