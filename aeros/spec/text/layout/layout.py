"""The one layout of a YAML file: indentation, blank lines, and lines of collections in brackets.

A mapping and a list are indented by 2 below their key. A collection in brackets stands on one line if it fits
there or on a line of its own, and is filled line by line if not. A comment moves with its line. Texts and
quotes stay as they are written. The rules are in docs/how-to/format-files.md.
"""

from __future__ import annotations

from typing import Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.layout import flow, scalars
from aeros.spec.text.layout.check import has_same_content
from aeros.spec.text.layout.gaps import Gap, column_origin, read_gap
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.yaml_reader import read_yaml

_STEP: Final = 2
_LONGEST_KEY: Final = 1000  # YAML 1.2, section 7.4.2: a key on one line has at most 1024 characters


class LayoutRefusedError(Exception):
    """File whose form has no layout here.

    Attributes:
        span: the place.
        reason: the reason, for people.
    """

    def __init__(self, span: SourceSpan, reason: str) -> None:
        super().__init__(span, reason)
        self.span = span
        self.reason = reason


def format_yaml(source: Source) -> str:
    """Lay out a YAML file.

    Args:
        source: text of the file.

    Returns:
        Text with the same values, styles and comments; the same text if that is its layout already.

    Raises:
        UserError: the text is no YAML that AEROS reads.
        LayoutRefusedError: a key is written over several lines, or beside a comment.
        InternalError: the layout would change a value or a comment.
    """
    source = Source(source.path, source.text.replace("\r\n", "\n"))
    diagnostics = Diagnostics()
    root = read_yaml(source, diagnostics)
    if root is None:
        raise UserError(diagnostics)
    text = _Layout(source).write(root)
    if not has_same_content(source.text, text):
        raise InternalError(f"the layout of `{source.path}` would change what it says")
    return text


