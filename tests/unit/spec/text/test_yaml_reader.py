from __future__ import annotations

import os
import random
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
from aeros.spec.text.scalar_positions import source_offsets, sub_span
from aeros.spec.text.yaml_reader import MAX_DEPTH, read_yaml


def refused(text: str) -> list[Diagnostic]:
    """Return the diagnostics of a text that must be refused."""
    sink = Diagnostics()
    assert read_yaml(Source("a.yaml", text), sink) is None
    assert sink.has_errors
    return list(sink)


def accepted(text: str) -> Node:
    sink = Diagnostics()
    node = read_yaml(Source("a.yaml", text), sink)
    assert list(sink) == []
    assert node is not None
    return node


def value_of(text: str) -> ScalarNode:
    """Return the value of the only key of a text."""
    node = accepted(text)
    assert isinstance(node, MappingNode)
    value = node.entries[0][1]
    assert isinstance(value, ScalarNode)
    return value


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


def test_windows_line_ends_and_a_byte_order_mark_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: b\r\nc: d\r\n")
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


# --- files


def refused_file(path: str | Path) -> Diagnostic:
    with pytest.raises(UserError) as raised:
        read_source(path)
    (found,) = raised.value.diagnostics
    return found


def test_a_path_that_is_no_regular_file_is_refused(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for path in (
        tmp_path / "missing.yaml",
        tmp_path,
        fifo,
        loop,
        "/dev/zero",
        "/dev/null",
        "a\0b",
        "a" * 5_000,
        "\ud800",
    ):
        assert refused_file(path).code == "AE002", path
    assert refused_file(tmp_path / "missing.yaml").headline.endswith(
        "cannot be read: no such file or directory"
    )
    assert refused_file(fifo).headline.endswith("cannot be read: it is not a regular file")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.touch(mode=0o000)
    assert refused_file(path).code == "AE002"


def test_only_the_allowed_part_of_a_huge_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    assert refused_file(path).code == "AE003"


def test_a_file_that_is_not_utf8_names_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes("é: b\nc: ".encode() + b"\xff\n")
    found = refused_file(path)
    assert found.code == "AE004"
    assert found.headline == "byte 9 (0xff) is not UTF-8"
    assert found.primary is not None
    assert (found.primary.span.line, found.primary.span.column) == (2, 4)


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
            _check_offsets(node)


@given(YAMLISH)
def test_both_loaders_give_the_same_nodes_when_both_accept(text: str) -> None:
    nodes = []
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_reader, "_LOADER", loader)
            nodes.append(read_yaml(Source("a.yaml", text), Diagnostics()))
    if nodes[0] is not None and nodes[1] is not None:
        assert plain(nodes[0]) == plain(nodes[1])


# --- places inside scalars


def _check_offsets(node: Node) -> None:
    """Wherever an offset is given, the character is written there, escaped or folded."""
    if isinstance(node, SequenceNode):
        for item in node.items:
            _check_offsets(item)
    elif isinstance(node, MappingNode):
        for key, item in node.entries:
            _check_offsets(key)
            _check_offsets(item)
    else:
        offsets = source_offsets(node)
        assert len(offsets) in (0, len(node.text))
        assert offsets == sorted(offsets)
        source = node.span.source.text
        for character, offset in zip(node.text, offsets, strict=False):
            if source[offset] not in "\\\r\n":
                assert source[offset] == character


LETTERS = [chr(code) for code in range(ord("α"), ord("ω"))] + list("abcdefgh日本語")


