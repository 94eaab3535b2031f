"""Diagrams in three formats: the same nodes and arrows, and text that is never markup."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.apps.drawings.drawing import Diagram, Edge, Node, Shape, dot, mermaid, svg
from tests.hypothesis_profiles import examples

HOSTILE = Diagram(
    'a "title" </title><script>',
    (Node("a", ('"]; end', "<b>&amp;</b>", "\x1b[31m\u202e"), "start"), Node("b", ("back\\slash",))),
    (Edge("a", "b", '"|<i>'), Edge("b", "a", "]]>"), Edge("b", "b", "again", dashed=True)),
)


def test_text_is_never_markup() -> None:
    tree = ET.fromstring(svg(HOSTILE))  # noqa: S314 - our own output
    assert {one.tag.rpartition("}")[2] for one in tree.iter()} == {
        *("svg", "title", "defs", "marker", "path", "rect", "text")
    }
    assert "".join(tree.itertext()).count("<b>&amp;</b>") == 1
    chart = mermaid(HOSTILE).split("flowchart TD\n")[1]
    assert "<b>" not in chart
    assert chart.count('"') == 2 * (2 + 3)
    for line in dot(HOSTILE).splitlines():
        assert len(re.findall(r'(?<!\\)(?:\\\\)*"', line)) in (0, 2)
    assert all("\x1b" not in drawn and "\u202e" not in drawn for drawn in (chart, dot(HOSTILE), svg(HOSTILE)))


SHAPES: tuple[Shape, ...] = ("step", "state", "start", "goal", "stuck", "choice", "bar")
EVERY = Diagram(
    "every shape",
    tuple(Node(f"n{number}", (shape,), shape) for number, shape in enumerate(SHAPES)),
    (Edge("n0", "n1"), Edge("n1", "n2", "a, b"), Edge("n2", "n2", "once more", dashed=True)),
)


def test_mermaid_has_a_bracket_for_each_shape_and_an_arrow_for_each_edge() -> None:
    assert mermaid(EVERY) == (
        '---\ntitle: "every shape"\n---\nflowchart TD\n'
        '  n0["step"]\n  n1("state")\n  n2(["start"])\n  n3[["goal"]]\n  n4{{"stuck"}}\n'
        '  n5{"choice"}\n  n6[/"bar"/]\n'
        '  n0 --> n1\n  n1 -->|"a, b"| n2\n  n2 -.->|"once more"| n2\n'
    )


def test_dot_has_a_style_for_each_shape_and_dashes_failures() -> None:
    assert dot(EVERY) == (
        'digraph "every shape" {\n  node [fontname=sans]; edge [fontname=sans];\n'
        '  n0 [shape=box, label="step"];\n'
        '  n1 [shape=box, style=rounded, label="state"];\n'
        '  n2 [shape=box, style=rounded, penwidth=2, label="start"];\n'
        '  n3 [shape=box, peripheries=2, label="goal"];\n'
        '  n4 [shape=octagon, label="stuck"];\n'
        '  n5 [shape=diamond, label="choice"];\n'
        '  n6 [shape=box, style=filled, fillcolor=gray85, height=0.2, label="bar"];\n'
        '  n0 -> n1 [label=""];\n  n1 -> n2 [label="a, b"];\n'
        '  n2 -> n2 [label="once more", style=dashed];\n}\n'
    )


def test_several_lines_and_special_characters_are_one_label() -> None:
    diagram = Diagram(
        "t",
        (
            Node(
                "a",
                ("one ≤ 2", 'a "b" \\'),
            ),
        ),
        (),
    )
    assert 'a["one #8804; 2<br/>a #34;b#34; #92;"]' in mermaid(diagram)
    assert r'label="one ≤ 2\na \"b\" \\"' in dot(diagram)


def shown(diagram: Diagram) -> ET.Element:
    return ET.fromstring(svg(diagram))  # noqa: S314 - our own output


def tops(diagram: Diagram) -> list[float]:
    """The upper edge of each node's box, in the order of the nodes."""
    return [float(one.get("y", "")) for one in shown(diagram).findall("{*}rect") if one.get("rx")]


SOLID, DASHED = False, True


def chain(*edges: tuple[str, bool], nodes: str = "abcd") -> Diagram:
    """Nodes by letter, and edges by two letters, solid or dashed."""
    boxes = tuple(Node(one, (one,)) for one in nodes)
    return Diagram("t", boxes, tuple(Edge(ends[0], ends[1], "", dashed) for ends, dashed in edges))


