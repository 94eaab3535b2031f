"""Mistakes of skill code that need no run, and code that is right."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.obligations.skill_syntax.code_mistakes import first_code_mistake
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import Detail, verify
from tests.repo.tree import ROOT
from tests.reports_in_full import compare_with_section, shown

CORPUS = ROOT / "tests" / "corpus"
REPORTS = Path(__file__).parents[1] / "data" / "code_mistakes.txt"
HEAD = """from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
"""


MOVE = 'act("approach", pace=0.1)'
REST = f"\n\ndef rest() -> SkillBody:\n    yield {MOVE}\n"
SEEN = '\n\ndef rest(seen: Observation) -> float:\n    return 0.1 if seen["hands"] else 0.05\n'
NOTE = "\n\ndef note(seen: list[int]) -> None:\n    seen.append(1)\n"


def reported(
    folder: Path, body: str, case: str = "left_to_the_gate", head: str = HEAD
) -> tuple[Diagnostic, ...]:
    """The errors of a module of the corpus whose skill has this body."""
    module = shutil.copytree(CORPUS / "accepted" / case, folder / case)
    (module / "skills.py").write_text(head + body)
    report = verify([module], CORPUS / "site" / "table.yaml", detail=Detail.BRIEF)
    (found,) = report.modules
    return found.diagnostics


def test_a_text_that_is_no_member_of_its_enum_is_marked(tmp_path: Path) -> None:
    module = Path(
        shutil.copytree(CORPUS / "accepted" / "limit_of_each_tool", tmp_path / "limit_of_each_tool")
    )
    code = module / "skills.py"
    code.write_text(code.read_text().replace('tool="sponge"', 'tool="spong"'))
    (found,) = verify([module], CORPUS / "site" / "table.yaml", detail=Detail.BRIEF).modules
    (problem,) = found.diagnostics
    assert (problem.code, problem.help) == ("AE148", ("did you mean `sponge`?",))
    assert problem.primary is not None
    assert problem.primary.span.text == '"spong"'


@pytest.mark.parametrize(
    ("body", "code", "marked"),
    [
        (f"    {MOVE}\n    yield {MOVE}\n", "AE146", MOVE),
        (f"    rest()\n    yield {MOVE}\n{REST}", "AE146", "rest()"),
        (f'    if observed["hands"]:\n        yield {MOVE}\n', "AE147", '"hands"'),
        (f'    if observed.get("hands"):\n        yield {MOVE}\n', "AE147", '"hands"'),
        (f'    observed = yield {MOVE}\n    print(observed["hands"])\n', "AE147", '"hands"'),
        (f'    yield act("approach", pace=rest(observed))\n{SEEN}', "AE147", '"hands"'),
        ('    yield act("approach", pace=inputs["pace"])\n', "AE147", '"pace"'),
        (f'    yield {MOVE}\n    return {{"tall": 0.1}}\n', "AE147", '"tall"'),
        ('    yield act("approach")\n', "AE149", 'act("approach")'),
        ('    yield Action("approach", {})\n', "AE149", 'Action("approach", {})'),
        ('    yield act("approach", pace=0.21)\n', "AE148", 'act("approach", pace=0.21)'),
        ('    yield act("approach", pace=6)\n', "AE148", "6"),
        ('    yield act("approach", pace=5)\n', "AE148", 'act("approach", pace=5)'),
        ('    yield act("approach", pace="slow")\n', "AE148", '"slow"'),
        ('    yield act("approach", pace=1e999)\n', "AE148", "1e999"),
        ('    yield act("approach", pace=None)\n', "AE148", "None"),
        ('    yield act("approach", pace=(0.1, 0.1))\n', "AE148", "(0.1, 0.1)"),
        ('    yield act("approach", pace=-0.1)\n', "AE148", "-0.1"),
        ('    yield act("approach", pace=0.2)\n', "AE148", 'act("approach", pace=0.2)'),
        ('    yield act("approach", pace=PACE)\n\n\nPACE = 0.21\n', "AE148", 'act("approach", pace=PACE)'),
        ('    yield act("approach", pace=PACE)\n\n\nPACE: float = 6\n', "AE148", "PACE"),
        ('    yield act("approach", pace=PACE)\n\n\nPACE = "slow"\n', "AE148", "PACE"),
    ],
)  # fmt: skip
def test_a_mistake_is_marked_where_it_is(tmp_path: Path, body: str, code: str, marked: str) -> None:
    found = reported(tmp_path, body)
    assert (code, marked) in [(one.code, one.primary.span.text) for one in found if one.primary]
    lines = [line for one in found for line in shown(one)]
    compare_with_section(REPORTS, repr(body), "\n".join(lines) + "\n")


@pytest.mark.parametrize(
    "body",
    [
        '    yield act("approach", pace=0.1)\n',
        '    yield act("approach", pace=0)\n',
        '    if observed["person_near"] or observed.get("hand"):\n        yield act("approach", pace=0.1)\n',
        # The name is something else then.
        '    observed = {"hands": 1}\n    yield act("approach", pace=0.1 * observed["hands"])\n',
        '    yield act("approach", pace=sum([observed["hands"] for observed in ({"hands": 0.1},)]))\n',
        # The value is not written out.
        '    pace = 3 * 0.1\n    yield act("approach", pace=pace)\n',
        # The name has more than one value.
        '    yield act("approach", pace=PACE)\n\n\nPACE = 0.21\nPACE = 0.1\n',
        '    PACE = 0.1\n    yield act("approach", pace=PACE)\n\n\nPACE = 0.21\n',
        '    yield act("approach", **{"pace": 0.1})\n',
        f"    yield from rest()\n{REST}",
        # A function without a yield of its own does its work when it is called.
        f"    note([])\n    yield {MOVE}\n{NOTE}",
    ],
)
def test_code_that_may_be_right_is_not_reported(tmp_path: Path, body: str) -> None:
    found = {one.code for one in reported(tmp_path, body)}
    assert found & {"AE146", "AE147", "AE148", "AE149"} == set()


@pytest.mark.parametrize(
    ("target", "marked"),
    [
        ("(0.1, 0.0, 0.6)", 'act("move", target=(0.1, 0.0, 0.6), speed=0.1)'),
        ("(0.1, -0.375, 0.1)", None),
        ("(0.1, -0.4, 0.1)", 'act("move", target=(0.1, -0.4, 0.1), speed=0.1)'),
        ("(0.1, 0.0, 2.5)", "(0.1, 0.0, 2.5)"),
        ("(0.1, 0.0)", "(0.1, 0.0)"),
        ("(0.1, 0.0, True)", "(0.1, 0.0, True)"),
        ("HOME", 'act("move", target=HOME, speed=0.1)'),
        ("(0.1, LEFT, 0.1)", 'act("move", target=(0.1, LEFT, 0.1), speed=0.1)'),
    ],
)
def test_a_place_that_is_written_out_is_judged_by_the_envelope(
    tmp_path: Path, target: str, marked: str | None
) -> None:
    body = f'    yield act("move", target={target}, speed=0.1)\n\n\nHOME = (0.0, 0.0, -0.1)\nLEFT = -0.41\n'
    found = reported(tmp_path, body, "bound_in_other_units")
    marks = [one.primary.span.text for one in found if one.primary and one.code == "AE148"]
    assert marks == ([] if marked is None else [marked])
    if marked is not None:
        compare_with_section(
            REPORTS, repr(body), "".join(f"{line}\n" for one in found for line in shown(one))
        )


def test_a_parameter_that_is_written_out_is_judged_beside_one_that_is_not(tmp_path: Path) -> None:
    body = '    yield act("move", target=observed["hand"], speed=6)\n'
    (found,) = reported(tmp_path, body, "bound_in_other_units")
    assert (found.code, found.primary and found.primary.span.text) == ("AE148", "6")


BARE = "from aeros.skill import Models, act\n\n\ndef tidy(observed, inputs):\n"
WITH_MODELS = BARE.replace("observed, inputs", "observed, inputs, models: Models")


@pytest.mark.parametrize(
    ("case", "head", "body", "marked"),
    [
        ("left_to_the_gate", BARE, f'    yield {MOVE}\n    print(observed["hands"])\n', '"hands"'),
        ("left_to_the_gate", BARE, f'    yield {MOVE}\n    print(inputs["pace"])\n', '"pace"'),
        (
            "models_with_an_interface",
            WITH_MODELS,
            '    yield act("wait", duration=models["calm"])\n',
            '"calm"',
        ),
        (
            "models_with_an_interface",
            WITH_MODELS,
            '    yield act("wait", duration=models["patience"].run(dirt=0.5)["duraton"])\n',
            '"duraton"',
        ),
    ],
)
def test_a_key_is_known_by_the_place_of_its_parameter_and_a_model_by_its_annotation(
    tmp_path: Path, case: str, head: str, body: str, marked: str
) -> None:
    found = [one for one in reported(tmp_path, body, case, head) if one.code == "AE147"]
    assert [one.primary.span.text for one in found if one.primary] == [marked]
    compare_with_section(REPORTS, repr(body), "".join(f"{line}\n" for one in found for line in shown(one)))


def test_the_own_state_of_a_module_is_known_by_its_short_name_alone(tmp_path: Path) -> None:
    case = "measures_its_own_predicate"
    own, full = (f'    if observed["{name}"]:\n        yield {MOVE}\n' for name in ("clean", f"{case}.clean"))
    codes = {one.code for one in reported(tmp_path / "own", own, case)}
    assert "AE147" not in codes
    assert "AE147" in {one.code for one in reported(tmp_path / "full", full, case)}


def test_a_camera_is_known_by_the_name_that_the_module_gives_it() -> None:
    place = load_site(reference_site_path(), Diagnostics())
    assert place is not None
    loaded = load_ecm(ROOT / "ecms" / "inspect_table", place, Diagnostics())
    assert loaded is not None
    ecm = loaded.ecm
    assert ecm.names.cameras["mast"] == "table_side"
    code = Path(ecm.folder, "skills.py").read_text()

    def mistakes(text: str) -> list[Diagnostic]:
        files = {"skills.py": SkillFile("skills.py", text.encode())}
        whole = place.with_modules(ecm.with_owners)
        found = [first_code_mistake(one, ecm, whole, files) for one in ecm.skills.values()]
        return [one for one in found if one is not None]

    assert mistakes(code) == []
    reported = mistakes(code.replace('camera="mast"', 'camera="mats"'))
    assert {(one.code, one.help) for one in reported} == {("AE148", ("did you mean `mast`?",))}