class _Layout:
    """Writer of one file, from its first value to its last.

    Attributes:
        _levels: columns of the block collections that are open, in the file and in the layout, the outermost
            first; those that ended stay until the next entry begins, as a comment may belong to them.
        _fixed: number of lines to the end of the last block text, whose blank lines at the end may count.
        _ends_open: no line break may follow the last line.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._text = source.text
        self._at = 0
        self._lines: list[str] = []
        self._line = ""
        self._levels: list[tuple[int, int]] = []
        self._fixed = 0
        self._ends_open = False

    def write(self, root: Node) -> str:
        """Write the file.

        Args:
            root: its value.

        Returns:
            The text.

        Raises:
            LayoutRefusedError: a key has no layout.
            InternalError: something stands in the file where nothing can.
        """
        gap = read_gap(self._text, 0)
        if gap.end < root.span.start or flow.is_absent(root):
            self._write_marker(gap, "---")
        if _is_block(root):
            self._write_block(root, 0, 0)
        else:
            self._write_gap(read_gap(self._text, self._at), 0, 0)
            self._write_value(root, -_STEP, 0, parent=-1, is_below_key=True)
        gap = read_gap(self._text, self._at)
        while self._text.startswith("...", gap.end):
            self._write_marker(gap, "...")
            gap = read_gap(self._text, self._at)
        if gap.end < len(self._text):
            raise InternalError(f"the layout of `{self._source.path}` ends before the file does")
        self._write_gap(gap, 0, 0)
        self._end_line()
        while len(self._lines) > self._fixed and not self._lines[-1]:
            self._lines.pop()
        return "\n".join(self._lines) + ("" if self._ends_open else "\n")

    def _write_marker(self, gap: Gap, marker: str) -> None:
        """Write a line that begins or ends the document."""
        if not self._text.startswith(marker, gap.end):
            return
        self._write_gap(gap, 0, 0)
        self._line = marker
        self._at = gap.end + len(marker)
        self._levels.clear()

    def _end_line(self) -> None:
        if self._line:
            self._lines.append(self._line)
            self._line = ""

    def _write_gap(self, gap: Gap, depth: int, indent: int) -> None:
        """Write comments and blank lines before what follows, and begin a new line.

        A comment that is indented farther than what follows belongs to a collection that ended.
        """
        if gap.trailing:
            self._line += f" {gap.trailing}" if self._line else gap.trailing
        self._end_line()
        following = gap.end - column_origin(self._text, gap.end)
        if gap.end == len(self._text):
            following = 0
        ended = [one for one in self._levels[depth:] if one[0] > following]
        for line in gap.lines:
            if line.comment:
                # The deepest that it may be in, by its column; the first of all if it is between two columns.
                inner = [new for old, new in ended if old <= line.column]
                inner = inner or ([ended[0][1]] if ended and line.column > following else [])
                self._lines.append(" " * max([indent, *inner]) + line.comment)
            elif self._lines and self._lines[-1]:
                self._lines.append("")
        self._at = gap.end

    def _begin(self, depth: int, indent: int, *, is_inline: bool) -> None:
        """Begin an entry at the current place, or on a new line."""
        if not is_inline:
            self._write_gap(read_gap(self._text, self._at), depth, indent)
            self._line = " " * indent
        column = self._at - column_origin(self._text, self._at)
        self._levels[depth:] = [(column, indent)]

    def _write_block(self, node: Node, depth: int, indent: int, *, is_inline: bool = False) -> None:
        """Write a block collection.

        Args:
            node: the collection.
            depth: number of block collections around it.
            indent: its column.
            is_inline: it begins on the current line, as after `- `.
        """
        if isinstance(node, MappingNode):
            for number, (key, value) in enumerate(node.entries):
                self._begin(depth, indent, is_inline=is_inline and number == 0)
                self._write_key(key)
                self._write_value(value, indent, depth + 1, is_below_key=True)
        elif isinstance(node, SequenceNode):
            for number, item in enumerate(node.items):
                self._begin(depth, indent, is_inline=is_inline and number == 0)
                self._line += "-"
                self._at += 1
                self._write_value(item, indent, depth + 1, is_below_key=False)

    def _write_key(self, key: ScalarNode) -> None:
        """Write a key and its colon; one that is written with `?` is written without it.

        Raises:
            LayoutRefusedError: it is no short text on one line, or a comment is beside it.
        """
        start, end = key.span.start, key.span.end
        is_explicit = self._at < start
        if "\n" in key.span.text or len(key.span.text) > _LONGEST_KEY:
            raise LayoutRefusedError(key.span, "a key is one short text on one line")
        gap = read_gap(self._text, end)
        has_comment = gap.has_comment or "#" in self._text[self._at : start]
        has_colon = self._text.startswith(":", gap.end) and self._text[gap.end + 1 : gap.end + 2].isspace()
        has_colon = has_colon or (self._text.startswith(":", gap.end) and gap.end + 1 == len(self._text))
        if is_explicit and has_comment:
            raise LayoutRefusedError(key.span, "a comment is beside a key that is written with `?`")
        self._line += key.span.text + ":"
        self._at = gap.end + 1 if has_colon or not is_explicit else end

    def _write_value(
        self, node: Node, indent: int, depth: int, *, is_below_key: bool, parent: int | None = None
    ) -> None:
        """Write the value of a key or an item, after its sign.

        Args:
            node: the value.
            indent: column of the collection around it.
            depth: number of block collections around it.
            is_below_key: False for an item of a list.
            parent: column of the collection around it in the file; by default of the entry that began last.
        """
        column = self._levels[-1][0] if parent is None else parent
        inner = indent + _STEP
        if flow.is_absent(node):
            self._levels[depth:] = [(column + 1, inner)]
            return
        gap = read_gap(self._text, self._at)
        if _is_block(node):
            is_inline = not is_below_key and not gap.has_comment
            if is_inline:
                self._line += " "
                self._at = gap.end
            self._write_block(node, depth, inner, is_inline=is_inline)
            return
        first_column = len(self._line) + (1 if self._line else 0)
        if gap.has_comment or self._starts_below(node, gap, first_column, is_below_key=is_below_key):
            bare = Gap(gap.trailing, tuple(one for one in gap.lines if one.comment), gap.end, gap.breaks_line)
            self._write_gap(bare, depth, inner)
            self._line = " " * inner
        elif self._line:
            self._line += " "
        self._at = gap.end
        if isinstance(node, ScalarNode):
            self._write_scalar(node, column, indent)
        elif isinstance(node, MappingNode | SequenceNode):
            self._write_in_brackets(node, inner)

    def _starts_below(self, node: Node, gap: Gap, column: int, *, is_below_key: bool) -> bool:
        """Tell if a value begins on a line of its own below its key.

        A text does if it is written there and would not fit beside the key; a mapping in brackets if it would
        not fit there. A list in brackets never does.
        """
        if not is_below_key or not self._line:
            return False
        if isinstance(node, ScalarNode):
            fits = "\n" not in node.span.text and column + len(node.span.text) <= flow.WIDTH
            return gap.breaks_line and node.style not in ("|", ">") and not fits
        if flow.must_stay(node):
            return gap.breaks_line
        return isinstance(node, MappingNode) and not flow.fits(node, column, self._comment_after(node))

    def _write_scalar(self, node: ScalarNode, column: int, indent: int) -> None:
        if node.style in ("|", ">"):
            block = scalars.lay_out_block_text(self._text, node, column, max(indent, 0))
            self._lines.append(self._line + block.header)
            self._lines += block.lines
            self._line = ""
            self._at = block.end
            self._fixed = len(self._lines)
            self._ends_open = block.keeps_end
            return
        first, *others = scalars.lay_out_flow_text(node, indent + _STEP)
        self._write_lines(first, others, node)

    def _write_in_brackets(self, node: MappingNode | SequenceNode, inner: int) -> None:
        column = len(self._line)
        if flow.must_stay(node):
            lines = flow.move_lines(node, column, max(inner - _STEP, 0))
        else:
            # Further lines of a list beside its key stand where it would begin on a line of its own.
            hang = inner if isinstance(node, SequenceNode) and column > inner else column + 1
            lines = flow.lay_out(node, column, hang, self._comment_after(node))
        self._write_lines(lines[0], lines[1:], node)

    def _comment_after(self, node: Node) -> str:
        comment = read_gap(self._text, node.span.end).trailing
        return f" {comment}" if comment else ""

    def _write_lines(self, first: str, others: list[str], node: Node) -> None:
        self._line += first
        for line in others:
            self._lines.append(self._line)
            self._line = line
        self._at = node.span.end


def _is_block(node: Node) -> bool:
    return not isinstance(node, ScalarNode) and not flow.is_in_brackets(node)
