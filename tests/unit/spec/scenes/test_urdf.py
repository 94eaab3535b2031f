"""URDF files that a simulator would take and should not, each reported at its tag."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.scenes.urdf import check_urdf

GOOD = """<robot name="vase">
<link name="a"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="0.8"/></inertial>
<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision></link>
</robot>
"""


def problems(folder: Path, text: str) -> list[tuple[str, str, int, str]]:
    """Codes, headlines, lines, and the text underlined."""
    path = folder / "model.urdf"
    path.write_text(text)
    diagnostics = Diagnostics()
    check_urdf(path, diagnostics)
    found = []
    for one in diagnostics:
        assert one.primary is not None
        span = one.primary.span
        found.append((one.code, one.headline, span.line, span.source.text[span.start : span.end]))
    return found


def with_element(element: str) -> str:
    return GOOD.replace('<box size="0.1 0.2 0.3"/>', element)


def test_a_sound_model_has_no_problems(tmp_path: Path) -> None:
    assert problems(tmp_path, GOOD) == []


@pytest.mark.parametrize(
    ("element", "code", "headline"),
    [
        ('<box size="0.1 0.2"/>', "AE108", "`size` of `box` is 3 finite numbers, and not `0.1 0.2`"),
        ('<box size="1 2 3 4"/>', "AE108", "`size` of `box` is 3 finite numbers, and not `1 2 3 4`"),
        ('<box size="1 2 inf"/>', "AE108", "`size` of `box` is 3 finite numbers, and not `1 2 inf`"),
        ('<sphere radius="wide"/>', "AE108", "`radius` of `sphere` is a finite number, and not `wide`"),
        ('<sphere radius="nan"/>', "AE108", "`radius` of `sphere` is a finite number, and not `nan`"),
        ('<sphere radius="0"/>', "AE111", "`radius` of `sphere` is outside its bounds"),
        ('<capsule radius="1" length="-1"/>', "AE111", "`length` of `capsule` is outside its bounds"),
        ('<cylinder radius="1000001" length="1"/>', "AE111", "`radius` of `cylinder` is outside its bounds"),
        ('<origin xyz="0 0 -1000001"/>', "AE111", "`xyz` of `origin` is outside its bounds"),
        ('<color rgba="1 1 1"/>', "AE108", "`rgba` of `color` is 4 finite numbers, and not `1 1 1`"),
        ('<mass value=""/>', "AE108", "`value` of `mass` is a finite number, and not ``"),
    ],
)
def test_bad_numbers_are_reported_at_their_tag(
    element: str, code: str, headline: str, tmp_path: Path
) -> None:
    ((found, message, line, underlined),) = problems(tmp_path, with_element(element))
    assert (found, message, line, underlined) == (code, headline, 3, element)


@pytest.mark.parametrize(
    "element",
    [
        '<sphere radius="1e-6"/>',
        '<box size="1e6 1 1"/>',
        '<origin xyz="-1e6 0 1e6"/>',
        '<limit lower="-1" upper="0"/>',
        '<mesh filename="package://part.stl" scale="-1 1 1"/>',
        '<unheard size="of"/>',
        "<box/>",
    ],
)
def test_other_numbers_are_taken(element: str, tmp_path: Path) -> None:
    (tmp_path / "part.stl").touch()
    assert problems(tmp_path, with_element(element)) == []


@pytest.mark.parametrize("written", ['filename="absent.stl"', "", 'filename=""', 'filename="."'])
def test_a_missing_mesh_is_reported(written: str, tmp_path: Path) -> None:
    ((code, headline, line, _),) = problems(tmp_path, with_element(f"<mesh {written}/>"))
    assert (code, line) == ("AE002", 3)
    assert headline.startswith("there is no file `")
    assert headline.endswith("the `mesh` of this link")


@pytest.mark.parametrize(
    ("text", "headline", "line"),
    [
        ("", "not well-formed XML: no element found", 1),
        (GOOD.replace("</link>", ""), "not well-formed XML: mismatched tag", 4),
        (GOOD.replace("robot", "thing"), "the root element must be `robot`, not `thing`", 1),
        ("<robot></robot>", "a model has at least one `link`", 1),
        ("<!DOCTYPE robot>" + GOOD, "DOCTYPE is not allowed", 1),
    ],
)
def test_a_file_that_is_no_robot_model_is_reported(
    text: str, headline: str, line: int, tmp_path: Path
) -> None:
    found = problems(tmp_path, text)
    assert [(code, message, at) for code, message, at, _ in found] == [("AE141", headline, line)]


def test_a_document_type_is_underlined_from_its_start(tmp_path: Path) -> None:
    for written in ("<!DOCTYPE robot>", '<!DOCTYPE robot [ <!ENTITY a "b">'):
        end = "]>" if "ENTITY" in written else ""
        found = problems(tmp_path, f'<?xml version="1.0"?>\n{written}{end}{GOOD}')
        assert [(line, underlined) for _, _, line, underlined in found] == [(2, written)]


def test_a_model_without_a_link_is_underlined_from_its_start(tmp_path: Path) -> None:
    assert [one[3] for one in problems(tmp_path, '<robot name="a"/>')] == ['<robot name="a"/>']


def test_places_are_right_after_letters_of_several_bytes(tmp_path: Path) -> None:
    text = with_element('<box size="1"/>').replace("vase", "väse €")
    ((_, _, line, underlined),) = problems(tmp_path, text)
    assert (line, underlined) == (3, '<box size="1"/>')


def test_all_problems_are_reported_together(tmp_path: Path) -> None:
    text = with_element('<box size="1"/><sphere radius="-1"/><mesh filename="absent.stl"/>')
    assert [code for code, *_ in problems(tmp_path, text)] == ["AE108", "AE111", "AE002"]


def test_a_file_that_cannot_be_read_is_a_users_error(tmp_path: Path) -> None:
    with pytest.raises(UserError):
        check_urdf(tmp_path / "absent.urdf", Diagnostics())
