from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import parser
from aeros.spec.expr import syntax as s
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.syntax import TextRange


def show(node: s.Node) -> str:
    """A fully bracketed prefix form, so that precedence shows."""
    match node:
        case s.NumberLiteral(value=value, unit=unit):
            return str(value) if unit.text == "1" else f"{value}:{unit.dimension}"
        case s.BooleanLiteral(value=value):
            return str(value).lower()
        case s.Name(text=text):
            return text
        case s.Attribute(base=base, name=name):
            return f"{show(base)}.{name.text}"
        case s.Index(base=base, index=index):
            return f"{show(base)}[{show(index)}]"
        case s.Call(function=function, arguments=arguments):
            return f"{function.text}({', '.join(map(show, arguments))})"
        case s.Unary(op=op, operand=operand):
            return f"({op} {show(operand)})"
        case s.Binary(op=op, left=left, right=right):
            return f"({op} {show(left)} {show(right)})"
        case s.Junction(op=op, operands=operands):
            return f"({op} {' '.join(map(show, operands))})"
        case s.ComparisonChain(operands=operands, ops=ops):
            rest = " ".join(f"{op} {show(operand)}" for op, operand in zip(ops, operands[1:], strict=True))
            return f"(chain {show(operands[0])} {rest})"
        case s.Membership(operand=operand, container=container, negated=negated):
            names = (
                container.text
                if isinstance(container, s.Name)
                else "{" + ", ".join(name.text for name in container) + "}"
            )
            return f"({'not-in' if negated else 'in'} {show(operand)} {names})"
        case s.IfElse(condition=condition, then=then, otherwise=otherwise):
            return f"(if {show(condition)} {show(then)} {show(otherwise)})"
        case s.Quantifier(kind=kind, body=body, index=index, set=set_):
            return f"({kind} {index.text} {set_.text} {show(body)})"
        case s.PastOperator(op=op, operands=operands, window=within):
            window = "" if within is None else f" {show(within)}"
            return f"({op}{window} {' '.join(map(show, operands))})"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("if a then x else y", "(if a x y)"),
        ("if if a then b else c then x else if d then y else z", "(if (if a b c) x (if d y z))"),
        ("a implies b implies c", "(implies a (implies b c))"),
        ("a or b implies c and d", "(implies (or a b) (and c d))"),
        ("a or b and not c or d", "(or a (and b (not c)) d)"),
        ("not not a", "(not (not a))"),
        ("once within 5 s a and b", "(and (once 5:s a) b)"),
        ("not once a", "(not (once a))"),
        ("previously historically within w not a", "(previously (historically w (not a)))"),
        ("a since within 2 s b or c", "(or (since 2:s a b) c)"),
        ("a and not b since c", "(and a (since (not b) c))"),
        ("once x < y", "(once (chain x < y))"),
        ("count within 60 s (a and b) <= 3", "(chain (count 60:s (and a b)) <= 3)"),
        ("count(a for j in J)", "(count j J a)"),
        ("not a == b", "(not (chain a == b))"),
        ("0 <= x < y != z", "(chain 0 <= x < y != z)"),
        ("p in cell", "(in p cell)"),
        ("p not in cell and a", "(and (not-in p cell) a)"),
        ("mode in {idle}", "(in mode {idle})"),
        ("mode not in {idle, stop}", "(not-in mode {idle, stop})"),
        ("a - b - c + d", "(+ (- (- a b) c) d)"),
        ("a + b * c / d", "(+ a (/ (* b c) d))"),
        ("-a * --b", "(* (- a) (- (- b)))"),
        ("a - -1 mm", "(- a (- 1/1000:m))"),
        ("-p.x", "(- p.x)"),
        ("q[j].x[if a then j else k]", "q[j].x[(if a j k)]"),
        ("f()", "f()"),
        ("f(a, b + c)", "f(a, (+ b c))"),
        ("(a or b) and c", "(and (or a b) c)"),
        ("all(any(a for j in J) for k in K)", "(all k K (any j J a))"),
        ("sum(q[j] for j in J) <= count(r[j] for j in J)", "(chain (sum j J q[j]) <= (count j J r[j]))"),
        ("true and false", "(and true false)"),
        ("1.5e1", "15"),
        (".5", "1/2"),
        ("5.", "5"),
        ("250mm/s", "1/4:m/s"),
        ("250 mm/s <= 50 %", "(chain 1/4:m/s <= 1/2:1)"),
        ("2 m * h_max", "(* 2:m h_max)"),
        ("2 m*h_max", "(* 2:m h_max)"),
        ("2 m/s/s_max", "(/ 2:m/s s_max)"),
        ("x\n\t+ 1", "(+ x 1)"),
    ],
)
def test_a_grammar_rule_reads(text: str, shown: str) -> None:
    assert show(parse(text)) == shown


@pytest.mark.parametrize(
    ("text", "underlined"),
    [
        ("  a + b  ", "a + b"),
        ("(a + b) * c", "(a + b) * c"),
        ("a * (b + c)", "a * (b + c)"),
        ("(a) <= (b)", "(a) <= (b)"),
        ("(a) and (b)", "(a) and (b)"),
        ("(a) implies (b)", "(a) implies (b)"),
        ("(p).x", "(p).x"),
        ("(q)[(j)]", "(q)[(j)]"),
        ("not (a)", "not (a)"),
        ("-(a)", "-(a)"),
        ("(p) in cell", "(p) in cell"),
        ("(m) not in { i, k }", "(m) not in { i, k }"),
        ("if (a) then (b) else (c)", "if (a) then (b) else (c)"),
        ("( f(a) )", "f(a)"),
        (" all(a for j in J)", "all(a for j in J)"),
    ],
)
def test_a_node_spans_what_was_written_brackets_included(text: str, underlined: str) -> None:
    extent = parse(text).extent
    assert text[extent.start : extent.end] == underlined


