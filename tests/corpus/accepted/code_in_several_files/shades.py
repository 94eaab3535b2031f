from typing import NamedTuple

from .measures import DARK


class Shade(NamedTuple):
    darkest: float

    @property
    def is_bright(self) -> bool:
        return self.darkest > DARK
