from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text import yaml_reader
from aeros.spec.text.files import MAX_BYTES, read_source
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.yaml_reader import MAX_DEPTH, read_yaml
from tests.unit.spec.text.reading import accepted, check_offsets, value_of


def refused(text: str) -> list[Diagnostic]:
    """Return the diagnostics of a text that must be refused."""
    sink = Diagnostics()
    assert read_yaml(Source("a.yaml", text), sink) is None
    assert sink.has_errors
    return list(sink)


def underlined(found: Diagnostic) -> str:
    assert found.primary is not None
    return found.primary.span.text


def plain(node: Node) -> object:
    if isinstance(node, ScalarNode):
        return node.text
    if isinstance(node, SequenceNode):
        return [plain(item) for item in node.items]
    return {key.text: plain(item) for key, item in node.entries}


def spans(node: Node) -> list[tuple[int, int]]:
    below: list[Node] = []
    if isinstance(node, SequenceNode):
        below = list(node.items)
    elif isinstance(node, MappingNode):
        below = [part for entry in node.entries for part in entry]
    return [(node.span.start, node.span.end), *(span for part in below for span in spans(part))]


@pytest.fixture(params=["C", "pure"])
def _either_loader(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "pure":
        monkeypatch.setattr(yaml_reader, "_LOADER", yaml.SafeLoader)


# --- what is read


@pytest.mark.usefixtures("_either_loader")
def test_values_stay_the_text_that_was_written() -> None:
    node = accepted("a: no\nb: 1.10\nc: 12:30:00\nd: [x, {e: ~}]\nf: 'q''r'\n")
    assert plain(node) == {"a": "no", "b": "1.10", "c": "12:30:00", "d": ["x", {"e": "~"}], "f": "q'r"}


@pytest.mark.usefixtures("_either_loader")
def test_spans_are_tight_around_keys_values_and_collections() -> None:
    text = "é: b  # c\nlist:\n- x\n- y\n\nflow: [1, {k: v} ]\nblock: |\n  line\n\nend: p\n  q\n"
    node = accepted(text)
    assert isinstance(node, MappingNode)
    assert [key.span.text for key, _ in node.entries] == ["é", "list", "flow", "block", "end"]
    assert [value.span.text for _, value in node.entries] == [
        "b",
        "- x\n- y",
        "[1, {k: v} ]",
        "|\n  line",
        "p\n  q",
    ]
    assert node.span.text == text.rstrip()


def test_null_is_plain_and_never_quoted() -> None:
    for text in ("a:", "a: ~", "a: null"):
        assert value_of(text).is_null
    for text in ("a: ''", "a: 'null'", "a: nil"):
        assert not value_of(text).is_null


def test_windows_line_ends_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a: b\r\nc: d\r\n")
    source = read_source(path)
    node = read_yaml(source, Diagnostics())
    assert node is not None
    assert plain(node) == {"a": "b", "c": "d"}
    assert isinstance(node, MappingNode)
    assert node.entries[1][0].span.text == "c"


# --- what is refused


@pytest.mark.usefixtures("_either_loader")
@pytest.mark.parametrize(
    ("text", "code", "marked"),
    [
        ("a: 1\nb: 2\na: 3\n", "AE001", "a"),
        ("a: 1\n'a': 3\n", "AE001", "'a'"),
        ("{a: 1, a: 2}", "AE001", "a"),
        ("a: b\x00c", "AE005", "\x00"),
        ("a: \x1b[31m", "AE005", "\x1b"),
        ("a: b\u2028c", "AE005", "\u2028"),
        ("a: b\x85c", "AE005", "\x85"),
        ("a: b\u202ec", "AE005", "\u202e"),
        ("a: b\u200bc", "AE005", "\u200b"),
        ("a\u00ad: b", "AE005", "\u00ad"),
        ("a:\u00a0b", "AE005", "\u00a0"),
        ("# \U000e0041", "AE005", "\U000e0041"),
        ('a: "\\u200b"', "AE005", '"\\u200b"'),
        ("a: b\rc: d", "AE005", "\r"),
        ("a: \ud800", "AE005", "\ud800"),
        ('a: "\\e[31m"', "AE005", '"\\e[31m"'),
        ("", "AE006", ""),
        ("# only a comment\n", "AE006", ""),
        ("a:\n\tb: c\n", "AE008", "\t"),
        ("\ta: b\n", "AE008", "\t"),
        ("a: 'x\nb: c\n", "AE009", "'"),
        ('a: "x\n', "AE009", '"'),
        ("a: &x b\nc: *x\n", "AE011", "&x"),
        ("a: *x\n", "AE011", "*x"),
        ("a: &x [b]\n", "AE011", "&x"),
        ("a: !!python/object/apply:os.system [ls]\n", "AE012", "!!python/object/apply:os.system"),
        ("a: !!int 3\n", "AE012", "!!int"),
        ("a: ! 3\n", "AE012", "!"),
        ("a: b\n---\nc: d\n", "AE013", "---"),
        ("? [a]\n: b\n", "AE014", "[a]"),
        ("{{a: b}: c}", "AE014", "{a: b}"),
        ("? \n: b\n", "AE014", ""),
        ("~: b\n", "AE014", "~"),
        ("<<: {a: b}\n", "AE015", "<<"),
        ("%YAML 1.1\n---\na: b\n", "AE016", "%YAML 1.1\n---"),
        ("a: b: c\n", "AE007", ":"),
        ("a: `x`\n", "AE007", "`"),
        ("a: [1, 2\nb: c\n", "AE007", ":"),
        ("a: @x\n", "AE007", "@"),
    ],
)
def test_refused_text_is_underlined(text: str, code: str, marked: str) -> None:
    first = refused(text)[0]
    assert (first.code, underlined(first)) == (code, marked)


@pytest.mark.parametrize("text", ["a: [1, 2\nb: c\n", "a: {require: all(q[w] for w in s), b: c}\n"])
def test_a_bracket_in_a_text_is_to_be_closed_or_quoted(text: str) -> None:
    (first, *_) = refused(text)
    assert first.help == ("close the bracket, or quote a text that holds brackets, braces or commas",)


def test_a_duplicate_key_shows_both_places_and_each_further_one() -> None:
    found = refused("a: 1\na: 2\na: 3\n")
    assert [(d.primary.span.line, d.secondary[0].span.line) for d in found if d.primary] == [(2, 1), (3, 1)]


def test_problems_that_do_not_stop_reading_are_all_reported() -> None:
    assert [d.code for d in refused("a: &x 1\na: !!str 2\n<<: *x\n")] == [
        "AE011",
        "AE001",
        "AE012",
        "AE015",
        "AE011",
    ]


def test_depth_is_allowed_up_to_the_limit_and_not_beyond() -> None:
    accepted("[" * MAX_DEPTH + "]" * MAX_DEPTH)
    assert refused("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1))[0].code == "AE010"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("[" * 100_000, "AE010"),
        ("{a: " * 100_000, "AE010"),
        ("[a: " * 100_000, "AE010"),
        ("- " * 500_000, "AE010"),
        ("? " * 500_000, "AE010"),
        ("\n".join(" " * depth + "a:" for depth in range(1_400)), "AE010"),
        ("[" + "[]," * 349_000 + "]", "AE017"),
        ("- a\n" * 260_000, "AE017"),
        ("a:\n" * 349_000, "AE001"),
        ("- &a b\n" * 149_000, "AE011"),
        ("- !t b\n" * 149_000, "AE012"),
        ("[" + "!t," * 300_000 + "]", "AE012"),
        ('"' + "\\\n" * 500_000, "AE009"),
        ("'" + "a" * 1_000_000, "AE009"),
        ("---\n" * 260_000, "AE013"),
        ("\t" * 1_000_000, "AE008"),
        ("\x00" * 1_000_000, "AE005"),
        ("%" * 1_000_000, "AE007"),
        ("x" * (MAX_BYTES + 1), "AE003"),
    ],
)
def test_a_hostile_text_is_refused(text: str, code: str) -> None:
    assert code in {found.code for found in refused(text)}


@given(st.binary(max_size=400))
def test_no_bytes_make_reading_raise_anything_but_a_user_error(data: bytes) -> None:
    with tempfile.NamedTemporaryFile() as file:
        file.write(data)
        file.flush()
        try:
            source = read_source(file.name)
        except UserError:
            return
    sink = Diagnostics()
    assert (read_yaml(source, sink) is None) == sink.has_errors


SCRAPS = [
    *("a", "b", "é", "日", " ", "  ", "\n", "\n  ", "\r\n", ": ", ":", "- ", "? ", "[", "]", "{", "}", ","),
    *(
        "&x",
        "*x",
        "!",
        "!!str ",
        "|",
        ">",
        "|2-",
        ">+",
        "'",
        '"',
        "\\",
        "\\u0041",
        "#",
        " #",
        "\t",
        "%",
        "<<",
        "~",
    ),
    *("---\n", "...\n", "\ufeff", "\u2028", "@", "`"),
]
YAMLISH = st.lists(st.sampled_from(SCRAPS), max_size=40).map("".join)


@given(st.one_of(YAMLISH, st.text(max_size=100)))
def test_no_text_makes_reading_raise_and_none_means_refused(text: str) -> None:
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_reader, "_LOADER", loader)
            sink = Diagnostics()
            node = read_yaml(Source("a.yaml", text), sink)
        assert (node is None) == sink.has_errors
        if node is not None:
            check_offsets(node)


@given(YAMLISH)
def test_both_loaders_give_the_same_nodes_when_both_accept(text: str) -> None:
    nodes = []
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_reader, "_LOADER", loader)
            nodes.append(read_yaml(Source("a.yaml", text), Diagnostics()))
    if nodes[0] is not None and nodes[1] is not None:
        assert plain(nodes[0]) == plain(nodes[1])


def test_no_forbidden_character_is_one_that_writing_needs() -> None:
    for text in ("a: b\n", "a: é 日本 😀 ½ μ°", "a: naïve — “quoted” ≤ ∀"):
        accepted(text)