def test_parts_keep_spans_of_their_own() -> None:
    node = parse("(speed + 1 m) <= limit")
    assert isinstance(node, s.ComparisonChain)
    assert [operand.extent for operand in node.operands] == [TextRange(1, 12), TextRange(17, 22)]


@pytest.mark.parametrize(
    ("text", "message", "extent"),
    [
        ("", "expected a value, but the expression ends here", (0, 0)),
        ("a +", "expected a value, but the expression ends here", (3, 3)),
        ("a b", "expected an operator or the end of the expression, but found `b`", (2, 3)),
        ("(a", "expected `)`, but the expression ends here", (2, 2)),
        ("a)", "expected an operator or the end of the expression, but found `)`", (1, 2)),
        ("if a then b", "expected `else`, but the expression ends here", (11, 11)),
        ("if a b", "expected `then`, but found `b`", (5, 6)),
        ("a not b", "expected `in`, but found `b`", (6, 7)),
        ("m in {}", "expected a member, but found `}`", (6, 7)),
        ("m in 3", "expected the name of a volume, or members in braces, but found `3`", (5, 6)),
        ("p.3", "expected an operator or the end of the expression, but found `.3`", (1, 3)),
        ("p.and", "expected a component, but found `and`", (2, 5)),
        ("all(a)", "expected `for`, but found `)`", (5, 6)),
        ("all(a for 1 in J)", "expected the name of the index, but found `1`", (10, 11)),
        ("all(a for j in)", "expected the name of a set, but found `)`", (14, 15)),
        ("f(a,)", "expected a value, but found `)`", (4, 5)),
        ("a = b", "unexpected character `=`", (2, 3)),
        ("a & b", "unexpected character `&`", (2, 3)),
        ("٣ < 4", "unexpected character `٣`", (0, 1)),
        ("3 mmm", "`mmm` is not a unit", (2, 5)),
        ("1e5000", "expected an operator or the end of the expression, but found `0`", (5, 6)),
        ("a\u200b", "unexpected character `\u200b`", (1, 2)),
    ],
)
def test_a_syntax_error_states_the_expected_token_and_the_place(
    text: str, message: str, extent: tuple[int, int]
) -> None:
    with pytest.raises(ExpressionSyntaxError) as raised:
        parse(text)
    assert raised.value.message == message
    assert raised.value.extent == TextRange(*extent)


@pytest.mark.parametrize(
    ("text", "cure"),
    [("a = b", "`==`"), ("a | b", "`or`"), ("!a", "`not`"), ("a ≤ b", "`<=`"), ("x^2", "`x * x`")],
)
def test_a_foreign_operator_is_answered_with_ours(text: str, cure: str) -> None:
    with pytest.raises(ExpressionSyntaxError) as raised:
        parse(text)
    assert cure in (raised.value.help or "")


_HOSTILE = {
    "100 000 characters": "a" * 100_000,
    "10 000 brackets": "(" * 10_000 + "a" + ")" * 10_000,
    "2000 brackets": "(" * 2000 + "a" + ")" * 2000,
    "41 brackets": "(" * 41 + "a" + ")" * 41,
    "open brackets": "(" * 4000,
    "nots": "not " * 1000 + "a",
    "minuses": "-" * 4000 + "a",
    "ifs at the front": "if " * 1300,
    "ifs at the back": "if a then b else " * 200 + "c",
    "implications": "a implies " * 400 + "b",
    "calls": "f(" * 2000,
    "indices": "a[" * 2000,
    "quantifiers": "all(" * 1000,
    "a long sum": "+".join("a" * 2000),
    "a long product": "*".join("a" * 2000),
    "long component access": "a" + ".x" * 2000,
    "long indexing": "a" + "[j]" * 1300,
}


@pytest.mark.parametrize("text", _HOSTILE.values(), ids=_HOSTILE)
def test_hostile_text_is_a_syntax_error(text: str) -> None:
    with pytest.raises(ExpressionSyntaxError):
        parse(text)


@pytest.mark.parametrize(
    "text",
    [
        "(" * 39 + "a" + ")" * 39,
        "not " * 39 + "a",
        "+".join(["a"] * 100),
        " and ".join(["a"] * 600),
        "<".join("a" * 2000),
        "9" * 4000,
    ],
    ids=["brackets", "nots", "sum", "conjunction", "chain", "numeral"],
)
def test_large_but_allowed_text_parses(text: str) -> None:
    parse(text)


def test_a_numeral_is_exact() -> None:
    node = parse("0.1 deg")
    assert isinstance(node, s.NumberLiteral)
    assert node.value == Fraction(1, 10) * node.unit.factor


def test_limits_are_those_the_passes_are_tested_with() -> None:
    assert (parser.MAX_LENGTH, parser.MAX_DEPTH, parser.MAX_HEIGHT) == (4096, 40, 100)


@pytest.mark.parametrize("text", ["done >= count", "count", "count + 1 <= 2", "x in {count, idle}"])
def test_count_is_a_name_where_nothing_is_counted(text: str) -> None:
    assert "count" in repr(parse(text))


@pytest.mark.parametrize("text", ["count (c for j in S) >= 2", "count\nwithin 5 s (c) >= 2"])
def test_count_counts_before_a_bracket_and_before_a_window(text: str) -> None:
    assert "Name(text='count'" not in repr(parse(text))
