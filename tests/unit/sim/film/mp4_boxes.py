"""An MP4 file with a comment and no picture, written by hand."""

from __future__ import annotations


def box(name: bytes, content: bytes, *, is_long: bool = False) -> bytes:
    """Return a box; a long one has its length in eight bytes."""
    length = 8 + len(content)
    if is_long:
        return (1).to_bytes(4, "big") + name + (length + 8).to_bytes(8, "big") + content
    return length.to_bytes(4, "big") + name + content


def film_bytes(comment: str, *, is_long: bool = False) -> bytes:
    """Return a file with a comment."""
    data = box(b"data", b"\0\0\0\1\0\0\0\0" + comment.encode())
    items = box(b"ilst", box(b"\xa9too", b"x") + box(b"\xa9cmt", data))
    meta = box(b"meta", b"\0\0\0\0" + box(b"hdlr", b"mdir") + items)
    return (
        box(b"ftyp", b"isom")
        + box(b"mdat", b"pictures", is_long=is_long)
        + box(b"moov", box(b"mvhd", b"") + box(b"udta", meta))
    )
