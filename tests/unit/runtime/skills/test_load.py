from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.load import load_skill
from aeros.skill import act
from aeros.spec.text.digests import code_digest, code_files

GOOD = """
from __future__ import annotations
from dataclasses import dataclass
from aeros.skill import act

runs = []

@dataclass
class Note:
    text: str

def lift(observed, inputs):
    runs.append(Note("run"))
    yield act("move", count=len(runs))

def not_a_skill(observed, inputs):
    return None
"""


def test_a_skill_is_loaded_under_a_private_name(make_ecm: Any) -> None:
    ecm = make_ecm(GOOD)
    path = list(sys.path)
    function = load_skill(ecm, ecm.skills["lift"])
    assert next(function({}, {})) == act("move", count=1)
    assert function.__module__ == "_aeros_ecm_handling.skills"
    assert "skills" not in sys.modules
    assert sys.path == path


def test_two_runs_share_no_state(make_ecm: Any) -> None:
    ecm = make_ecm(GOOD)
    for _ in range(2):
        assert next(load_skill(ecm, ecm.skills["lift"])({}, {})) == act("move", count=1)


def test_changed_code_is_refused_and_never_executed(make_ecm: Any, tmp_path: Path) -> None:
    ecm = make_ecm(GOOD)
    trace = tmp_path / "executed"
    (Path(ecm.folder) / "skills.py").write_text(f"open({str(trace)!r}, 'w')\n{GOOD}")
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        load_skill(ecm, ecm.skills["lift"])
    assert not trace.exists()


def test_a_changed_neighbour_is_refused_and_never_executed(make_ecm: Any, tmp_path: Path) -> None:
    made = make_ecm("from .legs import lift_leg\ndef lift(observed, inputs):\n    yield lift_leg(0.1)\n")
    legs = Path(made.folder) / "legs.py"
    code = "from aeros.skill import act\ndef lift_leg(height):\n    return act('move', height=height)\n"
    legs.write_text(code)
    ecm = replace(made, code_digest=code_digest(code_files(made.folder)))
    assert next(load_skill(ecm, ecm.skills["lift"])({}, {})) == act("move", height=0.1)
    trace = tmp_path / "executed"
    legs.write_text(f"open({str(trace)!r}, 'w')\n{code}")
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        load_skill(ecm, ecm.skills["lift"])
    assert not trace.exists()


def test_an_added_file_is_refused(make_ecm: Any) -> None:
    ecm = make_ecm(GOOD)
    (Path(ecm.folder) / "more").mkdir()
    (Path(ecm.folder) / "more" / "extra.py").write_text("")
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        load_skill(ecm, ecm.skills["lift"])


@pytest.mark.parametrize(
    ("code", "function", "why"),
    [
        (GOOD, "absent", "no generator function `absent`"),
        (GOOD, "not_a_skill", "no generator function `not_a_skill`"),
        (GOOD, "runs", "no generator function `runs`"),
        ("raise ValueError('no')", "lift", "fails to load: ValueError: no"),
        ("raise SystemExit(3)", "lift", "fails to load: SystemExit: 3"),
        ("def lift(:", "lift", "fails to load: SyntaxError"),
        (
            "class E(Exception):\n    def __str__(self): raise self\nraise E",
            "lift",
            r"fails to load: E: \(it has no message\)",
        ),
    ],
)
def test_code_that_is_not_a_skill_is_refused(make_ecm: Any, code: str, function: str, why: str) -> None:
    ecm = make_ecm(code, function)
    with pytest.raises(SkillRefusedError, match=why):
        load_skill(ecm, ecm.skills["lift"])


def test_a_module_file_outside_the_folder_cannot_be_named(make_ecm: Any) -> None:
    ecm = make_ecm(GOOD)
    for name in ("..skills", "absent", "/etc/hosts"):
        with pytest.raises(SkillRefusedError, match="has no file"):
            load_skill(ecm, replace(ecm.skills["lift"], module_name=name))


def test_a_folder_that_is_gone_is_refused(make_ecm: Any) -> None:
    ecm = replace(make_ecm(GOOD), folder="/nonexistent")
    with pytest.raises(SkillRefusedError):
        load_skill(ecm, ecm.skills["lift"])


def test_an_unreadable_file_is_refused(make_ecm: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def unreadable(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    ecm = make_ecm(GOOD)
    monkeypatch.setattr(Path, "open", unreadable)
    with pytest.raises(SkillRefusedError, match="cannot be read"):
        load_skill(ecm, ecm.skills["lift"])
