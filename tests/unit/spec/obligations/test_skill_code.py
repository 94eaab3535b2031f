from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_syntax.skill_source import read_skill_files
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.discovery import reference_site_path

MODULE = Path(__file__).parents[4] / "ecms" / "clean_table"
HEAD = "from aeros.skill import Action, act\n"


@pytest.fixture(scope="module")
def loaded() -> tuple[Ecm, Site]:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    found = load_ecm(MODULE, site, Diagnostics())
    assert found is not None
    ecm = found.ecm
    return replace(ecm, skills={"wipe": ecm.skills["wipe"]}), site


def _claims(loaded: tuple[Ecm, Site], code: bytes) -> list[StaticClaim]:
    ecm, site = loaded
    return list(skill_code_obligations(ecm, site, read_skill_files(ecm.folder, {"skills.py": code})))


def _faults(loaded: tuple[Ecm, Site], code: str) -> set[tuple[str, str]]:
    settled = _claims(loaded, code.encode())
    return {(one.diagnostic.code, one.diagnostic.headline) for one in settled if one.diagnostic is not None}


def _codes(loaded: tuple[Ecm, Site], code: str) -> set[str]:
    return {code for code, _ in _faults(loaded, code)}


@pytest.mark.parametrize(
    "code",
    [
        HEAD + "def wipe(o, i):\n    yield act('grip', width=0.05, force=5.0)\n",
        HEAD + "import math\ndef wipe(o, i):\n    yield act('grip', width=math.sin(0.1), force=5.0)\n",
        HEAD + "def _do():\n    yield act('slide', target=tuple([0, 0, 0]), force=1.0, speed=0.1)\n"
        "def wipe(o, i):\n    yield from _do()\n",
        HEAD + "from collections.abc import Generator\nfrom functools import partial\n"
        "def _t(o) -> Generator[Action, None, None]:\n    yield act('grip', width=0.0, force=1.0)\n"
        "def wipe(o, i):\n    yield from _t(o)\n",
        # Another skill's function may ask for what this one may not.
        HEAD + "def other(o, i):\n    yield act('move_base', x=0.0, y=0.0, speed=0.1)\n"
        "def wipe(o, i):\n    yield act('grip', width=0.05, force=5.0)\n",
    ],
)
def test_code_inside_its_envelope_is_accepted(loaded: tuple[Ecm, Site], code: str) -> None:
    assert _faults(loaded, code) == set()


@pytest.mark.parametrize(
    "body",
    [
        "yield act('move_base', x=0.0, y=0.0, speed=0.1)",
        "yield Action('move_base', {'x': 0.0})",
        "ask = act\n    yield ask('move_base', x=0.0)",
        "yield act('mo' + 've_base', x=0.0)",
        "yield act(*['move_base'])",
        "yield DRIVE",
        "yield Door.drive()",
        "yield from _deep()",
        "yield act('grip', width=0.05, force=5.0, speed=9.0)",
        "yield act('grip', goal=0.05)",
    ],
)
def test_code_that_asks_for_undeclared_actions_is_refused(loaded: tuple[Ecm, Site], body: str) -> None:
    more = (
        ("DRIVE = act('move_base', x=0.0, y=0.0, speed=0.1)\n" if "DRIVE" in body else "")
        + (
            "class Door:\n    drive = staticmethod(lambda: act('move_base', x=0.0))\n"
            if "Door" in body
            else ""
        )
        + ("def _deeper():\n    yield act('move_base', x=0.0)\ndef _deep():\n    yield from _deeper()\n")
    )
    assert _codes(loaded, f"{HEAD}{more}def wipe(o, i):\n    {body}\n") == {"AE133"}


@pytest.mark.parametrize(
    "code",
    [
        "def wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\nwipe = None\n",
        "def wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\n"
        "def wipe(o, i):\n    yield act('move_base', x=0.0)\n",
        "act = print\ndef wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\n",
    ],
)
def test_a_name_that_is_bound_twice_hides_nothing(loaded: tuple[Ecm, Site], code: str) -> None:
    assert "AE133" in _codes(loaded, HEAD + code)


def test_a_claim_about_code_has_one_id_proved_or_refuted(loaded: tuple[Ecm, Site]) -> None:
    def names(code: bytes) -> list[str]:
        return [str(one.id) for one in _claims(loaded, code)]

    whole = ["form/code/skills.py", "form/code/skills.py/asking", "form/wipe/asks"]
    assert names(b"def wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\n") == whole
    assert names(b"import os\nask = act\ndef wipe(o, i):\n    yield act('move_base')\n") == whole
    assert names(b"def wipe(") == whole[:1]


@pytest.mark.parametrize(
    "reach",
    [
        "import os",
        "import aeros.skill",
        "import collections.abc",
        "from aeros import runtime",
        "from aeros.skill import Generator",
        "from . import neighbour",
        "from ..neighbour import secret",
        "from .more.neighbour import secret",
        "from .neighbour import *",
        "from .__init__ import secret",
        "from math import *",
        "from dataclasses import sys",
        "from typing import get_type_hints",
        "import dataclasses\nx = dataclasses.sys",
        "import math\nx = [math]",
        "x = ().__class__",
        "x = (y for y in ()).gi_frame",
        "x = getattr(act, 'x')",
        "x = open('/etc/passwd')",
        "print('goal reached')",
        "x = eval('1')",
        "def f():\n    global wipe\n",
    ],
)
def test_forbidden_access_in_code_is_refused(loaded: tuple[Ecm, Site], reach: str) -> None:
    code = f"{HEAD}{reach}\ndef wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\n"
    assert "AE134" in _codes(loaded, code)


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbfimport os\n",
        b"# -*- coding: latin-1 -*-\nx = '\xe9'\n",
        b"#\n# vim: coding=utf-7\n",
        b"#\n# vim: coding=utf-7\n\n\nx = 1\n\n",
        b"\xff",
    ],
)
def test_code_in_another_encoding_is_refused(loaded: tuple[Ecm, Site], content: bytes) -> None:
    settled = _claims(loaded, content)
    message = [(one.diagnostic.code, one.diagnostic.help) for one in settled if one.diagnostic is not None]
    (((code, (help_,)),)) = message
    assert code == "AE139"
    assert "UTF-8" in help_


