"""The module `kettle` under the reference site, whose perceiver measures three variables."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.runtime.perception.perceiver_run import Perceived, PerceiverError, ViewInput
from aeros.runtime.ports import CameraPicture
from aeros.sim.fake import FakePlant
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.unit.runtime.perception.perceiving import picture

PLACE = (0.5, 0.0, 0.3)
"""Of the tool."""


@cache
def site() -> Site:
    loaded = load_site(reference_site_path(), Diagnostics())
    assert loaded is not None
    return loaded


@cache
def kettle() -> Ecm:
    loaded = load_ecm(ROOT / "tests" / "unit" / "runtime" / "data" / "kettle", site(), Diagnostics())
    assert loaded is not None
    return loaded.ecm


@cache
def full_site() -> Site:
    """The site with the variables of the module."""
    return site().with_modules([kettle()])


def configuration(ecm: Ecm) -> Configuration:
    return Configuration(site=site(), modules={ecm.id: ecm}, certificates={}, digest="c" * 64)


class CameraPlant(FakePlant):
    """A plant whose tool stands still and whose camera `overhead` takes a picture when told."""

    def __init__(self, **readings: Any) -> None:
        super().__init__({"tool_position": PLACE, **readings})
        self.taken: dict[str, CameraPicture] = {}
        self.closed = False

    def take(self, time: float | None = None) -> None:
        self.taken = {"overhead": picture(self.now() if time is None else time, (320, 240))}

    def pictures(self) -> Mapping[str, CameraPicture]:
        return self.taken

    def close(self) -> None:
        self.closed = True


class Scripted:
    """Runs of a perceiver that answer by a script; the last answer is repeated."""

    def __init__(self, *answers: Mapping[str, Any] | Exception) -> None:
        self.answers = list(answers)
        self.views: list[ViewInput] = []
        self.limits: list[float] = []
        self.opened = self.closed = 0

    def __call__(self, site: Site, ecm: Ecm, perceiver: Perceiver) -> Scripted:
        self.opened += 1
        return self

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        self.views.append(view)
        self.limits.append(seconds)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        return {
            name: PerceivedValue(*one) if type(one) is tuple else PerceivedValue(one)
            for name, one in answer.items()
        }

    def close(self) -> None:
        self.closed += 1


CRASH = PerceiverError("the perceiver's process was killed by SIGSEGV")
