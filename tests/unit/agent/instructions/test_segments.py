from __future__ import annotations

from aeros.agent.instructions.segments import Link, Mood, Segment


def test_the_text_of_a_segment_begins_with_its_marker() -> None:
    words = ("clean", "it")
    assert Segment(Mood.PROHIBITION, words, Link.START, ("do", "not")).text == "do not clean it"
    assert Segment(Mood.REQUEST, words, Link.START).text == "clean it"