GRIP = "def wipe(o, i):\n    yield act('grip', width=0.0, force=1.0)\n"
UNREAD = "the actions that this code asks for cannot be determined: "
ONE_MEANING = "call `act(KIND, ...)` directly, and bind every name once"


@pytest.mark.parametrize(
    ("code", "headline", "underlined", "help_"),
    [
        (
            "ask = act\n" + GRIP,
            UNREAD + "`act` is used other than in a call",
            "act",
            ONE_MEANING,
        ),
        (
            "from aeros.skill import Action as Deed, act as ask\n" + GRIP,
            UNREAD + "`Action` is imported under another name",
            "from aeros.skill import Action as Deed, act as ask",
            ONE_MEANING,
        ),
        (GRIP + "wipe = 1\n", UNREAD + "`wipe` is bound a second time", "wipe = 1", ONE_MEANING),
        (
            "def wipe(o, i):\n    yield act('gr' + 'ip')\n",
            UNREAD + "the kind of an action is not written out",
            "act('gr' + 'ip')",
            ONE_MEANING,
        ),
        (
            "def wipe(o, i):\n    yield act()\n",
            UNREAD + "the kind of an action is not written out",
            "act()",
            ONE_MEANING,
        ),
        (
            "def wipe(o, i):\n    yield act('gripp')\n",
            "`wipe` asks for `gripp`, which is not in its envelope",
            "'gripp'",
            "did you mean `grip`?",
        ),
        (
            "def wipe(o, i):\n    yield act('back_off')\n",
            "`wipe` asks for `back_off`, which is not in its envelope",
            "'back_off'",
            "declare `back_off` in its `envelope`",
        ),
        (
            "def wipe(o, i):\n    yield act('grip', widht=1.0, further=2.0)\n",
            "`grip` has no parameter `widht`",
            "act('grip', widht=1.0, further=2.0)",
            "did you mean `width`?",
        ),
        (
            "def wipe(o, i):\n    yield act('grip', colour=1.0)\n",
            "`grip` has no parameter `colour`",
            "act('grip', colour=1.0)",
            "it has width, force",
        ),
    ],
)
def test_an_unreadable_request_is_underlined_with_a_remedy(
    loaded: tuple[Ecm, Site], code: str, headline: str, underlined: str, help_: str
) -> None:
    settled = _claims(loaded, ("from aeros.skill import act\n" + code).encode())
    (found,) = [one.diagnostic for one in settled if one.diagnostic is not None]
    assert (found.headline, found.help) == (headline, (help_,))
    assert found.primary is not None
    assert found.primary.span.text == underlined


@pytest.mark.parametrize(
    ("code", "what"),
    [
        ("import os, math\n", "imports `os`"),
        ("from .neighbour import *\n", "imports everything from `.neighbour`"),
        ("from . import secret\n", "imports `.`"),
        ("from math import sin, nothing\n", "imports `nothing` from `math`"),
        ("from aeros.skill import act, Generator\n", "imports `Generator` from `aeros.skill`"),
        ("x = open('/etc/passwd')\n", "uses `open`"),
        ("import math as m\nx = [m]\n", "passes the module `m` around"),
        ("import math as m\nx = m.nothing\n", "uses `nothing` of `math`"),
        ("x = ().__class__\n", "reaches into `__class__`"),
        ("async def f():\n    pass\n", "awaits something between actions"),
    ],
)
def test_a_refusal_names_the_forbidden_access(loaded: tuple[Ecm, Site], code: str, what: str) -> None:
    settled = _claims(loaded, (HEAD + code + GRIP).encode())
    message = [
        one.diagnostic for one in settled if one.diagnostic is not None and one.diagnostic.code == "AE134"
    ]
    assert [one.headline for one in message] == [f"skill code of `clean_table` {what}"]


@pytest.mark.parametrize(
    "code", ["import math as m\nx = m.sin(1.0)\n", "import math\nx = math.pi\n", "from enum import Enum\n"]
)
def test_code_that_only_computes_is_accepted(loaded: tuple[Ecm, Site], code: str) -> None:
    assert _faults(loaded, HEAD + code + GRIP) == set()


def test_an_encoding_that_python_does_not_look_for_is_a_comment(loaded: tuple[Ecm, Site]) -> None:
    assert _faults(loaded, f"#\n#\n# coding: nonsense\n{HEAD}{GRIP}") == set()


def test_each_of_several_files_is_judged(loaded: tuple[Ecm, Site]) -> None:
    ecm, site = loaded
    drives = HEAD + "def wipe(o, i):\n    yield act('move_base', x=0.0, y=0.0, speed=0.1)\n"
    given = {
        "broken.py": b"def",
        "idle.py": b"from os import system\n",
        "perceivers.py": b"LIMIT = 1\n",
        "skills.py": drives.encode(),
    }
    found = list(skill_code_obligations(ecm, site, read_skill_files(ecm.folder, given)))
    faults = {str(one.id): one.diagnostic.code for one in found if one.diagnostic is not None}
    assert faults == {
        "form/code/broken.py": "AE139",
        "form/code/idle.py": "AE134",
        "form/wipe/asks": "AE133",
    }
