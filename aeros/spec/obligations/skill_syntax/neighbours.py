"""Imports of a module's files from each other, as in `from .pieces import find_plate`.

Only this form is read: one dot, the name of a file beside, and names that are defined at the top of that file
by `def`, `class` or an assignment.  So the file in which a name is defined can be read off each import, and
every claim about code follows a name from file to file.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from aeros.spec.obligations.skill_syntax.bound_names import bound_names
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

ModuleFiles = Mapping[str, SkillFile]
"""The readable Python files of a module by path relative to its folder."""


class NeighbourImport(NamedTuple):
    """A name that a file imports from a file beside it.

    Attributes:
        statement: the import.
        alias: the part of it for this name.
        path: path of the file that is named, relative to the module's folder.
    """

    statement: ast.ImportFrom
    alias: ast.alias
    path: str

    @property
    def local_name(self) -> str:
        """Name by which the importing file knows it."""
        return self.alias.asname or self.alias.name


def is_neighbour_import(node: ast.ImportFrom) -> bool:
    """Tell if an import names a file beside the importing one.

    Args:
        node: the import.

    Returns:
        True for `from .FILE import NAME`, where FILE is one name.
    """
    return node.level == 1 and node.module is not None and "." not in node.module


def neighbour_imports(tree: ast.Module) -> Iterator[NeighbourImport]:
    """Yield every name that a file imports from another file of its module, in order.

    Args:
        tree: syntax tree of the file.

    Yields:
        The imports; the named file need not exist.
    """
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and is_neighbour_import(node):
            yield from (NeighbourImport(node, alias, f"{node.module}.py") for alias in node.names)


def defined_names(tree: ast.Module) -> frozenset[str]:
    """Return the names that other files may import from a file.

    Args:
        tree: syntax tree of the file.

    Returns:
        Names bound at its top otherwise than by an import.
    """
    statements = (one for one in tree.body if not isinstance(one, ast.Import | ast.ImportFrom))
    return frozenset(name for one in statements for name in bound_names(one))


def defined_classes(tree: ast.Module) -> list[ast.ClassDef]:
    """Return the classes at the top of a file.

    Args:
        tree: syntax tree of the file.

    Returns:
        The classes, in order.
    """
    return [node for node in tree.body if isinstance(node, ast.ClassDef)]


def imported_classes(tree: ast.Module, files: ModuleFiles) -> set[str]:
    """Return the names by which a file knows classes of other files.

    Args:
        tree: syntax tree of the file.
        files: the module's files.

    Returns:
        The names.
    """
    defined = {(path, node.name) for path, file in files.items() for node in defined_classes(file.tree)}
    return {one.local_name for one in neighbour_imports(tree) if (one.path, one.alias.name) in defined}


def files_run_by(path: str, files: ModuleFiles) -> dict[str, SkillFile]:
    """Find the files that are executed where one is: itself, and all that it imports, directly or not.

    Args:
        path: path of the file.
        files: the module's files.

    Returns:
        The files by path, the file itself first; files that are missing or unreadable are left out.
    """
    found: dict[str, SkillFile] = {}
    pending = [path]
    while pending:
        one = pending.pop()
        if one in files and one not in found:
            found[one] = files[one]
            pending += [imported.path for imported in neighbour_imports(files[one].tree)]
    return found


def files_run_together(path: str, files: ModuleFiles) -> ModuleFiles:
    """Find the files that some entry point may execute together with a file.

    Args:
        path: path of the file.
        files: files of the module.

    Returns:
        The file, and all that are linked to it by imports, in whichever direction, by path.
    """
    found: set[str] = set()
    pending = [path]
    while pending:
        one = pending.pop()
        if one in found:
            continue
        found.add(one)
        for other, file in files.items():
            imported = {each.path for each in neighbour_imports(file.tree)}
            if one in imported:
                pending.append(other)
            elif one == other:
                pending += imported & files.keys()
    return {one: files[one] for one in files if one in found}


def import_cycle(files: ModuleFiles) -> tuple[tuple[str, NeighbourImport], ...]:
    """Find files that import each other in a circle.

    Args:
        files: the module's files.

    Returns:
        Each file of one such circle with the import that leads to the next one; empty if there is none.
    """
    done: set[str] = set()
    for start in files:
        trail: list[tuple[str, NeighbourImport]] = []
        pending = [(start, neighbour_imports(files[start].tree))]
        while pending:
            path, imports = pending[-1]
            imported = next(imports, None)
            if imported is None:
                done.add(path)
                pending.pop()
                trail = trail[:-1]
            elif imported.path in (ahead := [one for one, _ in pending]):
                return (*trail, (path, imported))[ahead.index(imported.path) :]
            elif imported.path in files and imported.path not in done:
                trail.append((path, imported))
                pending.append((imported.path, neighbour_imports(files[imported.path].tree)))
    return ()
