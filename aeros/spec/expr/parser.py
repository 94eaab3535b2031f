"""Parser from expression text to surface syntax.

Recursive descent. The docstring of each method of `_Parser` is its grammar rule.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.expr import syntax as s
from aeros.spec.expr.syntax import TextRange
from aeros.spec.expr.units import DIMENSIONLESS, Unit, match_unit, to_unit, unit_names

MAX_LENGTH = 4096  # characters: far beyond any rule a person can review
MAX_DEPTH = 40  # nesting of the recursive descent, a dozen stack frames each
MAX_HEIGHT = 100  # height of the syntax tree, a few stack frames each in the passes to come

_QUANTIFIERS = ("all", "any", "sum", "count")
_PAST = ("previously", "once", "historically")
_OPERATOR_WORDS = ("and", "else", "false", "for", "if", "implies", "in", "not", "or", "then", "true")
KEYWORDS = frozenset((*_OPERATOR_WORDS, *_QUANTIFIERS, *_PAST, "since", "within"))
NAMES_TOO = frozenset({"count"})
"""Keywords that are names where neither `(` nor `within` follows: things are often counted."""

_CALLED = re.compile(r"[ \t\n]*(?:\(|within\b)")
_TOKEN = re.compile(
    r"""(?P<space>[ \t\n]+)
      | (?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?)
      | (?P<word>[A-Za-z_][A-Za-z0-9_]*)
      | (?P<symbol><=|>=|==|!=|[-+*/<>()\[\]{},.])""",
    re.VERBOSE,
)
_COMPARISONS = ("<", "<=", "==", "!=", ">=", ">")


class ExpressionSyntaxError(Exception):
    """Text that is not an expression: `extent` says where, `help` what to do, if that is known."""

    def __init__(self, message: str, extent: TextRange, help_: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.extent = extent
        self.help = help_


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str  # number, word, keyword, symbol, end
    text: str
    extent: TextRange
    unit: Unit = DIMENSIONLESS


def parse(text: str) -> s.Node:
    """Parse an expression.

    Args:
        text: expression of at most `MAX_LENGTH` characters.

    Returns:
        Its syntax tree, at most `MAX_HEIGHT` high.

    Raises:
        ExpressionSyntaxError: the text is not an expression, is too long or is nested too deeply.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionSyntaxError(
            f"this expression has {len(text)} characters; {MAX_LENGTH} are allowed",
            TextRange(MAX_LENGTH, len(text)),
            "split it into several rules",
        )
    root = _Parser(_tokens(text)).parse_expression()
    _check_height(root)
    return root


def _check_height(root: s.Node) -> None:
    """Refuse trees that the later, recursive passes cannot walk; a long sum is as high as it is long.

    Raises:
        ExpressionSyntaxError: the tree is too high.
    """
    pending = [(root, 1)]
    while pending:
        node, height = pending.pop()
        if height > MAX_HEIGHT:
            raise _too_deep(node.extent)
        pending.extend((child, height + 1) for child in s.children(node))


def _too_deep(extent: TextRange) -> ExpressionSyntaxError:
    return ExpressionSyntaxError(
        "this expression is nested too deeply", extent, "split it into several rules"
    )


def _tokens(text: str) -> list[_Token]:
    tokens: list[_Token] = []
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise _unexpected_character(text, position)
        kind, end = match.lastgroup or "", match.end()
        if kind == "number":
            unit, end = _unit_after(text, end)
            tokens.append(_Token("number", match.group(), TextRange(position, end), unit))
        elif kind == "word":
            is_name = match.group() in NAMES_TOO and _CALLED.match(text, end) is None
            actual = "keyword" if match.group() in KEYWORDS and not is_name else "word"
            tokens.append(_Token(actual, match.group(), TextRange(position, end)))
        elif kind == "symbol":
            tokens.append(_Token("symbol", match.group(), TextRange(position, end)))
        position = end
    tokens.append(_Token("end", "", TextRange(len(text), len(text))))
    return tokens


def _unexpected_character(text: str, position: int) -> ExpressionSyntaxError:
    cures = {"=": "equality is written `==`", "&": "write `and`", "|": "write `or`", "!": "write `not`"}
    cures |= {"^": "write the product out, `x * x`", "≤": "write `<=`", "≥": "write `>=`"}
    character = text[position]
    return ExpressionSyntaxError(
        f"unexpected character `{character}`", TextRange(position, position + 1), cures.get(character)
    )


def _unit_after(text: str, end: int) -> tuple[Unit, int]:
    """Find the unit after a numeral and at most one blank, unless it is the head of a longer word."""
    start = end + 1 if text[end : end + 1] == " " else end
    if text[start : start + 1] in ("%", "°") or text[start : start + 1].isalpha():
        matched = match_unit(text, start)
        if matched is not None:
            return matched
    return DIMENSIONLESS, end


