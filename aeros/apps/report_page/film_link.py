"""Links from times of a run to its film: attributes that the page's script reads."""

from __future__ import annotations

from typing import Final, NamedTuple

from aeros.sim.film.film_span import FilmSpan


class FilmLink(NamedTuple):
    """Links to a film.

    Attributes:
        span: The part of the run that the film shows; None if there is no film that can be set to a time.
    """

    span: FilmSpan | None

    def attribute(self, time: float) -> str:
        """Return the attribute of an element that sets the film to a time.

        Args:
            time: Plant time, s.

        Returns:
            The attribute after a space; empty if the film does not show that time.
        """
        if self.span is None or not self.span.start <= time <= self.span.end:
            return ""
        return f' data-time="{time:.3f}"'

    def text(self, time: float, shown: str) -> str:
        """Return the text of a time, which sets the film to it.

        Args:
            time: Plant time, s.
            shown: The text, as HTML.

        Returns:
            HTML; the text alone if the film does not show that time.
        """
        attribute = self.attribute(time)
        return f"<span{attribute}>{shown}</span>" if attribute else shown


NO_FILM: Final = FilmLink(None)
"""Links nothing."""
