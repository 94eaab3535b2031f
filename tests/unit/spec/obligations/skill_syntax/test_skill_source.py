"""Skill code is the program that Python runs, or it is refused."""

from __future__ import annotations

import ast
from itertools import product
from pathlib import Path

import pytest

from aeros.spec.obligations.skill_syntax.skill_source import SkillFile, UnreadableCodeError, read_skill_files
from tests.property.mix import Mix
from tests.reports_in_full import compare_with_section, shown

REPORTS = Path(__file__).parents[1] / "data" / "unreadable_code.txt"


def test_the_tree_its_nodes_and_its_functions_are_those_of_the_text() -> None:
    file = SkillFile("it/skills.py", b"def a():\n    pass\nclass B:\n    def c(self):\n        pass\n")
    assert file.source.path == "it/skills.py"
    assert list(file.functions) == ["a"]
    assert file.nodes == tuple(ast.walk(file.tree))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"\xef\xbb\xbfx = 1\n", "`skills.py` is not plain Python: it begins with a byte order mark"),
        (b"# coding: latin-1\n", "`skills.py` is not plain Python: it declares an encoding"),
        (b"\n \t# -*- coding=utf-8\n", "`skills.py` is not plain Python: it declares an encoding"),
        (b"x = '\xe9'\n", "`skills.py` is not plain Python: byte 5 is not UTF-8"),
        (b"x = 1\ny = (\n", "this is not Python: '(' was never closed"),
        (b"x = '\0'\n", "the character U+0000 (NULL) is not allowed: it is a control character"),
        (b"return 1\n", "this is not Python: 'return' outside function"),
        ("größe = 1\n".encode(), "the name `größe` is not written in ASCII"),
        ("ｌｅｎ = 1\n".encode(), "the name `ｌｅｎ` is not written in ASCII, and Python reads it as `len`"),
        ("# ok\nx = 1 # \u202e\n".encode(), "the character U+202E (RIGHT-TO-LEFT OVERRIDE) is not allowed"),
        ("ﬁn = 1\n".encode(), "the name `ﬁn` is not written in ASCII, and Python reads it as `fin`"),
        (b"x = " + b"-" * 150 + b"1\n", "the code is nested more than"),
        (b"x = " + b"(" * 300 + b")" * 300 + b"\n", "this is not Python: too many nested parentheses"),
    ],
)
def test_code_that_is_not_plain_python_is_refused(content: bytes, why: str) -> None:
    with pytest.raises(UnreadableCodeError) as raised:
        SkillFile("skills.py", content)
    assert str(raised.value).startswith(why)
    if not why.startswith("this is not Python"):  # in the words of the Python that runs
        lines = "".join(f"{line}\n" for line in shown(raised.value.diagnostic))
        compare_with_section(REPORTS, repr(content), lines)


@pytest.mark.parametrize(
    ("code", "line", "marked"),
    [
        ("x = 1\ny = (\n", 2, "("),
        ("x = 1\nreturn x\n", 2, "return x"),
        ("def f():\npass\n", 2, "pass"),
        ("x = 'a\n", 1, "'"),
        ("if x:\n", 1, ":"),
    ],
)
def test_a_syntax_error_is_marked_at_the_place_that_python_names(code: str, line: int, marked: str) -> None:
    with pytest.raises(UnreadableCodeError) as raised:
        SkillFile("skills.py", code.encode())
    found = raised.value.diagnostic
    assert found.code == "AE139"
    assert found.primary is not None
    assert (found.primary.span.line, found.primary.span.text) == (line, marked)


@pytest.mark.parametrize("line", [None, 0, 3])
def test_a_syntax_error_without_a_place_in_the_file_is_reported_without_one(
    line: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: str) -> ast.Module:
        raise SyntaxError("unheard of", ("<unknown>", line, 1, ""))

    monkeypatch.setattr(ast, "parse", refuse)
    with pytest.raises(UnreadableCodeError) as raised:
        SkillFile("skills.py", b"x = 1\n")
    found = raised.value.diagnostic
    assert (found.code, found.headline) == ("AE139", "`skills.py` is not Python: unheard of")
    assert found.primary is None


