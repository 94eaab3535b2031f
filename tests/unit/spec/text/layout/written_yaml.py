"""Random YAML as people write it: every indentation, blank lines, comments and styles, nested anyhow."""

from __future__ import annotations

from random import Random

_WORDS = ("a", "length", "0.5 m", "[not closed", "it's", "# no comment", "é", "x: y", "long " * 12, "- z")
_COMMENTS = ("# note", "#", "#tight", "#  {a: [b", "# 'é' - ? :")


def write_yaml(random: Random) -> str:
    """Write a random mapping.

    Args:
        random: source of all choices.

    Returns:
        Text that is YAML; mostly of the part that AEROS reads.
    """
    text = _gap(random, 0) + _mapping(random, 0, 3) + _gap(random, 0)
    if random.random() < 0.1:
        text = f"# first\n--- # begin\n{text}"
    if random.random() < 0.1:
        text = text.rstrip("\n")
    return text.replace("\n", "\r\n") if random.random() < 0.1 else text


def _gap(random: Random, indent: int) -> str:
    """Blank lines and comments before something at a column."""
    lines = random.choices(("", "  ", "#"), k=random.choice((0, 0, 0, 1, 2, 3)))
    columns = (indent, indent, indent + 1, indent + 2, max(indent - 2, 0), 0)
    return "".join(
        (" " * random.choice(columns) + random.choice(_COMMENTS) if line == "#" else line) + "\n"
        for line in lines
    )


def _end(random: Random) -> str:
    return random.choice(("", "", "", "", " ", "  # end", f" {random.choice(_COMMENTS)}")) + "\n"


def _mapping(random: Random, indent: int, depth: int, first: str = "") -> str:
    """A block mapping; `first` stands before its first key, such as a dash."""
    text = ""
    for number in range(random.choice((1, 2, 2, 3))):
        before = first if number == 0 and first else _gap(random, indent) + " " * indent
        key = f"{random.choice(('k', 'a key', 'ключ'))}{number}"
        key = random.choice((key, key, f'"{key}"', f"'{key}'"))
        sign = random.choice((":", ":", ":", " :"))
        if random.random() < 0.05:
            before, sign = f"{before}? ", f"\n{' ' * indent}:"
        text += before + key + sign + _value(random, indent, depth, is_item=False)
    return text


def _sequence(random: Random, indent: int, depth: int, first: str = "") -> str:
    text = ""
    for number in range(random.choice((1, 2, 3))):
        before = first if number == 0 and first else _gap(random, indent) + " " * indent
        text += f"{before}-" + _value(random, indent, depth, is_item=True)
    return text


def _value(random: Random, indent: int, depth: int, *, is_item: bool) -> str:
    """A value after a colon or a dash, with the end of its last line."""
    kinds = ["word", "flow", "absent", "text", "block text"] + ["mapping", "sequence"] * (2 if depth else 0)
    kind = random.choice(kinds)
    inner = indent + random.choice((1, 2, 2, 4))
    if kind == "absent":
        return _end(random)
    if kind in ("mapping", "sequence"):
        write = _mapping if kind == "mapping" else _sequence
        if is_item and random.random() < 0.6:
            space = " " * random.choice((1, 1, 3))
            return write(random, indent + 1 + len(space), depth - 1, space)
        if kind == "sequence" and not is_item and random.random() < 0.4:
            inner = indent
        return _end(random) + write(random, inner, depth - 1)
    if kind == "block text":
        return _block_text(random, indent)
    begin = " " * random.choice((1, 1, 2))
    if random.random() < 0.3:
        begin = _end(random) + _gap(random, inner) + " " * inner
    content = {"word": _word, "flow": _flow}[kind](random) if kind != "text" else _long_text(random, inner)
    if kind == "flow" and random.random() < 0.3:
        content = content.replace(", ", random.choice((",\n", ", # c\n")) + " " * inner, 1)
    return begin + content + _end(random)


def _word(random: Random) -> str:
    word = random.choice(_WORDS)
    plain = random.choice(("a", "length", "0.5 m", "-1", "true", "x y", "é", "word " * 20 + "word"))
    return random.choice((plain, plain, '"' + word + '"', "'" + word.replace("'", "''") + "'"))


def _flow(random: Random, depth: int = 3) -> str:
    """A collection in brackets on one line."""
    size = random.choice((0, 1, 2, 3, 9))
    space = random.choice(("", "", " "))
    comma = random.choice((", ", ", ", ",  ", " , "))
    end = random.choice(("", "", ",")) if size else ""
    parts = [
        _flow(random, depth - 1) if depth and random.random() < 0.4 else _word(random) for _ in range(size)
    ]
    if random.random() < 0.5:
        return f"[{space}{comma.join(parts)}{end}{space}]"
    keys = (random.choice((f"k{number}", f'"k {number}"')) for number in range(size))
    pairs = [
        key if random.random() < 0.1 else f"{key}: {part}" for key, part in zip(keys, parts, strict=True)
    ]
    return f"{{{space}{comma.join(pairs)}{end}{space}}}"


def _long_text(random: Random, inner: int) -> str:
    """A plain or quoted text over several lines."""
    join = random.choice(("\n", "\n", "  \n", "\n\n"))
    lines = random.choices(("one two", "three", "x" * 50, "end."), k=random.choice((2, 3)))
    text = (join + " " * inner).join(lines)
    quote = random.choice(("", '"', "'"))
    if quote == '"' and random.random() < 0.3:
        text = text.replace("\n", "\\\n")
    return quote + text + quote


def _block_text(random: Random, indent: int) -> str:
    sign = random.choice("|>") + random.choice(("", "-", "+"))
    inner = indent + random.choice((1, 2, 4))
    if random.random() < 0.2:
        sign = f"{sign[0]}{inner - indent}{sign[1:]}"
    lines = ["first", *random.choices(("one", "  more", "# text", "", "a: b "), k=random.choice((0, 1, 3)))]
    body = "".join(f"{' ' * inner}{line}\n" if line else "\n" for line in lines)
    return f" {sign}{random.choice(('', '', ' # head'))}\n{body}"
