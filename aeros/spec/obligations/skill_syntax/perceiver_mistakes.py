"""Mistakes of perceiver code that show without a run: readings, pictures and models that it never gets.

As in `code_mistakes`, only a key that is written out is reported.
"""

from __future__ import annotations

from collections.abc import Iterator

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.model.perception import MEMORY, Perceiver
from aeros.spec.obligations.skill_syntax.code_mistakes import missing_keys, parameters_of_type
from aeros.spec.obligations.skill_syntax.neighbours import ModuleFiles


def first_perceiver_mistake(perceiver: Perceiver, files: ModuleFiles) -> Diagnostic | None:
    """Find the first mistake in the function of a perceiver.

    Args:
        perceiver: the perceiver.
        files: the module's files, that of the perceiver among them.

    Returns:
        The mistake; None if there is none.
    """
    return next(_mistakes(perceiver, files), None)


def _mistakes(perceiver: Perceiver, files: ModuleFiles) -> Iterator[Diagnostic]:
    file = files[f"{perceiver.module_name}.py"]
    entry = file.functions.get(perceiver.function)
    if entry is None:
        return
    readings = [*perceiver.read_as, *perceiver.constants, *([MEMORY] if perceiver.recalls else [])]
    known = {
        "readings": (readings, f"among the `readings` of `{perceiver.id}`"),
        "pictures": ([one.name for one in perceiver.pictures], f"among the `pictures` of `{perceiver.id}`"),
        "samples": (
            [] if perceiver.rate is None else list(perceiver.read_as),
            f"a reading that `{perceiver.id}` gets between two calls, as it does with a `rate`",
        ),
    }
    for view in parameters_of_type(entry, "View"):
        for attribute, (keys, noun) in known.items():
            yield from missing_keys(file, entry, view, keys, noun, attribute)
    for models in parameters_of_type(entry, "Models"):
        yield from missing_keys(file, entry, models, perceiver.models, f"a model of `{perceiver.id}`")
