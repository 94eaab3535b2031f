"""Certified skill code: executes only bytes whose digest is the certified one.

`load_skill` executes them in this process, where Python code can reach whatever Python can: for modules
that the site trusts. All others run in a worker (`isolation`).
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final, NamedTuple

from aeros.models.interface import ModelFileError, ModelPackage
from aeros.models.load import load_models
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillFunction, SkillRefusedError
from aeros.skill import Models
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.perception import Perceiver
from aeros.spec.text.digests import code_digest, code_files, file_digest, model_content

MAX_LOADED_MODELS: Final = 32 * 1024 * 1024
"""Bytes of all models of one skill or perceiver at most: each of its runs receives them."""


class CertifiedCode(NamedTuple):
    """The function of a skill or of a perceiver, in its file.

    Attributes:
        file: the file, and those that it may import, with the certified digest.
        function: name of the generator function in it.
        models: the models that it declares, with their certified bytes.
    """

    file: CodeFile
    function: str
    models: tuple[ModelPackage, ...] = ()

    @property
    def module(self) -> str:
        """Id of the module."""
        return self.file.module


def load_skill(ecm: Ecm, skill: Skill) -> SkillFunction:
    """Load the generator function of a skill, executing its file afresh so that no two runs share state.

    Args:
        ecm: the module.
        skill: the skill of it.

    Returns:
        The function.

    Raises:
        SkillRefusedError: the code is not the certified code, or is not a skill.
    """
    return execute_code(certified_code(ecm, skill))


def execute_code(code: CertifiedCode) -> SkillFunction:
    """Execute certified code afresh and return its generator function.

    Args:
        code: as `certified_code` returns it.

    Returns:
        The function.

    Raises:
        SkillRefusedError: the code raises when loaded, or has no such generator function.
    """
    return code.file.generator_function(code.function)


def certified_code(ecm: Ecm, skill: Skill | Perceiver) -> CertifiedCode:
    """Read the code of a skill or of a perceiver.

    Args:
        ecm: the module.
        skill: the skill or the perceiver of it.

    Returns:
        Its function and file, and the files beside it.

    Raises:
        SkillRefusedError: the code is not the certified code, or lacks that file.
    """
    name, files = f"{skill.module_name}.py", certified_files(ecm)
    if name not in files:
        raise SkillRefusedError(f"module `{ecm.id}` has no file `{name}`")
    neighbours = tuple(one for one in files.items() if one[0] != name and "/" not in one[0])
    file = CodeFile(ecm.id, name, str(Path(ecm.folder) / name), files[name], neighbours)
    return CertifiedCode(file, skill.function, certified_models(ecm, skill.models))


def load_certified_models(code: CertifiedCode) -> Models:
    """Load the models of a skill or of a perceiver in this process.

    Args:
        code: as `certified_code` returns it.

    Returns:
        The models by name.

    Raises:
        SkillRefusedError: a file cannot be used, or its library is not installed.
    """
    try:
        return load_models(code.models)
    except ModelFileError as failure:
        raise SkillRefusedError(f"a model of module `{code.module}` cannot be loaded: {failure}") from failure


def certified_models(ecm: Ecm, names: Iterable[str]) -> tuple[ModelPackage, ...]:
    """Read models of a module.

    Args:
        ecm: the module, with the certified digests of its models.
        names: names of the models.

    Returns:
        The models with their bytes.

    Raises:
        SkillRefusedError: a file cannot be read, its digest differs from the certified one, or all together
            have more than `MAX_LOADED_MODELS` bytes.
    """
    left = MAX_LOADED_MODELS
    packages = []
    for model in (ecm.models[name] for name in names):
        try:
            content = model_content(ecm.folder, model.file, left)
        except OSError as failure:
            raise SkillRefusedError(
                f"the model `{model.id}` of module `{ecm.id}` cannot be read: {failure}"
            ) from failure
        digest, certified = file_digest(content), ecm.model_digests.get(model.file, "")
        if digest != certified:
            raise SkillRefusedError(
                f"the model `{model.id}` of module `{ecm.id}` does not match its certificate: "
                f"its digest is {digest[:12]}…, certified was {certified[:12]}…"
            )
        left -= len(content)
        packages.append(model.package(content))
    return tuple(packages)


def certified_files(ecm: Ecm) -> dict[str, bytes]:
    """Read all code of a module.

    Args:
        ecm: the module, with its certified code digest.

    Returns:
        Content of each file, by path in the module's folder.

    Raises:
        SkillRefusedError: a file cannot be read, or the digest differs from the certified one.
    """
    try:
        files = code_files(ecm.folder)
    except OSError as failure:
        raise SkillRefusedError(f"the code of module `{ecm.id}` cannot be read: {failure}") from failure
    digest = code_digest(files)
    if digest != ecm.code_digest:
        raise SkillRefusedError(
            f"the code of module `{ecm.id}` does not match its certificate: "
            f"its digest is {digest[:12]}…, certified was {ecm.code_digest[:12]}…"
        )
    return files
