"""Files of behaviour trees: lines, and what is refused before anything is expanded."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from aeros.apps.trees import tree_xml
from aeros.apps.trees.tree_xml import TreeFileError, parse_tree, read_tree_file, read_tree_files

BOMB = b"""<?xml version="1.0"?>
<!DOCTYPE root [
  <!ENTITY a "aaaaaaaaaa">
  <!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
]>
<root>&b;</root>
"""
OUTSIDE = b'<!DOCTYPE root SYSTEM "file:///etc/passwd"><root/>'


def test_elements_have_their_lines() -> None:
    root = parse_tree(
        b'<root>\n  <BehaviorTree ID="A">\n\n    <Sequence/>\n  </BehaviorTree>\n</root>', "a.xml"
    )
    (tree,) = root.children
    (sequence,) = tree.children
    assert (root.line, tree.line, sequence.line) == (1, 2, 4)
    assert (tree.attributes, sequence.path) == ({"ID": "A"}, "a.xml")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (BOMB, "a.xml:2: declares a document type or entities; remove the declaration"),
        (OUTSIDE, "a.xml:1: declares a document type or entities; remove the declaration"),
        (b"", "a.xml:1: is not well-formed XML: no element found"),
        (b"\x00\xff\x13", "a.xml:1: is not well-formed XML"),
        (b"<root>\n<a></root>", "a.xml:2: is not well-formed XML: mismatched tag"),
        (b"<root>&lost;</root>", "a.xml:1: is not well-formed XML: undefined entity"),
        (b'<?xml version="1.0" encoding="ebcdic-xx"?><root/>', "a.xml:1:"),
        (b"<a>" * 300, "a.xml:1: nested more than 200 deep; use subtrees"),
        (b"<r>\n" + b"<a/>" * tree_xml.MAX_ELEMENTS, "a.xml:2: more than 10000 elements; split the file"),
        (b'<r a="1 < 2"/>', "a.xml:1: is not well-formed XML: not well-formed (invalid token); text in attr"),
        (b"<a/>" + b" " * tree_xml.MAX_BYTES, "a.xml:1: larger than 10 MB; split the file"),
    ],
    ids=[
        "entities",
        "outside",
        "empty",
        "binary",
        "mismatched",
        "undefined",
        "encoding",
        "deep",
        "wide",
        "less",
        "large",
    ],
)
def test_a_file_that_is_no_tree_is_refused_with_its_line(content: bytes, message: str) -> None:
    with pytest.raises(TreeFileError) as caught:
        parse_tree(content, "a.xml")
    assert message in str(caught.value)


def test_included_files_are_read_once(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text('<root>\n<include path="b.xml"/>\n<include path="./b.xml"/></root>')
    (tmp_path / "b.xml").write_text('<root><include path="a.xml"/></root>')
    found = read_tree_files([tmp_path / "a.xml", tmp_path / "b.xml"])
    assert [Path(one.path).name for one in found] == ["a.xml", "b.xml"]
    (tmp_path / "b.xml").unlink()
    with pytest.raises(TreeFileError, match=r"a.xml:2: includes .*b.xml:1: cannot be read: No such file"):
        read_tree_files([tmp_path / "a.xml"])
    (tmp_path / "c.xml").write_text('<root><include ros_pkg="p" path="b.xml"/></root>')
    with pytest.raises(TreeFileError, match="a file of a ROS package"):
        read_tree_files([tmp_path / "c.xml"])


def test_an_include_that_is_no_regular_file_is_refused_at_its_line(tmp_path: Path) -> None:
    (tmp_path / "loop.xml").symlink_to("loop.xml")
    os.mkfifo(tmp_path / "pipe.xml")
    (tmp_path / "folder.xml").mkdir()
    file = tmp_path / "a.xml"
    for name in ("loop.xml", "pipe.xml", "folder.xml"):
        file.write_text(f'<root>\n<include path="{name}"/></root>')
        with pytest.raises(TreeFileError, match=rf"a.xml:2: .*{name}.* cannot be read: "):
            read_tree_files([file])


def test_more_files_than_allowed_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree_xml, "MAX_FILES", 2)
    for number in range(4):
        (tmp_path / f"{number}.xml").write_text(f'<root><include path="{number + 1}.xml"/></root>')
    with pytest.raises(TreeFileError, match="more than 2 files are included"):
        read_tree_files([tmp_path / "0.xml"])


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TreeFileError, match="cannot be read"):
        read_tree_file(tmp_path)
    with pytest.raises(TreeFileError, match="its name is not a path"):
        read_tree_file(Path("a\0b"))