@pytest.mark.parametrize(
    ("error", "reason", "cure"),
    [
        (RecursionError(), "RecursionError", "split it up"),
        (MemoryError("too much\nof it"), "too much", "split it up"),
        (ValueError("odd\nmore"), "odd", "write it as plain UTF-8"),
    ],
)
def test_code_at_which_python_fails_is_refused_with_the_first_line_of_the_failure(
    error: Exception, reason: str, cure: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: str) -> ast.Module:
        raise error

    monkeypatch.setattr(ast, "parse", refuse)
    with pytest.raises(UnreadableCodeError) as raised:
        SkillFile("skills.py", b"x = 1\n")
    found = raised.value.diagnostic
    assert found.headline == f"`skills.py` is not plain Python: {reason}"
    assert found.help == (cure,)


@pytest.mark.parametrize("prefix", ["f", "F", "rf", "Fr"])
@pytest.mark.parametrize("quote", ["'", '"', '"""'])
def test_a_name_in_a_formatted_text_is_written_in_ascii(prefix: str, quote: str) -> None:
    with pytest.raises(UnreadableCodeError, match=r"the name `ｌ.*` is not written in ASCII") as raised:
        SkillFile("skills.py", f"x = {prefix}{quote}{{ｌｅｎ}}{quote}\n".encode())
    assert raised.value.diagnostic.code == "AE134"


@pytest.mark.parametrize("quote", ["'", '"', '"""'])
def test_a_text_may_begin_with_the_letter_of_a_format(quote: str) -> None:
    code = f"x = {quote}fｌ{quote}\n"
    assert SkillFile("skills.py", code.encode()).source.text == code


@pytest.mark.parametrize(
    "content", [b"", b"\n\n# coding: latin-1\n", b"x = 'coding: latin-1'\n", "x = 'é'".encode()]
)
def test_any_other_code_is_read(content: bytes) -> None:
    assert SkillFile("skills.py", content).source.text == content.decode()


def spans(code: str, kind: type[ast.AST]) -> list[str]:
    file = SkillFile("skills.py", code.encode())
    return [
        file.span(node).text
        for node in file.nodes
        if isinstance(node, kind) and isinstance(node, ast.expr | ast.stmt)
    ]


def test_a_node_is_located_from_its_beginning_to_its_end_or_the_end_of_its_line() -> None:
    assert spans("x = 1\nf(a, b)\n", ast.Call) == ["f(a, b)"]
    assert spans("  \nx = f(a,\n    b)  # more\n", ast.Call) == ["f(a,"]
    assert spans("if a:\n    b\n", ast.If) == ["if a:"]


def test_a_node_after_or_with_letters_of_several_bytes_is_located() -> None:
    assert spans("x = 'ü', f(a) + g(b)\n", ast.Call) == ["f(a)", "g(b)"]
    assert spans("x = f('äöü') + 1\n", ast.Call) == ["f('äöü')"]
    assert spans("'é'\n", ast.Expr) == ["'é'"]


@pytest.mark.parametrize(
    "path", ["more\u200bparts.py", "\u202esllixs.py", "a\x1b[2Jb.py", "a\nb.py", "x\x00/a.py"]
)
def test_a_file_name_that_shows_as_another_is_refused(path: str) -> None:
    (found,) = read_skill_files("it", {path: b"x = 1\n"}).values()
    assert isinstance(found, UnreadableCodeError)
    assert found.diagnostic is not None
    assert found.diagnostic.code == "AE005"
    assert "holds the character U+" in found.diagnostic.headline


def test_each_file_of_a_module_is_read_by_its_path() -> None:
    found = read_skill_files("it", {"skills.py": b"x = 1\n", "more/part.py": b"\xff"})
    good, bad = found["skills.py"], found["more/part.py"]
    assert isinstance(good, SkillFile)
    assert good.source.path == "it/skills.py"
    assert isinstance(bad, UnreadableCodeError)


@pytest.mark.filterwarnings("ignore::SyntaxWarning")
def test_code_is_refused_exactly_where_python_does_not_read_it() -> None:
    mix = Mix()
    for pieces in product(("x", " = ", "1", "(", ")", ":", "\n", "if ", "    "), repeat=4):
        code = "".join(pieces)
        try:
            compile(code, "skills.py", "exec")
            is_python = True
        except SyntaxError:
            is_python = False
        try:
            SkillFile("skills.py", code.encode())
            found = None
        except UnreadableCodeError as error:
            found = error.diagnostic.code
        assert found in (None, "AE139"), code
        mix.compare("AE139", proved=found is None, expected=is_python)
    mix.assert_both("AE139")
