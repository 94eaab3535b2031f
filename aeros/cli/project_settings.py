"""Settings of a project: the options that `aeros.toml`, or `[tool.aeros]` of `pyproject.toml`, gives."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from aeros.exit_codes import UsageError

SETTINGS: Final = "aeros.toml"
_PYPROJECT: Final = "pyproject.toml"


@dataclass(frozen=True, slots=True)
class ProjectSettings:
    """Values of options that a project gives.

    Attributes:
        path: the file; None if there is none.
        options: values by name of the option without dashes, in the types that the parser gives it.
    """

    path: Path | None = None
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


def find_settings(folder: Path, names: Sequence[str] = ("site", "ecms", "state", "plant")) -> ProjectSettings:
    """Read the settings of the project that a folder belongs to.

    The nearest file counts, in the folder or above it, up to the root of a Git repository or the home folder.

    Args:
        folder: where the program was started.
        names: settings that are wanted; the values of others are not looked at.

    Returns:
        The settings; those of no file if there is none. Without a setting of its own, the state is in the
        folder of the file, so that all folders of a project have one robot.

    Raises:
        UsageError: the file cannot be read or understood; names file, cause and cure.
    """
    start = folder.absolute()
    for place in (start, *start.parents):
        for name, read_table in ((SETTINGS, _whole), (_PYPROJECT, _tool_table)):
            path = place / name
            table = read_table(path, _read(path)) if path.is_file() else None
            if table is not None:
                for key in table:
                    _require_known(path, key)
                given = {"state": ".aeros", **table}
                options = {key: _option(path, key, given[key]) for key in names if key in given}
                return ProjectSettings(path, MappingProxyType(options))
        if (place / ".git").exists() or place == Path.home():
            break
    return ProjectSettings()


def _read(path: Path) -> Mapping[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"`{path}` cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise UsageError(f"`{path}` is not UTF-8: save it as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"`{path}` is not TOML: {error}") from error


def _whole(_: Path, table: Mapping[str, Any]) -> Mapping[str, Any]:
    return table


def _tool_table(path: Path, table: Mapping[str, Any]) -> Mapping[str, Any] | None:
    tools = table.get("tool", {})
    own = tools.get("aeros") if isinstance(tools, dict) else None
    if own is not None and not isinstance(own, dict):
        raise UsageError(f"`{path}`: `tool.aeros` is no table: write `[tool.aeros]`")
    return own


def _require_known(path: Path, key: str) -> None:
    """Refuse a setting of another name.

    Raises:
        UsageError: it is unknown.
    """
    if key not in _READERS:
        near = get_close_matches(key, _READERS, 1, 0.6)
        cure = (
            f"did you mean `{near[0]}`?"
            if near
            else f"settings are {', '.join(f'`{one}`' for one in _READERS)}"
        )
        raise UsageError(f"{_place(path, key)}: `{key}` is no setting; {cure}")


def _option(path: Path, key: str, value: Any) -> Any:
    """Check a setting, and turn it to what the parser makes of its option.

    Raises:
        UsageError: its value cannot be used.
    """
    try:
        return _READERS[key](path.parent, value)
    except ValueError as error:
        raise UsageError(f"{_place(path, key)}: `{key}` is {value!r}; {error}") from error


def _place(path: Path, key: str) -> str:
    """Name the line of a key, which the reader of TOML does not tell."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if line.partition("=")[0].strip().strip("\"'") == key:
            return f"`{path}`, line {number}"
    return f"`{path}`"


def _text(_: Path, value: Any) -> str:
    if not isinstance(value, str) or not value or not value.isprintable():
        raise ValueError("expected text on one line")
    return value


def _path(folder: Path, value: Any) -> Path:
    return Path(os.path.relpath(folder / _text(folder, value)))


def _existing(folder: Path, value: Any) -> Path:
    path = _path(folder, value)
    if not path.exists():
        raise ValueError(f"`{path}` does not exist")
    return path


def _existing_list(folder: Path, value: Any) -> list[Path]:
    given = value if isinstance(value, list) else [value]
    if not given:
        raise ValueError("expected at least one path")
    return [_existing(folder, one) for one in given]


_READERS: Final[Mapping[str, Callable[[Path, Any], Any]]] = {
    "site": _existing,
    "ecms": _existing_list,
    "state": _path,
    "plant": _text,
}
"""Readers of the value of each setting, given the folder of the file."""
