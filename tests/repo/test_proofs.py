"""The folder of theorems is whole; that they are proved, `make test` asks of `aeros prove`."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from aeros.spec.theorems.theorem_folder import EXPECTED, load_theorem, proofs_folder, theorem_folders
from tests.repo.tree import ROOT, text_of

_FOLDERS = theorem_folders(proofs_folder())
_HEADINGS = ["Claim", "Why it matters", "How it is proved", "Assumptions", "Not modelled", "Mutants"]


def test_the_theorems_are_those_of_this_tree() -> None:
    assert proofs_folder() == ROOT / "proofs"
    assert _FOLDERS


@pytest.mark.parametrize("command", ["prove", "verify ecms/ --check"])
def test_make_test_proves_them_and_that_every_certificate_is_current(command: str) -> None:
    makefile = text_of("Makefile")
    recipe = rf"^proofs:.*\n(\t.*\n)*\t@\$\(BIN\)/aeros {command}$"
    assert re.search(recipe, makefile, re.MULTILINE)
    assert re.search(r"^test:.*\n\t@\$\(MAKE\).* types format lint layers proofs; ", makefile, re.MULTILINE)


@pytest.mark.parametrize("folder", _FOLDERS.values(), ids=_FOLDERS)
def test_a_theorem_has_all_that_belongs_to_it(folder: Path) -> None:
    theorem = load_theorem(folder)
    headings = re.findall(r"^## (.+)$", (folder / "statement.md").read_text("utf-8"), re.MULTILINE)
    assert headings == _HEADINGS
    assert theorem.mutants
    assert {one.refuted_obligation for one in theorem.mutants} <= theorem.obligations.keys()
    wanted = {"statement.md", EXPECTED, *(f"{name}.smt2" for name in theorem.obligations)}
    programs = {path.name for path in folder.glob("*.py")}
    assert "theorem.py" in programs
    assert {path.name for path in folder.iterdir() if path.name != "__pycache__"} == wanted | programs


# Two of a kind stand for any number of them where a loop carries nothing from one to the next.

_LOOPS = [
    (module, function)
    for module, functions in {
        "aeros/runtime/gate/finite_layers.py": (
            "finite_objections",
            "_access_objections",
            "_malformed_usage_objections",
        ),
        "aeros/runtime/gate/gate.py": ("_failed_reasons",),
        "aeros/runtime/gate/request_check.py": ("unpack_arguments", "unpack_readings"),
        "aeros/runtime/gate/joint_rules.py": ("objections", "rules_for_pair", "_shared_actuators"),
    }.items()
    for function in functions
]


def _carried(loop: ast.For) -> set[str]:
    """List what an iteration reads and an earlier one may have assigned, or how the loop ends early."""
    carried: set[str] = set()
    targets = [node.target for node in ast.walk(loop) if isinstance(node, ast.For | ast.comprehension)]
    own = {node.id for one in targets for node in ast.walk(one) if isinstance(node, ast.Name)}
    assigned = {
        node.id
        for statement in loop.body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    known = set(own)
    for statement in loop.body:
        nodes = [node for node in ast.walk(statement) if isinstance(node, ast.Name)]
        read = {node.id for node in nodes if isinstance(node.ctx, ast.Load)}
        always = isinstance(statement, ast.Assign)
        carried |= read & (assigned - known)
        known |= {node.id for node in nodes if isinstance(node.ctx, ast.Store)} if always else set()
        carried |= {
            type(node).__name__ for node in ast.walk(statement) if isinstance(node, ast.Break | ast.Return)
        }
    return carried


@pytest.mark.parametrize(("module", "function"), _LOOPS)
def test_a_loop_over_things_of_a_kind_treats_each_by_itself(module: str, function: str) -> None:
    found = [
        node
        for node in ast.walk(ast.parse(text_of(module)))
        if isinstance(node, ast.FunctionDef) and node.name == function
    ]
    loops = [node for each in found for node in ast.walk(each) if isinstance(node, ast.For)]
    assert loops
    assert [name for loop in loops for name in _carried(loop)] == []


@pytest.mark.parametrize(
    "body",
    ["total = total + one", "if one: last = one\n    print(last)", "if one: break", "if one: return one"],
)
def test_a_loop_that_carries_something_on_would_be_noticed(body: str) -> None:
    function = ast.parse(f"def f(ones):\n  for one in ones:\n    {body}").body[0]
    assert isinstance(function, ast.FunctionDef)
    (loop,) = function.body
    assert isinstance(loop, ast.For)
    assert _carried(loop)
