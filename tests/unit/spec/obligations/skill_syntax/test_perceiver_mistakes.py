"""Mistakes of perceiver code that need no run, and code that is right."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.spec.verification.verify import Detail, verify
from tests.repo.tree import ROOT
from tests.reports_in_full import compare_with_section, shown

CORPUS = ROOT / "tests" / "corpus"
REPORTS = Path(__file__).parents[1] / "data" / "perceiver_mistakes.txt"


@pytest.mark.parametrize(
    ("case", "old", "new", "marked"),
    [
        ("measures_its_own_predicate", '"overhead"', '"overhaed"', '"overhaed"'),
        ("measures_its_own_predicate", "    while", '    view.readings["hands"]\n    while', '"hands"'),
        ("measures_its_own_predicate", "    while", '    view.samples.get("level")\n    while', '"level"'),
        ("measures_its_own_predicate", "    while", '    view.samples.get("hand")\n    while', None),
        ("models_with_an_interface", '["tent"]', '["tend"]', '"tend"'),
        ("models_with_an_interface", "    while", '    view.samples["hand"]\n    while', '"hand"'),
        ("models_with_an_interface", '"height": height', '"heihgt": height', '"heihgt"'),
        ("models_with_an_interface", "run(x=", "run(z=", "z=(brightness / 100,)"),
        ("models_with_an_interface", '["y"]', '["q"]', '"q"'),
        ("models_with_an_interface", "    while", '    view.pictures.get("overhead")\n    while', None),
    ],
)
def test_a_key_that_is_never_there_is_marked(
    tmp_path: Path, case: str, old: str, new: str, marked: str | None
) -> None:
    module = Path(shutil.copytree(CORPUS / "accepted" / case, tmp_path / case))
    code = module / "perceivers.py"
    assert old in code.read_text()
    code.write_text(code.read_text().replace(old, new, 1))
    (found,) = verify([module], CORPUS / "site" / "table.yaml", detail=Detail.BRIEF).modules
    texts = [one.primary.span.text for one in found.diagnostics if one.code == "AE147" and one.primary]
    assert texts == ([] if marked is None else [marked])
    lines = [line for one in found.diagnostics for line in shown(one)]
    compare_with_section(REPORTS, f"{case}: {old!r} becomes {new!r}", "".join(f"{line}\n" for line in lines))