@st.composite
def scalars(draw: st.DrawFn) -> str:
    """A key and a scalar in which no letter is written twice, so that where it is written is certain."""
    letters = iter(random.Random(draw(st.integers(0, 99))).sample(LETTERS, len(LETTERS)))  # noqa: S311
    style = draw(st.sampled_from(["", "'", '"', "|", ">", "|-", ">+", "|2", ">1-"]))

    def word() -> str:
        return "".join(next(letters) for _ in range(draw(st.integers(1, 3))))

    words = [word() for _ in range(draw(st.integers(1, 8)))]
    if style == "" or style in "'\"":
        joints = [" ", "  ", "\n  ", " \n   ", "\n\n  ", " \r\n ", "\n \n\n  "]
        joints += ["''"] if style == "'" else []
        joints += ["\\n", "\\u0041", "\\\\", '\\"', "\\\n  ", " \\\n\n  ", "\\x41\\t"] if style == '"' else []
        body = words[0] + "".join(draw(st.sampled_from(joints)) + w for w in words[1:])
        edge = draw(st.sampled_from(["", " "])) if style else ""
        return f"key: {style}{edge}{body}{edge}{style}\nKEY: 1\n"
    indent = {"2": "  ", "1": " "}.get(style[1:2], draw(st.sampled_from([" ", "   "])))
    lead = draw(st.sampled_from(["", "  "])) if style[1:2] in ("1", "2") else ""
    joints = [
        "\n" + indent,
        "\n\n" + indent,
        "\n" + indent + "  ",
        "\r\n" + indent,
        "\n\n\n" + indent + " ",
        " ",
        "  ",
    ]
    body = lead + words[0] + "".join(draw(st.sampled_from(joints)) + w for w in words[1:])
    note = draw(st.sampled_from(["", "  # note"]))
    blank = draw(st.sampled_from(["", "\n"]))
    trail = draw(st.sampled_from(["", "\n", "\n\n\n"]))
    return f"key: {style}{note}\n{blank}{indent}{body}{trail}"


@given(scalars())
def test_every_letter_of_a_scalar_is_found_where_it_is_written(text: str) -> None:
    body = text.index(":")
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_reader, "_LOADER", loader)
            value = value_of(text)
        offsets = source_offsets(value)
        assert len(offsets) == len(value.text)
        for character, offset in zip(value.text, offsets, strict=True):
            if character in LETTERS:
                assert offset == text.rindex(character)
                assert offset > body


@pytest.mark.parametrize(
    ("text", "word", "written"),
    [
        ("r: speed <= reach\n", "reach", "reach"),
        ("r: speed\n  <= reach\n", "<= reach", "<= reach"),
        ("r: 'it''s <= reach'\n", "'s <=", "''s <="),
        ('r: "a \\u0062 <= c"\n', "b <=", "\\u0062 <="),
        ("r: >\n  speed\n  <= reach\n", "speed <=", "speed\n  <="),
        ("r: |\n    speed\n      <= reach\n", "  <= r", "  <= r"),
        ("r: |2\n    speed\n", "  speed", "  speed"),
    ],
)
def test_a_part_of_a_scalar_is_underlined_exactly(text: str, word: str, written: str) -> None:
    value = value_of(text)
    start = value.text.index(word)
    assert sub_span(value, start, start + len(word)).text == written


def test_the_end_of_a_scalar_is_a_place_and_an_impossible_part_is_the_whole() -> None:
    value = value_of("r: 'a +'\n")
    end = sub_span(value, 3, 3)
    assert (end.text, end.column) == ("", 8)
    assert sub_span(value, 2, 9) == value.span
    assert sub_span(value_of("r: ''"), 0, 0).text == "''"


def test_a_scalar_whose_text_cannot_be_found_has_no_offsets() -> None:
    value = value_of("r: abc\n")
    assert source_offsets(ScalarNode("abd", value.span)) == []


@pytest.mark.slow
def test_large_scalars_are_mapped() -> None:
    folded = "r: >\n" + "  a b\n" * 100_000
    plain_lines = "r: " + "a\n  " * 200_000
    escapes = 'r: "' + "\\x41 \n" * 100_000 + '"'
    blanks = "r: 'a" + " " * 1_000_000 + "b'"
    blank_lines = "r: |\n  a\n" + "\n" * 1_000_000
    for text in (folded, plain_lines, escapes, blanks, blank_lines):
        value = value_of(text)
        assert len(source_offsets(value)) == len(value.text)


def test_no_forbidden_character_is_one_that_writing_needs() -> None:
    for text in ("a: b\n", "a: é 日本 😀 ‍👩‍👩‍👧 ½ μ°", "a: naïve — “quoted” ≤ ∀"):
        accepted(text)
