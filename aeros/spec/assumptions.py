"""Which proofs of a module rest on a skill's having no outcome but those that it declares."""

from __future__ import annotations

from typing import Final

from aeros.spec.certificate import Certificate
from aeros.spec.closed_loop.transition_system import skills_of
from aeros.spec.model import Ecm
from aeros.spec.parts import steps_of

_OF_PATHS: Final = frozenset(("ready", "reachable", "covers"))
"""Claims about compositions that are proved of paths of outcomes."""


def resting_on(ecm: Ecm, skill: str, certificate: Certificate) -> list[str]:
    """The obligations of `certificate`, that of `ecm`, that rest on the declared outcomes of `skill`.

    Those of tasks that run it, and those about paths through compositions that do.  What an action may be
    does not rest on outcomes: safety and permission hold, and the gate decides, whatever comes of a skill.
    """
    tasks = {one.id for one in ecm.tasks.values() if skill in {each.id for each in skills_of(ecm, one)}}
    compositions = {
        one.id
        for one in ecm.compositions.values()
        if skill in {step.skill for step in (*steps_of(one.body), *one.handlers.values())}
    }
    found = []
    for id_ in certificate.obligations:
        group, _, rest = id_.partition("/")
        whose, *what = rest.split("/")
        of_paths = whose in compositions and not _OF_PATHS.isdisjoint(what)
        if (group == "closed-loop" and whose in tasks) or (group == "composition" and of_paths):
            found.append(id_)
    return sorted(found)
