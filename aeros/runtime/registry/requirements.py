"""Requirements of a module that is about to be installed: what is missing, and what would provide it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.load import decode_manifest
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.versions import suits


def require_installed(module: declared.Ecm, installed: Iterable[Path], source: Path) -> None:
    """Require that every module and capability that a module needs is installed.

    Args:
        module: the module, as it declares itself.
        installed: folders of the installed modules.
        source: folder that it comes from; modules next to it may be proposed.

    Raises:
        UserError: something is missing; a diagnostic for each names a module that would provide it.
    """
    here = _by_id(folder for folder in installed if folder.is_dir())
    modules = [name for name, _ in module.dependencies.modules if name.value not in here]
    capabilities = [
        (name, one.version)
        for name, one in module.dependencies.required_capabilities
        if not _providers(here, name.value, one.version.value)
    ]
    if not modules and not capabilities:
        return
    nearby = _by_id(_modules_next_to(source))
    problems = []
    for name in modules:
        found = [folder for one, folder in nearby.values() if one.id.value == name.value]
        problems.append(_missing("AE301", module, f"the module `{name.value}`", name.span, found))
    for name, text in capabilities:
        found = [folder for _, folder in _providers(nearby, name.value, text.value)]
        offers = ((one, other.capability_versions.get(name.value)) for one, (other, _) in here.items())
        others = ", ".join(f"`{one}` {version}" for one, version in offers if version is not None)
        what = f"the capability `{name.value}` {text.value}"
        code = "AE306" if others else "AE305"
        problems.append(_missing(code, module, what, name.span, found, others))
    raise UserError(problems)


def _modules_next_to(source: Path) -> list[Path]:
    """List the module folders next to a source, which itself is not read again."""
    own = source.resolve()
    try:
        return sorted(one for one in own.parent.iterdir() if one != own and (one / MANIFEST).is_file())
    except OSError:
        return []


def _by_id(folders: Iterable[Path]) -> dict[str, tuple[declared.Ecm, Path]]:
    found = ((decode_manifest(folder), folder) for folder in folders)
    return {one.id.value: (one, folder) for one, folder in found if one is not None}


def _providers(
    modules: Mapping[str, tuple[declared.Ecm, Path]], capability: str, specifier: str
) -> list[tuple[declared.Ecm, Path]]:
    return [(one, folder) for one, folder in modules.values() if provides(one, capability, specifier)]


def provides(module: declared.Ecm, capability: str, specifier: str) -> bool:
    """Say if a module provides a capability in a version that suits.

    Args:
        module: the module, as it declares itself.
        capability: name of the capability.
        specifier: version range.

    Returns:
        True if it does.
    """
    version = module.capability_versions.get(capability)
    return version is not None and suits(specifier, version)


def _missing(
    code: str, module: declared.Ecm, what: str, at: SourceSpan, folders: Iterable[Path], others: str = ""
) -> Diagnostic:
    help_ = tuple(f"`aeros install {folder}` provides it" for folder in folders)
    headline = f"`{module.id.value}` needs {what}, and "
    headline += f"installed is only {others}" if others else "nothing that is installed provides it"
    return Diagnostic(code, headline, SpanLabel(at), help=help_ or ("install a module that provides it",))
