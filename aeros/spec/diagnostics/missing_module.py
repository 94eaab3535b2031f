"""The error for a module that another one requires and that is not among those verified."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan


def missing_module(code: str, module: str, needed: str, at: SourceSpan) -> Diagnostic:
    """Make the error for a required module that is missing or cannot be read.

    Args:
        code: AE301, which a reader of the caller can see to be one that it reports.
        module: id of the module that requires the other.
        needed: id of the required module.
        at: place of the dependency in the manifest.

    Returns:
        The error.
    """
    return Diagnostic(
        code,
        f"`{module}` needs `{needed}`, which is missing or cannot be read",
        SpanLabel(at),
        help=(
            f"put the folder of `{needed}` next to that of `{module}`, or name both folders in one command",
            "if it is there, `aeros verify` with its folder says why it cannot be read",
        ),
    )
