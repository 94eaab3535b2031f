"""Choices of topics, and the messages that a recording keeps by them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.bus.messages import Float64Stamped, Header, String, stamp
from aeros.runtime.bus.recording.bag import McapFile
from aeros.runtime.bus.recording.topic_choice import ChosenTopic, TopicChoice, TopicChoiceError
from tests.hypothesis_profiles import examples

TICK = 1 / 240


def test_a_topic_may_have_a_rate() -> None:
    assert ChosenTopic.parse("/tf") == ("/tf", None)
    assert ChosenTopic.parse("/aeros/state/*=12.5") == ("/aeros/state/*", 12.5)


@pytest.mark.parametrize(
    "text", ["", "tf", "=3", "/tf=", "/tf=0", "/tf=-1", "/tf=nan", "/tf=inf", "/tf=1e-320", "/tf=fast"]
)
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(TopicChoiceError, match=r"is no topic|is no rate"):
        ChosenTopic.parse(text)


def test_the_first_match_decides() -> None:
    choice = TopicChoice([ChosenTopic("/tf", 10.0), ChosenTopic("/t*"), ChosenTopic("/aeros/?og")])
    assert choice.interval("/tf") == 0.1
    assert choice.interval("/tf_static") == 0.0
    assert choice.interval("/aeros/log") == 0.0
    assert choice.interval("/aeros/dialog") is None
    assert TopicChoice().interval("/anything") == 0.0


def test_a_topic_that_does_not_exist_is_refused() -> None:
    known = ["/tf", "/aeros/log"]
    TopicChoice([ChosenTopic("/aeros/*"), ChosenTopic("/tf", 1.0)]).require_topics(known)
    with pytest.raises(TopicChoiceError, match="no topic is called `/aeros/lok`: did you mean `/aeros/log`"):
        TopicChoice([ChosenTopic("/tf"), ChosenTopic("/aeros/lok")]).require_topics(known)
    states = ["/aeros/state/holding", "/aeros/state/finger_gap"]
    with pytest.raises(TopicChoiceError, match=r"there are /aeros/log, /aeros/state/\*, /tf$"):
        TopicChoice([ChosenTopic("*nothing*")]).require_topics([*known, *states])


def kept_times(path: Path, choice: TopicChoice, count: int) -> list[int]:
    """Times of the messages of `/a` that a file keeps of `count` ticks, ns; `/b` is not chosen."""
    from mcap.reader import make_reader

    with McapFile(path, choice) as file:
        a, b = (file.publisher(topic, Float64Stamped) for topic in ("/a", "/b"))
        for tick in range(count):
            message = Float64Stamped(Header(stamp(tick * TICK)), 1.0)
            a.publish(message)
            b.publish(message)
    with path.open("rb") as opened:
        found = [
            (channel.topic, message.log_time) for _, channel, message in make_reader(opened).iter_messages()
        ]
    assert {topic for topic, _ in found} == {"/a"}
    return [when for _, when in found]


@examples(15)
@given(st.sampled_from([1e-12, 0.5, 3.0, 10.0, 60.0, 240.0, 1000.0]), st.integers(1, 500))
def test_no_more_is_kept_than_the_rate_and_the_first_is(
    tmp_path_factory: pytest.TempPathFactory, rate: float, count: int
) -> None:
    path = tmp_path_factory.mktemp("kept") / "run.mcap"
    times = kept_times(path, TopicChoice([ChosenTopic("/a", rate)]), count)
    assert times[0] == 0
    lasts = (count - 1) * TICK
    assert len(times) <= lasts * rate + 2
    assert len(times) >= min(count, int(lasts * min(rate, 240.0) / (1.0 + rate * TICK)))
    if rate >= 240.0:
        assert len(times) == count


def test_a_message_without_a_stamp_has_the_time_of_the_one_before(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    with McapFile(path) as file:
        file.publisher("/a", Float64Stamped).publish(Float64Stamped(Header(stamp(1.7e9)), 1.0))
        file.publisher("/robot_description", String, latched=True).publish(String("<robot/>"))
    with path.open("rb") as opened:
        times = {message.log_time for _, _, message in make_reader(opened).iter_messages()}
    assert times == {1_700_000_000 * 10**9}
