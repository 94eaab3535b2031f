"""Choice of topics for a recording, with the highest rate of each."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from fnmatch import fnmatchcase
from math import isfinite
from typing import Final, NamedTuple, Self

from aeros.spec.diagnostics.codes import did_you_mean

_GROUPS: Final = ("/aeros/state/", "/aeros/bounds/", "/aeros/camera/")
"""Beginnings of the names of topics that a site has many of."""


class TopicChoiceError(Exception):
    """A choice of topics that means nothing; the message says why."""


class ChosenTopic(NamedTuple):
    """Topics to keep.

    Attributes:
        pattern: name of a topic; `*` stands for any characters, `?` for one.
        rate: greatest number of messages in a second on the plant's clock; None to keep all.
    """

    pattern: str
    rate: float | None = None

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parse `TOPIC` or `TOPIC=HZ`.

        Args:
            text: the text.

        Returns:
            The topics.

        Raises:
            TopicChoiceError: it has no name of a topic, or the rate is no number above 0.
        """
        pattern, equals, rate = text.partition("=")
        if not pattern.startswith(("/", "*")):
            raise TopicChoiceError(f"`{pattern}` is no topic: names begin with `/`, as `/tf` or `/aeros/*`")
        if not equals:
            return cls(pattern)
        try:
            number = float(rate)
        except ValueError:
            number = 0.0
        if not (isfinite(number) and number > 0.0 and isfinite(1.0 / number)):
            raise TopicChoiceError(f"`{rate}` is no rate: give messages in a second, as `{pattern}=10`")
        return cls(pattern, number)


class TopicChoice:
    """Choice of topics. The first of the chosen topics that matches a name decides its rate.

    Args:
        chosen: topics to keep; none to keep every message of every topic.
    """

    def __init__(self, chosen: Sequence[ChosenTopic] = ()) -> None:
        self._chosen = tuple(chosen)

    def interval(self, topic: str) -> float | None:
        """Return the least time between messages of a topic.

        Args:
            topic: its name.

        Returns:
            The time, s, 0 to keep all messages; None to keep none.
        """
        if not self._chosen:
            return 0.0
        for one in self._chosen:
            if fnmatchcase(topic, one.pattern):
                return 0.0 if one.rate is None else 1.0 / one.rate
        return None

    def require_topics(self, known: Collection[str]) -> None:
        """Check that each pattern is that of a topic.

        Args:
            known: names of all topics.

        Raises:
            TopicChoiceError: one is not.
        """
        for pattern in self._patterns():
            if not any(fnmatchcase(topic, pattern) for topic in known):
                near = did_you_mean(pattern, known)
                some = f"did you mean `{near}`?" if near else f"there are {', '.join(_brief(known))}"
                raise TopicChoiceError(f"no topic is called `{pattern}`: {some}")

    def _patterns(self) -> Iterable[str]:
        return [one.pattern for one in self._chosen]


def _brief(topics: Collection[str]) -> list[str]:
    """Return names of topics, sorted, with one pattern for each group: a site has a hundred variables."""
    return sorted({next((f"{one}*" for one in _GROUPS if topic.startswith(one)), topic) for topic in topics})
