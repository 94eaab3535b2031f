"""Skill code as it was certified: only the very bytes whose digest is the certified one are executed.

`load_skill` executes them in this process, where Python code can reach whatever Python can: for modules
that the site trusts.  All others run in a worker (`isolation`).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from aeros.runtime.skills.contract import SkillFunction, SkillRefusedError, execute_skill
from aeros.spec.model.model import Ecm, Skill
from aeros.spec.text.digests import code_digest, code_files


class CertifiedCode(NamedTuple):
    """The file that a skill's function is in: `content` of the file `name`, which lies at `path`."""

    module: str
    name: str
    path: str
    content: bytes
    function: str


def load_skill(ecm: Ecm, skill: Skill) -> SkillFunction:
    """The generator function of `skill`, its module executed afresh, so no two runs share state.

    Raises `SkillRefusedError`.
    """
    return execute_code(certified_code(ecm, skill))


def execute_code(code: CertifiedCode) -> SkillFunction:
    """The generator function in `code`, its module executed afresh; raises `SkillRefusedError`."""
    return execute_skill(code.module, code.name, code.content, code.path, code.function)


def certified_code(ecm: Ecm, skill: Skill) -> CertifiedCode:
    """The code of `skill`; raises `SkillRefusedError`."""
    name = f"{skill.module_name.replace('.', '/')}.py"
    content = certified_files(ecm).get(name)
    if content is None:
        raise SkillRefusedError(f"module `{ecm.id}` has no file `{name}`")
    return CertifiedCode(ecm.id, name, str(Path(ecm.folder) / name), content, skill.function)


def certified_files(ecm: Ecm) -> dict[str, bytes]:
    """All code of `ecm` by path; raises `SkillRefusedError` unless it is what was certified."""
    try:
        files = code_files(ecm.folder)
    except OSError as failure:
        raise SkillRefusedError(f"the code of module `{ecm.id}` cannot be read: {failure}") from failure
    found = code_digest(files)
    if found != ecm.code_digest:
        raise SkillRefusedError(
            f"the code of module `{ecm.id}` is not what was certified: "
            f"its digest is {found[:12]}…, certified is {ecm.code_digest[:12]}…"
        )
    return files
