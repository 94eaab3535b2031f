from __future__ import annotations

import hashlib
import re
import tomllib
from typing import Any

import aeros
from aeros.cli.exit_codes import Exit
from tests.repo.tree import ROOT, text_of

_PROJECT: dict[str, Any] = tomllib.loads(text_of("pyproject.toml"))


def test_the_licence_is_the_whole_apache_2_0_unchanged() -> None:
    # The digest of https://www.apache.org/licenses/LICENSE-2.0.txt.
    expected = "cfc7749b96f63bd31c3c42b5c471bf756814053e847c10f3eb003417bc523d30"
    assert hashlib.sha256((ROOT / "LICENSE").read_bytes()).hexdigest() == expected
    assert _PROJECT["project"]["license"] == "Apache-2.0"


def test_what_is_needed_at_run_time_is_part_of_the_package() -> None:
    # Hatchling packs every file of the package that git does not ignore, and the pages of the codes.
    assert _PROJECT["tool"]["hatch"]["build"]["targets"] == {
        "wheel": {"packages": ["aeros"], "force-include": {"docs/codes": "aeros/docs/codes"}}
    }
    ignored = text_of(".gitignore").split()
    for needed in ("py.typed", "sites/panda_cell.yaml", "schemas/report.json", "sim/models/wrapper.urdf"):
        path = ROOT / "aeros" / needed
        assert path.is_file()
        assert not {path.name, f"*{path.suffix}", f"{path.parent.name}/"} & set(ignored)


def test_the_solver_is_pinned_exactly() -> None:
    (pin,) = (one for one in _PROJECT["project"]["dependencies"] if one.startswith("z3-solver"))
    assert re.fullmatch(r"z3-solver==[\d.]+", pin)


def test_the_changelog_speaks_of_what_is_not_yet_released() -> None:
    text = text_of("CHANGELOG.md")
    assert "## [Unreleased]" in text
    released = re.findall(r"^## \[(\d[^\]]*)\]", text, re.MULTILINE)
    assert not released or released[0] == aeros.__version__


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
