"""Objects of a site that people may ask for: the words for them, and how perceivers recognize them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

OBJECTS: Final = "objects"
"""Name of the enum of a site's objects, and of the table of them that perceivers may read."""


@dataclass(frozen=True)
class ObjectKind:
    """One kind of object.

    Attributes:
        phrases: phrases for it, in lower case and in the singular.
        shape: shape as it stands; empty if the site does not say.
        size: for a `box` its size along x, y and z, for a `cylinder` its radius and height, m.
        colour: red, green and blue, from 0 to 1; None if the site does not say.
    """

    phrases: tuple[str, ...]
    shape: Literal["box", "cylinder", ""] = ""
    size: tuple[float, ...] = ()
    colour: tuple[float, float, float] | None = None

    def for_perceivers(self) -> dict[str, Any]:
        """Encode it for the code of perceivers.

        Returns:
            Plain values: `shape`, `size` and `colour`.
        """
        return {"shape": self.shape, "size": self.size, "colour": self.colour}
