"""Loading of scene files by path or name, with the files that they include."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Final

import aeros
from aeros.spec.declared import scene as declared
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.scene import Scene, ScenePart
from aeros.spec.scenes.combining import LabelledScene, join
from aeros.spec.scenes.elaborate import elaborate_scene
from aeros.spec.scenes.merging import merge, moved
from aeros.spec.scenes.quantities import Quantities
from aeros.spec.scenes.truth_names import check_truth
from aeros.spec.text.digests import text_digest
from aeros.spec.text.discovery import SCENES
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

GROUP: Final = "aeros.scenes"
"""Group of entry points under which an installed distribution provides scenes, each a path of a file."""

_MAX_DEPTH: Final = 8
"""Limit on files that include each other."""


def scenes_in(folder: str | os.PathLike[str]) -> dict[str, Path]:
    """List the scene files of a module.

    Args:
        folder: the module's folder.

    Returns:
        Their paths by name, which is the file's without suffix.
    """
    return {path.stem: path for path in sorted((Path(folder) / SCENES).glob("*.yaml"))}


def shipped_scenes() -> dict[str, Path]:
    """List the scene files that come with AEROS.

    Returns:
        Their paths by name.
    """
    return scenes_in(Path(aeros.__file__).parent)


@cache
def provided_scenes() -> dict[str, Path]:
    """List the scene files that installed distributions provide; they are looked for once.

    Returns:
        Their paths by name.

    Raises:
        UserError: an entry point of a distribution names no path.
    """
    found = {}
    for entry in entry_points(group=GROUP):
        try:
            found[entry.name] = Path(entry.load())
        except Exception as failure:
            headline = f"the scene `{entry.name}` of an installed distribution cannot be found: {failure}"
            help_ = (f"let its entry point of `{GROUP}` name the path of a scene file",)
            raise UserError([Diagnostic("AE002", headline, help=help_)]) from failure
    return found


def known_scenes(module_folders: Sequence[str | os.PathLike[str]] = ()) -> dict[str, Path]:
    """List the scene files that can be named.

    Args:
        module_folders: folders of modules; a name in the first goes before that of AEROS, that before those
            of other modules, and these before those of installed distributions.

    Returns:
        Their paths by name.
    """
    own, others = module_folders[:1], module_folders[1:]
    found: dict[str, Path] = {}
    scenes_of_modules = (*map(scenes_in, own), shipped_scenes(), *map(scenes_in, others))
    for scenes in (*scenes_of_modules, provided_scenes()):
        found = {**scenes, **found}
    return found


def load_scene(
    name_or_path: str,
    module_folders: Sequence[str | os.PathLike[str]] = (),
    cameras: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
    variables: Mapping[str, Mapping[str, Sequence[str]]] | None = None,
) -> Scene:
    """Load a scene.

    Args:
        name_or_path: a name, or a path of a file; a name goes before a path.
        module_folders: folders of modules whose scenes may be named, there and in `include`.
        cameras: for each module, the site's names of cameras by the module's; a scene of the module uses
            the module's.
        variables: for each module, its own state variables by short name, each with the members of its enum,
            and those of the site by the empty name: `truth` and `parameters` may name these alone; None does
            not check their names.

    Returns:
        The scene with all that it includes.

    Raises:
        UserError: there is no such file, or it has problems.
    """
    loader = _Loader(known_scenes(module_folders), cameras, variables)
    scene = loader.load(loader.find(name_or_path, Path(), None))
    loader.diagnostics.raise_if_errors()
    return scene


def require_robot(scene: Scene) -> Scene:
    """Check that a scene has a robot and a view: only such a one can be simulated.

    Args:
        scene: the scene.

    Returns:
        The same scene.

    Raises:
        UserError: it has none.
    """
    missing = [word for word in ("robot", "view") if getattr(scene, word) is None]
    if missing:
        headline = f"the scene `{scene.name}` has no `{missing[0]}`, so it only adds to others"
        help_ = (f"add `{missing[0]}:` to its file, or add it to a task's scene with `--scene`",)
        raise UserError([Diagnostic("AE208", headline, help=help_)])
    return scene


@dataclass
class _Loader:
    """Loads files that include each other.

    Attributes:
        known: paths of scenes by name.
        cameras: for each module, the site's names of cameras by the module's.
        variables: as in `load_scene`.
        diagnostics: receives the faults.
        under_way: the files that are being loaded.
        prefix: put before the names of the file that is being loaded.
    """

    known: dict[str, Path]
    cameras: Mapping[str, Mapping[str, str]]
    variables: Mapping[str, Mapping[str, Sequence[str]]] | None
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    under_way: list[Path] = field(default_factory=list)
    prefix: str = ""

    def find(self, name_or_path: str, folder: Path, at: SourceSpan | None) -> Path:
        """Find a file by name, or by path from `folder`.

        Raises:
            UserError: there is neither such a name nor such a file.
        """
        if name_or_path in self.known:
            return self.known[name_or_path]
        path = folder / name_or_path
        if os.path.lexists(path):
            return path
        near = did_you_mean(name_or_path, self.known)
        listed = ", ".join(f"`{name}`" for name in self.known)
        help_ = (f"did you mean `{near}`?" if near else f"give a scene file, or one of {listed}",)
        headline = f"no file `{path}`, and no scene file of that name comes with the module or with AEROS"
        if at is None:
            raise UserError([Diagnostic("AE002", headline, help=help_)])
        self.diagnostics.error("AE002", headline, at, help=help_)
        raise UserError(self.diagnostics)

    def load(self, path: Path) -> Scene:
        """Load a file and what it includes.

        Raises:
            UserError: a file cannot be read or decoded.
        """
        source = read_source(path)
        node = read_yaml(source, self.diagnostics)
        file = None if node is None else decode(node, declared.Scene, self.diagnostics)
        if file is None:
            raise UserError(self.diagnostics)
        module = None if file.module is None else file.module.value
        whole = _empty(path.stem, module, text_digest(source.text))
        self.under_way.append(path.resolve())
        if file.include:
            added = [self._include(include, path.parent) for include in file.include]
            self._check_each_once(added)
            cell = join(added, self.diagnostics, own_robot=file.robot is not None)
            whole = merge(whole, cell, None, self.diagnostics)
        self.under_way.pop()
        cameras = {} if module is None else self.cameras.get(module, {})
        if self.variables is not None:
            check_truth(file, self.variables, self.prefix, self.diagnostics)
        return elaborate_scene(file, whole, path.parent, self.diagnostics, cameras)

    def _check_each_once(self, added: Sequence[LabelledScene]) -> None:
        """Report a scene that is included twice at the same place: its things would be in each other."""
        for number, one in enumerate(added):
            if any(one.scene.parts[0] == other.scene.parts[0] for other in added[:number]):
                headline = f"`{one.scene.name}` is included twice at one place"
                cure = "give one of them a `prefix` and, with `at`, another place; or remove it"
                self.diagnostics.error("AE208", headline, one.at, help=(cure,))

    def _include(self, include: declared.Include, folder: Path) -> LabelledScene:
        """Load an included scene, with its names and its place.

        Raises:
            UserError: there is no such file, it includes itself, or it has problems.
        """
        path = self.find(include.scene.value, folder, include.scene.span)
        if path.resolve() in self.under_way or len(self.under_way) >= _MAX_DEPTH:
            headline = (
                f"`{path}` includes itself"
                if path.resolve() in self.under_way
                else "too many files are nested"
            )
            self.diagnostics.error("AE208", headline, include.scene.span, help=("remove this `include`",))
            raise UserError(self.diagnostics)
        prefix = "" if include.prefix is None else include.prefix.value
        offset = Quantities(self.diagnostics).point(include.at)
        around, self.prefix = self.prefix, self.prefix + prefix
        loaded = self.load(path)
        self.prefix = around
        added = moved(loaded, prefix, offset)
        if added.coatings and offset[2] != 0.0:
            self.diagnostics.error(
                "AE208", "a coating is at z = 0 of W, so its scene cannot be raised", include.span
            )
        return LabelledScene(loaded.module or loaded.name, added, include.scene.span)


def _empty(name: str, module: str | None, digest: str) -> Scene:
    return Scene(
        name=name,
        description="",
        robot=None,
        view=None,
        places={},
        bodies={},
        cameras={},
        instruments={},
        regions={},
        coatings={},
        conditions={},
        seals={},
        timers={},
        presses={},
        truth={},
        module=module,
        parts=(ScenePart(name, "", digest),),
    )


def add_scene(
    scene: Scene,
    name_or_path: str,
    module_folders: Sequence[str | os.PathLike[str]] = (),
    cameras: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
    variables: Mapping[str, Mapping[str, Sequence[str]]] | None = None,
) -> Scene:
    """Add the things of another scene file.

    Args:
        scene: the scene.
        name_or_path: as in `load_scene`.
        module_folders: as in `load_scene`.
        cameras: as in `load_scene`.
        variables: as in `load_scene`.

    Returns:
        Both together.

    Raises:
        UserError: there is no such file, it has problems, or both have the same names.
    """
    diagnostics = Diagnostics()
    added = load_scene(name_or_path, module_folders, cameras, variables)
    whole = merge(scene, added, None, diagnostics)
    diagnostics.raise_if_errors()
    return whole
