"""Perception: perceivers and definitions of a module, cameras of a site, and variables that the site shares.

Only `elaborate` builds it; obligations, the runtime and planners read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model.variables import Declared

MEMORY: Final = "memory"
"""Name under which a perceiver reads the places where the things of its module were seen before."""


@dataclass(frozen=True)
class PictureRequest:
    """Picture of one camera that a perceiver asks for.

    Attributes:
        camera: name of the camera, a member of the site's enum `cameras`.
        width: number of columns, pixels.
        height: number of rows, pixels.
        depth: the perceiver also gets the distance of each pixel along the optical axis.
        seen_as: the module's name for the camera; empty if it is the site's.
        optional: the perceiver is called without it, too, as long as the camera has taken none.
    """

    camera: str
    width: int
    height: int
    depth: bool
    seen_as: str = ""
    optional: bool = False

    @property
    def name(self) -> str:
        """Name of the camera in the perceiver's code."""
        return self.seen_as or self.camera


@dataclass(frozen=True)
class Perceiver:
    """Passive function of a module that computes values of its state variables from pictures and readings.

    Attributes:
        id: name of the perceiver in its module.
        module_name: Python module of its function, relative to the module's folder.
        function: name of the generator function.
        pictures: pictures that it gets; one call for each new set of them.
        read_as: full name of each state variable that it gets with the pictures, by the name in its code.
        rate: frequency at which the readings are also sampled between two calls, 1/s; None for never.
        provides: full names of the module's state variables that only it writes.
        timeout: greatest real time of one call, s.
        memory: greatest memory of its process, bytes.
        span: place of its name.
        entry_span: place of its `entry`.
        processor: greatest share of one core that its process may use, above 0 and at most 1.
        constants: value (SI) of each parameter of the module that it gets with the readings, by name.
        models: names of the models that it receives.
        recalls: True if it gets the places where things were seen before, as the reading `MEMORY`.
    """

    id: str
    module_name: str
    function: str
    pictures: tuple[PictureRequest, ...]
    read_as: Mapping[str, str]
    rate: Fraction | None
    provides: tuple[str, ...]
    timeout: Fraction
    memory: int
    span: SourceSpan
    entry_span: SourceSpan
    processor: Fraction = Fraction(1)
    constants: Mapping[str, Any] = field(default_factory=dict)
    models: tuple[str, ...] = ()
    recalls: bool = False

    @property
    def readings(self) -> tuple[str, ...]:
        """Full names of the state variables that it gets with the pictures."""
        return tuple(self.read_as.values())


@dataclass(frozen=True)
class Definition:
    """Condition that says when a predicate of a module is true; the runtime evaluates it on readings.

    Attributes:
        term: the condition, on measured variables of the site, what perceivers measure, and what other
            definitions say.
        text: the condition as written.
        span: its place.
        margin: number of declared standard uncertainties by which each value that it reads may be off; where
            that could change its value, the predicate is unknown.
    """

    term: t.Term
    text: str
    span: SourceSpan
    margin: Fraction = Fraction(0)


@dataclass(frozen=True)
class Thing:
    """Thing that a module perceives, as its variables describe it.

    Attributes:
        name: full name, as in `clean_table.sponge`.
        kind: its kind; empty if `kind_from` has it.
        kind_from: full name of the task parameter whose value is its kind; None if it has one kind.
        position: full name of the variable that has its position; None if none is measured.
        count: full name of the variable that has the number of such things; None for one thing.
        held: condition under which the robot holds it; None if the module does not say.
        relations: condition of each relation, as `on tray` or `in pot`.
        recall: greatest age of the places that perceivers are given from memory, s; None for none.
    """

    name: str
    kind: str
    kind_from: str | None = None
    position: str | None = None
    count: str | None = None
    held: t.Term | None = None
    relations: Mapping[str, t.Term] = field(default_factory=dict)
    recall: Fraction | None = None


@dataclass(frozen=True)
class SiteCamera:
    """Camera of a site.

    Attributes:
        sensor: sensor that a module needs for its pictures.
        width: most columns that a perceiver may ask for.
        height: most rows that a perceiver may ask for.
        sees: names of the volumes that its pictures show.
    """

    sensor: str
    width: int
    height: int
    sees: frozenset[str] = frozenset()


@dataclass(frozen=True)
class PerceptionPolicy:
    """Rights of perceivers, and to what they measure.

    Attributes:
        shared: variables of modules that other modules may read, by full name, as the site declares them.
        in_invariants: those of them that the invariants Φ may read.
        timeout: greatest timeout of a perceiver, s.
        memory: greatest memory of a perceiver, bytes.
        processor: greatest share of one core that a perceiver may use, above 0 and at most 1.
        public: True if modules may read what modules that they require declare as public.
        rate: highest rate at which readings are sampled for a perceiver, 1/s.
    """

    shared: Mapping[str, Declared] = field(default_factory=dict)
    in_invariants: frozenset[str] = frozenset()
    timeout: Fraction = Fraction(1)
    memory: int = 2**30
    public: bool = False
    processor: Fraction = Fraction(1)
    rate: Fraction = Fraction(1000)
