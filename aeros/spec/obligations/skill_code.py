"""Claims about the actions and the imports of module code, settled by reading it: nothing is imported or run.

Every action that a skill asks for is of a kind in its envelope and is written with that kind's parameters.
The code is written in the part of Python that `allowed_syntax` lists, in which nothing reaches outside.
A file may import names that another file of the module defines; each claim follows them to that file.
Python itself is not proved: code that is not trusted runs isolated, and the gate decides every action.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.model.configured import BoundNames
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.skill_syntax.action_calls import (
    ACTION_NAMES,
    action_calls,
    written_parameters,
)
from aeros.spec.obligations.skill_syntax.allowed_names import (
    GENERIC_TYPES,
    SKILL_INTERFACE,
    SKILL_NAMES,
    AllowedNames,
)
from aeros.spec.obligations.skill_syntax.allowed_syntax import Refusal, first_refusal
from aeros.spec.obligations.skill_syntax.bound_names import bound_names, names_bound_by
from aeros.spec.obligations.skill_syntax.changed_values import first_change_of_actions
from aeros.spec.obligations.skill_syntax.code_mistakes import first_code_mistake
from aeros.spec.obligations.skill_syntax.neighbour_errors import import_cycle_error, missing_neighbour_error
from aeros.spec.obligations.skill_syntax.neighbours import (
    ModuleFiles,
    files_run_by,
    files_run_together,
    neighbour_imports,
)
from aeros.spec.obligations.skill_syntax.perceiver_mistakes import first_perceiver_mistake
from aeros.spec.obligations.skill_syntax.perceiver_names import PERCEIVER_NAMES
from aeros.spec.obligations.skill_syntax.skill_source import Located, SkillFile, UnreadableCodeError
from aeros.spec.obligations.verdicts import StaticClaim

_CHANGE_HELP = (
    "yield each action where it is made, or change only what the code itself assigned to a name, "
    "as in `counts = {}`"
)


def skill_code_obligations(
    ecm: Ecm, site: Site, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Iterator[StaticClaim]:
    """Make every claim about the code of a module.

    Args:
        ecm: the module.
        site: site that declares the action kinds.
        files: the module's Python files by path relative to its folder.

    Yields:
        The claims, settled.
    """
    readable = {path: file for path, file in files.items() if isinstance(file, SkillFile)}
    perceiving = _files_of((one.module_name for one in ecm.perceivers.values()), readable)
    acting = _files_of((one.module_name for one in ecm.skills.values()), readable)
    for path in readable.keys() - perceiving - acting:  # no entry point leads to it, so nothing runs it
        looks_like_perceiver = _refusal(path, readable, SKILL_NAMES) and not _refusal(
            path, readable, PERCEIVER_NAMES
        )
        (perceiving if looks_like_perceiver else acting).add(path)
    skill_files = {path: readable[path] for path in readable if path in acting}
    for path, file in files.items():
        if isinstance(file, UnreadableCodeError):
            yield StaticClaim(ClaimForm.CODE_REACHES_NOTHING(path), file.diagnostic)
            continue
        kinds = [SKILL_NAMES] * (path in acting) + [PERCEIVER_NAMES] * (path in perceiving)
        yield StaticClaim(
            ClaimForm.CODE_REACHES_NOTHING(path), _no_forbidden_access(ecm, path, readable, kinds)
        )
        if any(neighbour_imports(file.tree)):
            yield StaticClaim(ClaimForm.CODE_FINDS_NEIGHBOURS(path), missing_neighbour_error(file, files))
        for perceiver in ecm.perceivers.values():
            if path == f"{perceiver.module_name}.py":
                mistake = first_perceiver_mistake(perceiver, ecm, readable)
                yield StaticClaim(ClaimForm.PERCEIVER_READS_GIVEN(perceiver.id), mistake)
        if path not in acting:
            continue
        yield StaticClaim(ClaimForm.CODE_ASKS_PLAINLY(path), _action_calls_are_readable(path, skill_files))
        for skill in ecm.skills.values():
            if path == f"{skill.module_name}.py":
                mistake = _requests_within_envelope(skill, ecm.names, site, readable)
                if mistake is None:
                    mistake = first_code_mistake(skill, ecm, site, readable)
                yield StaticClaim(ClaimForm.SKILL_ASKS_WITHIN_ENVELOPE(skill.id), mistake)
    if any(True for file in readable.values() for _ in neighbour_imports(file.tree)):
        yield StaticClaim(ClaimForm.CODE_IS_ACYCLIC(), import_cycle_error(readable))


def _files_of(entries: Iterable[str], files: ModuleFiles) -> set[str]:
    """Return the paths of the files that are executed for some entry points."""
    return {path for name in entries for path in files_run_by(f"{name}.py", files)}


def _no_forbidden_access(
    ecm: Ecm, path: str, files: ModuleFiles, kinds: Iterable[AllowedNames]
) -> Diagnostic | None:
    """Report the first place that is not on the allow-list of each kind of code that the file is."""
    for allowed in kinds:
        refusal = _refusal(path, files, allowed)
        if refusal is not None:
            return Diagnostic(
                "AE134",
                f"{allowed.kind} code of `{ecm.id}` {refusal.description}",
                SpanLabel(files[path].span(refusal.node), allowed.task),
                help=(refusal.help,),
                notes=_imported_by(path, files),
            )
    return None


def _refusal(path: str, files: ModuleFiles, allowed: AllowedNames) -> Refusal | None:
    imported = {name: file for name, file in files_run_by(path, files).items() if name != path}
    return first_refusal(files[path].tree, allowed, imported)


def _imported_by(path: str, files: ModuleFiles) -> tuple[str, ...]:
    """Name the files by which a file is code of a skill or of a perceiver."""
    importing = [
        name for name, file in files.items() if any(one.path == path for one in neighbour_imports(file.tree))
    ]
    return (f"`{path}` is imported by {', '.join(f'`{name}`' for name in importing)}",) if importing else ()


def _action_calls_are_readable(path: str, files: ModuleFiles) -> Diagnostic | None:
    """Check that every requested action can be read from the code of a file.

    `act` and `Action` are imported under their names and bound nowhere else. They are called, and `Action`
    also stands in types; neither is a value that could be called elsewhere. No name of the file is bound
    twice.
    """
    file = files[path]
    placed = {id(node.func) for node in file.nodes if isinstance(node, ast.Call)}
    placed |= {id(name) for name in _names_in_types(file) if name.id == "Action"}
    for node in file.nodes:
        if isinstance(node, ast.ImportFrom) and node.module == SKILL_INTERFACE and not node.level:
            renamed = [alias.name for alias in node.names if alias.asname not in (None, alias.name)]
            if renamed:
                return _unreadable_call(file, node, f"`{renamed[0]}` is imported under another name")
            placed |= {id(alias) for alias in node.names}
    place: Located | None = None
    for node in file.nodes_in_order:
        place = node if isinstance(node, Located) else place
        if place is None or id(node) in placed:
            continue
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in ACTION_NAMES:
            return _unreadable_call(file, node, f"`{node.id}` is used other than in a call")
        for name in names_bound_by(node):
            if name in ACTION_NAMES:
                return _unreadable_call(file, place, f"`{name}` is bound a second time")
    bound: set[str] = set()
    for statement in file.tree.body:
        for name in bound_names(statement):
            if name in bound:
                return _unreadable_call(file, statement, f"`{name}` is bound a second time")
            bound.add(name)
    changed = first_change_of_actions(path, files_run_together(path, files))
    if changed is not None:
        what = f"`{ast.unparse(changed)}` may be the parameters of an action, which was made before"
        return _unreadable_call(file, changed, what, _CHANGE_HELP)
    return None


def _names_in_types(file: SkillFile) -> Iterator[ast.Name]:
    """Yield the names that stand for a type: in annotations, and in brackets after a type."""
    bound = Counter(name for node in file.nodes for name in names_bound_by(node))
    imported = {
        alias.asname or alias.name: alias.name
        for node in file.tree.body
        if isinstance(node, ast.ImportFrom)
        and not node.level
        and node.module in ("collections.abc", "typing")
        for alias in node.names
    }
    # A name that is bound elsewhere too may stand for anything, such as `Union`, whose `Union[X]` is `X`.
    generic = {name for name in GENERIC_TYPES if bound[name] == 0}
    generic |= {name for name, origin in imported.items() if origin in GENERIC_TYPES and bound[name] == 1}
    # An annotation is evaluated too: `x[Action]` asks any other `x` for an item, and its error tells of it.
    hints = generic | {name for name in imported if bound[name] == 1}
    for node in file.nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.returns is not None:
            yield from _names_in_type(node.returns, hints)
        elif isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            yield from _names_in_type(node.annotation, hints)
        elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load) and _is(node.value, generic):
            yield from _names_in_type(node.slice, generic)


def _is(node: ast.expr, names: Collection[str]) -> bool:
    return isinstance(node, ast.Name) and node.id in names


def _names_in_type(hint: ast.expr, generic: Collection[str]) -> Iterator[ast.Name]:
    """Yield the names in a type, as far as it is written like one: nothing in it is called or bound."""
    match hint:
        case ast.Name(ctx=ast.Load()):
            yield hint
        case ast.Subscript(value=ast.Name(id=name), slice=inside) if name in generic:
            yield from _names_in_type(inside, generic)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            yield from (name for part in parts for name in _names_in_type(part, generic))
        case ast.BinOp(left=left, op=ast.BitOr(), right=right):
            yield from (*_names_in_type(left, generic), *_names_in_type(right, generic))


def _unreadable_call(
    file: SkillFile,
    node: Located,
    what: str,
    help_: str = "call `act(KIND, ...)` directly, and bind every name once",
) -> Diagnostic:
    return Diagnostic(
        "AE133",
        f"the actions that this code asks for cannot be determined: {what}",
        SpanLabel(file.span(node)),
        help=(help_,),
    )


def _requests_within_envelope(
    skill: Skill, names: BoundNames, site: Site, files: ModuleFiles
) -> Diagnostic | None:
    """Report the first action that the skill's code asks for and its envelope does not hold."""
    for file, call in action_calls(f"{skill.module_name}.py", skill.function, files):
        kind = call.args[0] if call.args else None
        if not (isinstance(kind, ast.Constant) and isinstance(kind.value, str)):
            return _unreadable_call(file, call, "the kind of an action is not written out")
        kind_of_site = names.kinds.get(kind.value, kind.value)
        if kind_of_site not in skill.envelope:
            near = did_you_mean(kind.value, (*skill.envelope, *names.kinds))
            help_ = f"did you mean `{near}`?" if near else f"declare `{kind.value}` in its `envelope`"
            return Diagnostic(
                "AE133",
                f"`{skill.id}` asks for `{kind.value}`, which is not in its envelope",
                SpanLabel(file.span(kind), "asked for here"),
                (SpanLabel(skill.span, "declared here"),),
                help=(help_,),
            )
        declared = site.kinds[kind_of_site].parameters
        asked = written_parameters(call)
        if asked is None:
            return _unreadable_call(file, call, "the parameters of an action are not written out")
        unknown = [name for name in asked if name not in declared]
        if unknown:
            near = did_you_mean(unknown[0], declared)
            help_ = f"did you mean `{near}`?" if near else f"it has {', '.join(declared) or 'none'}"
            headline = f"`{kind.value}` has no parameter `{unknown[0]}`"
            return Diagnostic("AE133", headline, SpanLabel(file.span(call)), help=(help_,))
    return None
