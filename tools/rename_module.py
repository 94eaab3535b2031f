"""Move modules of this repository and rewrite everything that names them.

    python tools/rename_module.py aeros/runtime/gate.py aeros/runtime/gate/gate.py
    python tools/rename_module.py --from moves.txt      # one "OLD NEW" a line

A move is a `git mv` of the module and of the tests that mirror it (`tests/unit/runtime/test_gate.py` and
`test_gate_*.py`).  Then imports, dotted names and quoted paths are rewritten in every tracked text file:
code, tests, proofs (with the sources that their mutants name), docs, TOML and workflows.  `OLD` may be a
package folder; all that is in it moves.  Several moves are one step, so names may be exchanged.

Commit first: what the tool does is undone by `git reset --hard`.  Afterwards it sorts imports, formats what
it touched and writes the map in docs/architecture.md again.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
TEXT: Final = {
    ".py",
    ".md",
    ".toml",
    ".yml",
    ".yaml",
    ".cfg",
    ".ini",
    ".txt",
    ".json",
    ".importlinter",
    ".smt2",
}
UNTOUCHED: Final = (
    "CHANGELOG.md",
    "docs/results/",
    "tests/corpus/accepted/",
    "tests/corpus/rejected/",
    "tests/corpus/site/",
    "tools/rename_module.py",
)
"""Files that tell of the past, or are data: they keep the names that they have."""
DONE: Final = "\N{SYMBOL FOR NULL}"
"""Stands for the dots of a name that is already the new one, so that it is not rewritten once more."""
ROOTS: Final = ("aeros", "proofs", "tests", "benchmarks", "tools")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("paths", nargs="*", metavar="OLD NEW", help="paths of modules, two by two")
    parser.add_argument("--from", dest="listed", type=Path, help="file with one `OLD NEW` a line")
    options = parser.parse_args()
    named = list(options.paths)
    if options.listed:
        lines = options.listed.read_text(encoding="utf-8").splitlines()
        named += [word for line in lines if not line.startswith("#") for word in line.split()]
    if not named or len(named) % 2:
        parser.error("paths are named two by two: OLD NEW")
    os.chdir(ROOT)
    files = _tracked()
    try:
        asked = dict(zip(named[::2], named[1::2], strict=True))
        folders = {**asked, **_mirrored_folders(asked)}
        folders = {old: new for old, new in folders.items() if Path(old).is_dir()}
        moves = _file_moves({**asked, **folders}, files)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    _git_mv(moves)
    _add_packages(moves.values())
    touched = _rewrite(moves, [moves.get(name, name) for name in files], folders)
    _tidy(touched)
    return 0


def _tracked() -> list[str]:
    listed = subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True)  # noqa: S607
    return [name for name in listed.stdout.splitlines() if Path(name).is_file()]


def _file_moves(asked: Mapping[str, str], files: list[str]) -> dict[str, str]:
    """Map each file that moves to its new path: modules, what is in moved folders, mirrored tests.

    Raises:
        ValueError: A path names nothing that git tracks, or a target is taken.
    """
    moves: dict[str, str] = {}
    for old, new in asked.items():
        inside = [name for name in files if name == old or name.startswith(old.rstrip("/") + "/")]
        if not inside:
            raise ValueError(f"{old} is not a tracked file or folder")
        for name in inside:
            target = new.rstrip("/") + name[len(old.rstrip("/")) :]
            if name == old or name not in asked:
                moves[name] = target
    # A module's own row says more of its tests than the row of its folder.
    for old, new in list(moves.items()):
        moves.update(_mirrored_tests(old, new, files))
    stay = set(files) - moves.keys()
    targets = list(moves.values())
    occupied = sorted({target for target in targets if target in stay or targets.count(target) > 1})
    if occupied:
        raise ValueError(f"these targets are taken: {', '.join(occupied)}")
    return {old: new for old, new in moves.items() if old != new}


def _mirrored_folders(asked: Mapping[str, str]) -> dict[str, str]:
    """Map the folders of tests that mirror moved packages."""
    mirrored = {
        str(Path("tests/unit").joinpath(*Path(old).parts[1:])): str(
            Path("tests/unit").joinpath(*Path(new).parts[1:])
        )
        for old, new in asked.items()
        if old.startswith("aeros/") and Path(old).is_dir()
    }
    return {old: new for old, new in mirrored.items() if Path(old).is_dir()}


def _mirrored_tests(old: str, new: str, files: list[str]) -> Iterator[tuple[str, str]]:
    """Yield (old, new) for the tests in tests/unit that are named for the module `old`."""
    if not (old.startswith("aeros/") and old.endswith(".py")) or old.endswith("__init__.py"):
        return
    here, there = Path(old), Path(new)
    folder = Path("tests/unit").joinpath(*here.parent.parts[1:])
    siblings = {Path(name).stem for name in files if Path(name).parent == here.parent}
    for name in files:
        path = Path(name)
        if path.parent != folder or not path.stem.startswith("test_"):
            continue
        subject = path.stem.removeprefix("test_")
        owners = [stem for stem in siblings if subject == stem or subject.startswith(f"{stem}_")]
        if owners and max(owners, key=len) == here.stem:
            renamed = f"test_{there.stem}{subject[len(here.stem) :]}.py"
            yield name, str(Path("tests/unit").joinpath(*there.parent.parts[1:], renamed))


def _git_mv(moves: Mapping[str, str]) -> None:
    """Move in two passes, so that one module may take the place of another."""
    aside = {old: f"{old}.moving" for old in moves}
    for old, new in [*aside.items(), *((aside[old], new) for old, new in moves.items())]:
        Path(new).parent.mkdir(parents=True, exist_ok=True)
        subprocess.run(["git", "mv", old, new], check=True)  # noqa: S603, S607


def _add_packages(targets: Iterable[str]) -> None:
    """Give each new package of aeros/ and proofs/ an `__init__.py`, whose docstring is to be written."""
    for target in targets:
        for folder in Path(target).parents:
            if folder.parts[:1] == ("aeros",) and target.endswith(".py"):
                marker = folder / "__init__.py"
                if not marker.exists():
                    marker.write_text(
                        f'"""{folder.name.replace("_", " ").capitalize()}."""\n', encoding="utf-8"
                    )
                    subprocess.run(["git", "add", str(marker)], check=True)  # noqa: S603, S607
                    print(f"write the docstring of {marker}")


def _dotted(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _rewrite(moves: Mapping[str, str], files: Iterable[str], folders: Mapping[str, str]) -> list[str]:
    """Rewrite what names moved modules, and return the files that changed."""
    modules = {_dotted(old): _dotted(new) for old, new in moves.items() if old.endswith(".py")}
    came_from = {new: old for old, new in moves.items()}
    touched = list(moves.values())
    for name in files:
        path = Path(name)
        if path.suffix not in TEXT or name.startswith(UNTOUCHED):
            continue
        text = before = path.read_text(encoding="utf-8")
        if path.suffix == ".py":
            text = _rewrite_module_imports(text, modules)
            text = _rewrite_file_anchors(text, came_from.get(name, name), name, folders)
        text = _rewrite_names(text, moves, modules).replace(DONE, ".")
        if text != before:
            path.write_text(text, encoding="utf-8")
            touched.append(name)
    return touched


def _rewrite_names(text: str, moves: Mapping[str, str], modules: Mapping[str, str]) -> str:
    """Rewrite dotted names and paths, each as a whole: the longest moved prefix counts."""

    def dotted(match: re.Match[str]) -> str:
        parts = match[0].split(".")
        for end in range(len(parts), 1, -1):
            new = modules.get(".".join(parts[:end]))
            if new is not None:
                return ".".join([new, *parts[end:]])
        return match[0]

    def path(match: re.Match[str]) -> str:
        return moves.get(match[0], match[0])

    def short_path(match: re.Match[str]) -> str:
        new = moves.get(f"aeros/{match[0]}")
        return match[0] if new is None else new.removeprefix("aeros/")

    roots = "|".join(ROOTS)
    text = re.sub(rf"(?<![\w./-])(?:{roots})(?:\.\w+)+", dotted, text)
    text = re.sub(rf"(?<![\w-])(?:{roots})/[\w/]+\.py\b", path, text)
    return re.sub(r"(?<![\w./-])(?:runtime|spec|agent|sim|cli|experiments)/[\w/]+\.py\b", short_path, text)


def _rewrite_module_imports(text: str, modules: Mapping[str, str]) -> str:
    """Rewrite `from package import module` where the module moved."""
    tree = ast.parse(text)
    lines = text.splitlines(keepends=True)
    bound = {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    bound |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    renamed: dict[str, str] = {}
    edits: list[tuple[int, int, str]] = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or node.level or not node.module:
            continue
        if not any(f"{node.module}.{alias.name}" in modules for alias in node.names):
            continue
        indent = " " * node.col_offset
        statements = []
        for alias in node.names:
            new = modules.get(f"{node.module}.{alias.name}", f"{node.module}.{alias.name}")
            package, _, leaf = new.rpartition(".")
            asname = alias.asname
            if asname is None and leaf != alias.name:
                if alias.name in bound or leaf in used | bound:
                    asname = alias.name
                else:
                    renamed[alias.name] = leaf
            package = package.replace(".", DONE)
            statements.append(
                f"{indent}from {package} import {leaf}" + (f" as {asname}" if asname else "") + "\n"
            )
        edits.append((node.lineno, node.end_lineno or node.lineno, "".join(statements)))
    spans = [
        (node.lineno, node.col_offset, node.id)
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and node.id in renamed
    ]
    for row, column, name in sorted(spans, reverse=True):
        raw = lines[row - 1].encode()
        lines[row - 1] = (raw[:column] + renamed[name].encode() + raw[column + len(name) :]).decode()
    for first, last, statement in sorted(edits, reverse=True):
        lines[first - 1 : last] = [statement]
    return "".join(lines)


def _rewrite_file_anchors(text: str, old: str, new: str, folders: Mapping[str, str]) -> str:
    """Keep `Path(__file__).parent / ...` at the folder that it meant before the file moved."""
    if old == new or "__file__" not in text:
        return text

    def anchored(match: re.Match[str]) -> str:
        folder = Path(old).parents[int(match["index"] or 0)]
        for moved, target in folders.items():
            if folder == Path(moved) or Path(moved) in folder.parents:
                folder = Path(target) / folder.relative_to(moved)
                break
        shared = next(parent for parent in Path(new).parents if parent == folder or parent in folder.parents)
        index = list(Path(new).parents).index(shared)
        rest = "".join(f' / "{part}"' for part in folder.relative_to(shared).parts)
        return f"{match['head']}.parent{f's[{index}]' if index else ''}{rest}"

    text = re.sub(r"Path\(__file__\)\.with_name\((\"[^\"]+\")\)", r"Path(__file__).parent / \1", text)
    return re.sub(r"(?P<head>Path\(__file__\))\.parent(?:s\[(?P<index>\d+)\])?(?!\w)", anchored, text)


def _tidy(touched: Iterable[str]) -> None:
    """Sort the imports of what was touched, format it, and write the map of the tree again."""
    code = sorted({name for name in touched if name.endswith(".py")})
    run = [sys.executable, "-m"]
    subprocess.run([*run, "ruff", "check", "--quiet", "--select", "I", "--fix", *code], check=False)  # noqa: S603
    subprocess.run([*run, "ruff", "format", "--quiet", *code], check=False)  # noqa: S603
    subprocess.run(  # noqa: S603
        [*run, "pytest", "-q", "--no-header", "tests/repo/test_architecture.py", "-k", "map_of_the_tree"],
        check=False,
        env={**os.environ, "AEROS_UPDATE_GOLDEN": "1"},
        stdout=subprocess.DEVNULL,
    )


if __name__ == "__main__":
    sys.exit(main())