def test_a_box_is_as_large_as_its_text_and_lies_within_the_margins() -> None:
    tree = shown(Diagram("t", (Node("a", ("four", "xy"), "goal"),), ()))
    # 4 characters of 7.3 and 12 on each side; 2 lines of 18 and 12; margins of 28 and 22
    assert (tree.get("width"), tree.get("height")) == ("109", "92")
    ground, box = tree.findall("{*}rect")
    assert (ground.get("width"), ground.get("fill")) == ("109", "#fff")
    assert [box.get(name) for name in ("x", "y", "width", "height", "rx")] == ["28", "22", "53", "48", "12"]
    assert box.get("fill") == "#e6f4ea"
    # around the centre at 46, half a line up and down, and 4 down to the base line
    assert [(one.text, one.get("x"), one.get("y")) for one in tree.findall("{*}text")] == [
        ("four", "55", "41"),
        ("xy", "55", "59"),
    ]


def test_a_step_has_sharper_corners() -> None:
    tree = shown(chain(nodes="a"))
    assert [one.get("rx") for one in tree.findall("{*}rect")][1:] == ["2"]


def test_a_label_has_a_ground_of_its_own_width() -> None:
    tree = shown(Diagram("t", (Node("a", ("a",)), Node("b", ("b",))), (Edge("a", "b", "four"),)))
    (ground,) = [one for one in tree.findall("{*}rect") if one.get("height") == "16"]
    (label,) = [one for one in tree.findall("{*}text") if one.text == "four"]
    middle = float(label.get("x", ""))
    assert abs(float(ground.get("x", "")) - (middle - 14.6)) <= 1.0
    assert (ground.get("width"), ground.get("fill")) == ("29", "#fff")
    assert float(label.get("y", "")) - float(ground.get("y", "")) == 12.0


def test_only_failures_are_dashed_and_an_edge_without_label_has_no_text() -> None:
    tree = shown(chain(("ab", SOLID), ("ba", DASHED), nodes="ab"))
    dashes = [one.get("stroke-dasharray") for one in tree.findall("{*}path")]
    assert dashes == [None, "5 4"]
    assert [one.text for one in tree.findall("{*}text")] == ["a", "b"]


def test_an_arrow_is_vertical_where_it_starts_and_ends() -> None:
    tree = shown(chain(("ab", SOLID), nodes="ab"))
    (path,) = tree.findall("{*}path")
    numbers = [float(one) for one in re.findall(r"-?\d+", path.get("d", ""))]
    start, first, second, *_ = [(numbers[at], numbers[at + 1]) for at in range(0, len(numbers), 2)]
    end = numbers[-2:]
    assert start[0] == first[0]
    assert second[1] == first[1] == (start[1] + numbers[7]) / 2
    assert end[1] > start[1]


@pytest.mark.parametrize(
    ("diagram", "order"),
    [
        # each below its predecessors: the greatest distance counts where there is no cycle
        (chain(("ab", SOLID), ("bc", SOLID), ("ac", SOLID), nodes="abc"), [0, 1, 2]),
        # in a cycle, the least distance counts
        (
            chain(("ab", SOLID), ("bc", SOLID), ("cb", SOLID), ("ac", SOLID), nodes="abc"),
            [0, 1, 1],
        ),
        # a dashed arrow does not push down what a solid one reaches
        (chain(("ab", SOLID), ("bc", DASHED), ("ac", SOLID), nodes="abc"), [0, 1, 1]),
        # but it places what only it reaches
        (chain(("ab", SOLID), ("bc", DASHED), nodes="abc"), [0, 1, 2]),
        (chain(("ab", SOLID), ("bc", SOLID), ("ad", DASHED)), [0, 1, 2, 1]),
        # what nothing reaches comes last, one below the other
        (chain(("ab", SOLID), nodes="abcd"), [0, 1, 2, 3]),
        (chain(nodes="ab"), [0, 1]),
    ],
)
def test_nodes_lie_in_layers(diagram: Diagram, order: list[int]) -> None:
    found = tops(diagram)
    levels = sorted({*found})
    assert [levels.index(top) for top in found] == order


def test_the_start_is_on_top_wherever_it_is_listed() -> None:
    nodes = (Node("end", ("end",)), Node("begin", ("begin",), "start"))
    bottom, top = tops(Diagram("t", nodes, (Edge("begin", "end"),)))
    assert top < bottom


@examples(15)
@given(st.text(max_size=20), st.text(max_size=20))
def test_the_image_is_well_formed_for_all_texts(title: str, text: str) -> None:
    tree = shown(Diagram(title, (Node("a", (text,)),), (Edge("a", "a", text),)))
    assert len(tree.findall("{*}path")) == 1
