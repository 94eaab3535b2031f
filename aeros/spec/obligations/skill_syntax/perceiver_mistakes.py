"""Mistakes of perceiver code that show without a run.

They are readings, pictures and models that it never gets, and values that it yields and does not provide.
As in `code_mistakes`, only a key that is written out is reported.  A function that several perceivers run may
read and yield the names of any of them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import MEMORY, Perceiver
from aeros.spec.obligations.skill_syntax.mapping_keys import missing_keys, parameters_of_type
from aeros.spec.obligations.skill_syntax.model_mistakes import model_mistakes
from aeros.spec.obligations.skill_syntax.neighbours import ModuleFiles
from aeros.spec.obligations.skill_syntax.returned_keys import undeclared_keys


def first_perceiver_mistake(perceiver: Perceiver, ecm: Ecm, files: ModuleFiles) -> Diagnostic | None:
    """Find the first mistake in the function of a perceiver.

    Args:
        perceiver: the perceiver.
        ecm: its module.
        files: the module's files, that of the perceiver among them.

    Returns:
        The mistake; None if there is none.
    """
    of_function = (perceiver.module_name, perceiver.function)
    sharing = [one for one in ecm.perceivers.values() if (one.module_name, one.function) == of_function]
    return next(_mistakes(perceiver, sharing, ecm, files), None)


def _mistakes(
    perceiver: Perceiver, sharing: Sequence[Perceiver], ecm: Ecm, files: ModuleFiles
) -> Iterator[Diagnostic]:
    file = files[f"{perceiver.module_name}.py"]
    entry = file.functions.get(perceiver.function)
    if entry is None:
        return
    readings = [name for one in sharing for name in (*one.read_as, *one.constants)]
    readings += [MEMORY for one in sharing if one.recalls]
    pictures = [picture.name for one in sharing for picture in one.pictures]
    sampled = [name for one in sharing if one.rate is not None for name in one.read_as]
    known = {
        "readings": (readings, f"among the `readings` of `{perceiver.id}`"),
        "pictures": (pictures, f"among the `pictures` of `{perceiver.id}`"),
        "samples": (
            sampled,
            f"a reading that `{perceiver.id}` gets between two calls, as it does with a `rate`",
        ),
    }
    for view in parameters_of_type(entry, "View"):
        for attribute, (keys, noun) in known.items():
            yield from missing_keys(file, entry, view, keys, noun, attribute)
    for models in parameters_of_type(entry, "Models"):
        named = [name for one in sharing for name in one.models]
        yield from missing_keys(file, entry, models, named, f"a model of `{perceiver.id}`")
        yield from model_mistakes(file, entry, models, {name: ecm.models[name] for name in named})
    provided = [name.removeprefix(f"{ecm.id}.") for one in sharing for name in one.provides]
    noun = f"among the values that `{perceiver.id}` provides"
    yield from undeclared_keys(file, entry, ast.Yield, provided, noun)
