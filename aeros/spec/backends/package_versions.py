"""Version of an installed package, read without importing it."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path


def z3_version() -> str:
    """Return the version of the distribution `z3-solver`.

    Returns:
        The version in its metadata.
    """
    return package_version("z3-solver", "z3")


@cache
def package_version(distribution: str, package: str) -> str:
    """Return the version of the distribution that `import package` would import.

    It is in the name of the `.dist-info` folder next to the package, if an installer wrote exactly one.
    `importlib.metadata` says the same, but importing it costs more than all else that a cached proof needs.

    Args:
        distribution: name on the package index.
        package: name of the import.

    Returns:
        The version in its metadata.

    Raises:
        importlib.metadata.PackageNotFoundError: the distribution is not installed.
    """
    spec = find_spec(package)
    siblings = () if spec is None or spec.origin is None else Path(spec.origin).parents[1].iterdir()
    start = distribution.replace("-", "_").lower() + "-"
    folders = [
        path.name for path in siblings if path.name.lower().startswith(start) and path.suffix == ".dist-info"
    ]
    if len(folders) == 1:
        return folders[0][len(start) :].removesuffix(".dist-info")
    from importlib.metadata import version

    return version(distribution)
