"""The comparison of a file before and after notices every value and every comment."""

from __future__ import annotations

import pytest

from aeros.spec.text.layout.check import comments_of, has_same_content

_TEXT = "a: [b, 'c'] # one\nd: >-\n  e\n  # f\n# two\n"


@pytest.mark.parametrize(
    "after",
    [
        "a:   [ b,\n 'c' ]  # one\n\nd: >-\n    e\n    # f\n# two",
        "a: # one\n  [b, 'c']\nd: >-\n  e\n  # f\n# two\n",
    ],
)
def test_spaces_and_line_breaks_are_no_content(after: str) -> None:
    assert has_same_content(_TEXT, after)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# one", ""),
        ("# one", "# onee"),
        ("# two", "  # two"),
        ("'c'", "c"),
        ("'c'", '"c"'),
        ("[b, 'c']", "\n  - b\n  - 'c'"),
        ("b, 'c'", "'c', b"),
        (">-", "|-"),
        (">-", ">"),
        ("d:", "dd:"),
        ("a: [b", "a: [[b"),
        ("# one", "# two"),
    ],
)
def test_each_change_of_content_is_noticed(old: str, new: str) -> None:
    assert not has_same_content(_TEXT, _TEXT.replace(old, new))


def test_comments_are_found_outside_texts_alone() -> None:
    assert comments_of("# 1\na: |+ # 2\n  # no\n\n# 3\nb: '# no' # 4\nc: x#no\n") == [
        "# 1",
        "# 2",
        "# 3",
        "# 4",
    ]
