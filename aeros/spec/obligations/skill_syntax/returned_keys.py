"""Keys of the dictionaries that a skill returns or a perceiver yields, against those that are declared.

Only a dictionary that is written where it is returned or yielded is checked: one with a name may change.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.obligations.skill_syntax.mapping_keys import unknown_key
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile


def undeclared_keys(
    file: SkillFile,
    entry: ast.FunctionDef,
    leaving: type[ast.Return | ast.Yield],
    declared: Collection[str],
    noun: str,
) -> Iterator[Diagnostic]:
    """Find keys of the values of a function that are not declared.

    Args:
        file: the file of the function.
        entry: the function.
        leaving: `Return` for the values that it returns, `Yield` for those that it yields.
        declared: the keys that there may be.
        noun: description of these, as in `an output of wipe`.

    Yields:
        A diagnostic for each place.
    """
    values = [node.value for node in file.own_nodes_of(entry) if isinstance(node, leaving)]
    places = [place for value in values if isinstance(value, ast.Dict) for place in value.keys]
    for place in places:
        if isinstance(place, ast.Constant) and isinstance(place.value, str) and place.value not in declared:
            yield unknown_key(file, place, place.value, declared, noun)