def _number(token: _Token) -> s.NumberLiteral:
    return s.NumberLiteral(token.unit.to_si(Fraction(token.text)), token.unit, token.extent)


class _Parser:
    def __init__(self, tokens: list[_Token]) -> None:
        self._tokens = tokens
        self._position = 0
        self._depth = 0

    def parse_expression(self) -> s.Node:
        """whole := expression end"""
        node = self._expression()
        if self._next.kind != "end":
            unknown_unit = _unknown_unit(self._tokens, self._position)
            raise unknown_unit or self._fault("expected an operator or the end of the expression")
        return node

    def _expression(self) -> s.Node:
        """expression := 'if' expression 'then' expression 'else' expression | implication"""
        if (start := self._accept("if")) is None:
            return self._with_depth(self._implication)
        condition = self._with_depth(self._expression)
        self._expect("then")
        then = self._with_depth(self._expression)
        self._expect("else")
        otherwise = self._with_depth(self._expression)
        return s.IfElse(condition, then, otherwise, self._text_since(start))

    def _implication(self) -> s.Node:
        """implication := disjunction ['implies' implication]"""
        start = self._next
        left = self._disjunction()
        if self._accept("implies") is None:
            return left
        right = self._with_depth(self._implication)
        return s.Binary("implies", left, right, self._text_since(start))

    def _disjunction(self) -> s.Node:
        """disjunction := conjunction ('or' conjunction)*"""
        return self._junction("or", self._conjunction)

    def _conjunction(self) -> s.Node:
        """conjunction := relation ('and' relation)*"""
        return self._junction("and", self._relation)

    def _junction(self, word: str, part: Callable[[], s.Node]) -> s.Node:
        start = self._next
        parts = [part()]
        while self._accept(word):
            parts.append(part())
        if len(parts) == 1:
            return parts[0]
        return s.Junction(word, tuple(parts), self._text_since(start))

    def _relation(self) -> s.Node:
        """relation := negation ['since' [window] negation]"""
        start = self._next
        left = self._negation()
        if self._accept("since") is None:
            return left
        within = self._window()
        right = self._negation()
        return s.PastOperator("since", (left, right), within, self._text_since(start))

    def _negation(self) -> s.Node:
        """negation := 'not' negation | past | comparison"""
        if self._next.text in _PAST:
            return self._past()
        if (start := self._accept("not")) is None:
            return self._comparison()
        operand = self._with_depth(self._negation)
        return s.Unary("not", operand, self._text_since(start))

    def _past(self) -> s.Node:
        """past := 'previously' negation | ('once' | 'historically') [window] negation"""
        start = self._advance()
        within = None if start.text == "previously" else self._window()
        operand = self._with_depth(self._negation)
        return s.PastOperator(start.text, (operand,), within, self._text_since(start))

    def _window(self) -> s.Node | None:
        """window := 'within' (number [unit] | name)"""
        if self._accept("within") is None:
            return None
        token = self._next
        if token.kind not in ("number", "word"):
            raise self._fault("expected a duration, as in `within 5 s`")
        self._advance()
        return _number(token) if token.kind == "number" else s.Name(token.text, token.extent)

    def _comparison(self) -> s.Node:
        """comparison := sum [['not'] 'in' container] | sum (('<'|'<='|'=='|'!='|'>='|'>') sum)*"""
        start = self._next
        first = self._sum()
        if (negation := self._accept("not")) is not None or self._next.text == "in":
            self._expect("in")
            container = self._container()
            return s.Membership(first, container, negation is not None, self._text_since(start))
        operands, ops = [first], []
        while self._next.kind == "symbol" and self._next.text in _COMPARISONS:
            ops.append(self._advance().text)
            operands.append(self._sum())
        if not ops:
            return first
        return s.ComparisonChain(tuple(operands), tuple(ops), self._text_since(start))

    def _container(self) -> s.Name | tuple[s.Name, ...]:
        """container := name | '{' name (',' name)* '}'"""
        if self._accept("{") is None:
            return self._name("the name of a volume, or members in braces")
        members = [self._name("a member")]
        while self._accept(","):
            members.append(self._name("a member"))
        self._expect("}")
        return tuple(members)

    def _sum(self) -> s.Node:
        """sum := product (('+' | '-') product)*"""
        start = self._next
        node = self._product()
        while token := self._accept("+") or self._accept("-"):
            node = s.Binary(token.text, node, self._product(), self._text_since(start))
        return node

    def _product(self) -> s.Node:
        """product := unary (('*' | '/') unary)*"""
        start = self._next
        node = self._unary()
        while token := self._accept("*") or self._accept("/"):
            node = s.Binary(token.text, node, self._unary(), self._text_since(start))
        return node

    def _unary(self) -> s.Node:
        """unary := '-' unary | postfix"""
        if (start := self._accept("-")) is None:
            return self._postfix()
        operand = self._with_depth(self._unary)
        extent = self._text_since(start)
        if isinstance(operand, s.NumberLiteral) and operand.unit.offset:  # −5 °C is no negative of 5 °C
            below = operand.unit.to_si(-to_unit(operand.value, operand.unit))
            return s.NumberLiteral(below, operand.unit, extent)
        return s.Unary("-", operand, extent)

    def _postfix(self) -> s.Node:
        """postfix := atom ('.' name | '[' expression ']')*"""
        start = self._next
        node = self._atom()
        while True:
            if self._accept("."):
                name = self._name("a component")
                node = s.Attribute(node, name, self._text_since(start))
            elif self._accept("["):
                index = self._expression()
                self._expect("]")
                node = s.Index(node, index, self._text_since(start))
            else:
                return node

    def _atom(self) -> s.Node:
        """atom := number [unit] | truth | quantifier | frequency | call | '(' expression ')'"""
        token = self._advance()
        if token.kind == "number":
            return _number(token)
        if token.text in ("true", "false"):
            return s.BooleanLiteral(token.text == "true", token.extent)
        if token.kind == "keyword" and token.text == "count" and self._next.text == "within":
            return self._frequency(token)
        if token.kind == "keyword" and token.text in _QUANTIFIERS:
            return self._quantifier(token)
        if token.kind == "word":
            name = s.Name(token.text, token.extent)
            return self._call(name) if self._accept("(") else name
        if token.text == "(":
            inner = self._expression()
            self._expect(")")
            return inner
        self._position -= 1
        raise self._fault("expected a value")

    def _quantifier(self, word: _Token) -> s.Node:
        """quantifier := ('all' | 'any' | 'sum' | 'count') '(' expression 'for' name 'in' name ')'"""
        self._expect("(")
        body = self._expression()
        self._expect("for")
        index = self._name("the name of the index")
        self._expect("in")
        members = self._name("the name of a set")
        end = self._expect(")").extent.end
        return s.Quantifier(word.text, body, index, members, TextRange(word.extent.start, end))

    def _frequency(self, word: _Token) -> s.Node:
        """frequency := 'count' window '(' expression ')'"""
        within = self._window()
        self._expect("(")
        body = self._expression()
        self._expect(")")
        return s.PastOperator("count", (body,), within, self._text_since(word))

    def _call(self, function: s.Name) -> s.Node:
        """call := name ['(' [expression (',' expression)*] ')']"""
        arguments: list[s.Node] = []
        if (close := self._accept(")")) is None:
            arguments.append(self._expression())
            while self._accept(","):
                arguments.append(self._expression())
            close = self._expect(")")
        return s.Call(function, tuple(arguments), TextRange(function.extent.start, close.extent.end))

    def _with_depth(self, rule: Callable[[], s.Node]) -> s.Node:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise _too_deep(self._next.extent)
        node = rule()
        self._depth -= 1
        return node

    def _text_since(self, start: _Token) -> TextRange:
        """Return the range of all text read from `start` on, including the brackets around operands."""
        return TextRange(start.extent.start, self._tokens[self._position - 1].extent.end)

    @property
    def _next(self) -> _Token:
        return self._tokens[self._position]

    def _advance(self) -> _Token:
        token = self._next
        self._position += 1
        return token

    def _accept(self, text: str) -> _Token | None:
        return self._advance() if self._next.text == text and self._next.kind != "number" else None

    def _expect(self, text: str) -> _Token:
        token = self._accept(text)
        if token is None:
            raise self._fault(f"expected `{text}`")
        return token

    def _name(self, what: str) -> s.Name:
        if self._next.kind != "word":
            raise self._fault(f"expected {what}")
        token = self._advance()
        return s.Name(token.text, token.extent)

    def _fault(self, expected: str) -> ExpressionSyntaxError:
        token = self._next
        instead = "the expression ends here" if token.kind == "end" else f"found `{token.text}`"
        return ExpressionSyntaxError(f"{expected}, but {instead}", token.extent)


def _unknown_unit(tokens: list[_Token], position: int) -> ExpressionSyntaxError | None:
    """Return the error for a word that stands after a bare number, in the place of its unit."""
    token, before = tokens[position], tokens[max(position - 1, 0)]
    if token.kind != "word" or before.kind != "number":
        return None
    if did_you_mean(token.text, KEYWORDS) is not None:  # a misspelt operator
        return None
    near = did_you_mean(token.text, unit_names())
    help_ = f"did you mean `{near}`?" if near else "write one as in `mm/s`, `N`, `rad` or `kg*m/s^2`"
    return ExpressionSyntaxError(f"`{token.text}` is not a unit", token.extent, help_)
