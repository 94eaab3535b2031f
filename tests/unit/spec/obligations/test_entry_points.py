from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.skill_syntax.skill_source import read_skill_files
from tests.reports_in_full import compare_with_file, shown

CORPUS = Path(__file__).parents[3] / "corpus"


@pytest.fixture(scope="module")
def ecm(tmp_path_factory: pytest.TempPathFactory) -> Ecm:
    folder = tmp_path_factory.mktemp("module") / "module"
    shutil.copytree(CORPUS / "accepted" / "waits_less_than_allowed", folder)
    site = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert site is not None
    found = load_ecm(folder, site, Diagnostics())
    assert found is not None
    return found.ecm


def fault(ecm: Ecm, code: bytes) -> str | None:
    """The first line of the report on a module whose `skills.py` is `code`."""
    (found,) = entry_point_obligations(ecm, read_skill_files("", {"skills.py": code}))
    return None if found.diagnostic is None else render_text(found.diagnostic).splitlines()[0]


@pytest.mark.parametrize(
    "code",
    [
        b"def tidy(observed, inputs):\n    yield\n",
        b"def tidy(observed, inputs):\n    yield from other()\n",
        b"def tidy(observed, inputs):\n    if observed:\n        x = yield\n",
        b"def tidy(observed, /, inputs):\n    yield\n",
        b"def tidy(observed, inputs):\n    return\n    yield\n",
        b"def tidy(one):\n    yield\ndef tidy(observed, inputs):\n    yield\n",
    ],
    ids=["yields", "delegates", "in a branch", "positional", "never reached", "defined again"],
)
def test_a_generator_of_two_arguments_is_an_entry_point(ecm: Ecm, code: bytes) -> None:
    assert fault(ecm, code) is None


@pytest.mark.parametrize(
    ("code", "message"),
    [
        # Code that is no Python stands here and not in the corpus, where it would trip linters.
        (
            b"def tidy(observed, inputs:\n    yield\n",
            "this is not Python: '(' was never closed",
        ),
        (b"def tidy(o, i):\nyield\n", "this is not Python: expected an indented block"),
        (b"x = '\xff'\n", "`skills.py` is not plain Python: byte 5 is not UTF-8"),
        (b"\x00", "the character U+0000 (NULL) is not allowed"),
        (b"(" * 5_000, "this is not Python: too many nested parentheses"),
        (b"# coding: nonsense\n", "`skills.py` is not plain Python: it declares an encoding"),
        (b"\xef\xbb\xbfimport os\n", "`skills.py` is not plain Python: it begins with a byte order mark"),
    ],
    ids=["bracket", "indent", "bytes", "NUL", "deep", "encoding", "mark"],
)
def test_a_file_that_is_not_python_is_reported(ecm: Ecm, code: bytes, message: str) -> None:
    assert message in (fault(ecm, code) or "").splitlines()[0]


@pytest.mark.parametrize(
    "code",
    [
        b"",
        b"tidy = lambda observed, inputs: (yield)\n",
        b"class tidy:\n    def __call__(self, observed, inputs):\n        yield\n",
        b"if True:\n    def tidy(observed, inputs):\n        yield\n",
        b"from elsewhere import tidy\n",
    ],
    ids=["empty", "lambda", "class", "nested", "imported"],
)
def test_only_a_function_at_the_top_is_an_entry_point(ecm: Ecm, code: bytes) -> None:
    message = "error[AE123] missing-entry-point: `skills.py` has no function `tidy`"
    assert fault(ecm, code) == message


@pytest.mark.parametrize(
    ("code", "help_"),
    [(b"def tidi(observed, inputs):\n    yield\n", ("did you mean `tidi`?",)), (b"def other(): ...\n", ())],
)
def test_only_a_name_that_is_nearly_the_same_is_offered(
    ecm: Ecm, code: bytes, help_: tuple[str, ...]
) -> None:
    (found,) = entry_point_obligations(ecm, read_skill_files("", {"skills.py": code}))
    assert found.diagnostic is not None
    assert found.diagnostic.help == help_


@pytest.mark.parametrize(
    "code",
    [
        b"def tidy(observed, inputs):\n    return []\n",
        b"def tidy(observed, inputs):\n    return lambda: (yield)\n",
        b"def tidy(observed, inputs):\n    def inner():\n        yield\n",
        b"async def tidy(observed, inputs):\n    yield\n",
        b"def tidy(observed, inputs):\n    'yield'\n",
        b"def tidy(observed, inputs):\n    yield\ndef tidy(observed, inputs):\n    return\n",
    ],
    ids=["returns", "lambda", "inner", "async", "text", "defined again"],
)
def test_a_function_without_a_yield_of_its_own_is_no_generator(ecm: Ecm, code: bytes) -> None:
    message = "error[AE124] not-a-generator: `tidy` is not a generator, so it could ask for no action"
    assert fault(ecm, code) == message


@pytest.mark.parametrize(
    "arguments", ["", "observed", "observed, inputs, more", "observed, *, inputs", "a, b, *, c", "*arguments"]
)
def test_any_other_arguments_are_refused(ecm: Ecm, arguments: str) -> None:
    message = "error[AE124] not-a-generator: `tidy` does not take the observation and the inputs"
    assert fault(ecm, f"def tidy({arguments}):\n    yield\n".encode()) == message


def test_no_code_is_run(ecm: Ecm, tmp_path: Path) -> None:
    left = tmp_path / "left"
    code = f"open({str(left)!r}, 'w')\ndef tidy(observed, inputs):\n    yield\n"
    assert fault(ecm, code.encode()) is None
    assert not left.exists()


PERCEIVING = "measures_its_own_predicate"


def perceiver_fault(code: bytes, *models: str) -> str | None:
    """The first line of what is said of a module whose `perceivers.py` is `code`, and takes these models."""
    found = perceiver_diagnostic(code, *models)
    return None if found is None else render_text(found).splitlines()[0]


def perceiver_diagnostic(code: bytes, *models: str) -> Diagnostic | None:
    """The report on such a module."""
    site = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert site is not None
    found = load_ecm(CORPUS / "accepted" / PERCEIVING, site, Diagnostics())
    assert found is not None
    skills = (CORPUS / "accepted" / PERCEIVING / "skills.py").read_bytes()
    files = read_skill_files("", {"skills.py": skills, "perceivers.py": code})
    watch = replace(found.ecm.perceivers["watch"], models=models)
    ecm = replace(found.ecm, perceivers={"watch": watch})
    of_skill, of_perceiver = entry_point_obligations(ecm, files)
    assert of_skill.diagnostic is None
    assert str(of_perceiver.id) == "form/perceiver/watch/entry"
    return of_perceiver.diagnostic


def test_a_generator_of_one_argument_is_the_entry_point_of_a_perceiver() -> None:
    assert perceiver_fault(b"def see(view):\n    while True:\n        view = yield {}\n") is None


def test_a_perceiver_with_models_takes_them_as_a_second_argument() -> None:
    assert perceiver_fault(b"def see(view, models):\n    yield {}\n", "tent") is None
    assert "`see` does not take the view and the models" in (
        perceiver_fault(b"def see(view):\n    yield {}\n", "tent") or ""
    )


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (b"def see(view, inputs):\n    yield {}\n", "`see` does not take the view"),
        (b"def see():\n    yield {}\n", "`see` does not take the view"),
        (b"def see(view):\n    return {}\n", "`see` is not a generator, so it could measure only once"),
        (b"def sea(view):\n    yield {}\n", "`perceivers.py` has no function `see`"),
    ],
)
def test_any_other_function_is_no_entry_point_of_a_perceiver(code: bytes, message: str) -> None:
    assert message in (perceiver_fault(code) or "")


_FUNCTIONS = (
    "def tidi(observed, inputs):\n    yield\n",
    "def tidy(observed, inputs):\n    return []\n",
    "@cached\ndef tidy(observed, inputs):\n    yield\n",
    "def tidy(observed):\n    yield\n",
    "def tidy(observed, inputs:\n    yield\n",
)


def test_the_reports_on_entry_points_in_full(ecm: Ecm) -> None:
    found: list[Diagnostic | None] = []
    for models in ((), ("tent",)):
        changed = replace(ecm, skills={name: replace(one, models=models) for name, one in ecm.skills.items()})
        for code in (*_FUNCTIONS, None):
            files = read_skill_files("", {} if code is None else {"skills.py": code.encode()})
            (claim,) = entry_point_obligations(changed, files)
            found.append(claim.diagnostic)
        for code in _FUNCTIONS[1:4]:
            as_perceiver = code.replace("tidy", "see").replace("(observed)", "()").replace(", inputs", "")
            found.append(perceiver_diagnostic(as_perceiver.encode(), *models))
    lines = [line for one in found for line in (["nothing"] if one is None else shown(one))]
    compare_with_file(Path(__file__).with_name("data") / "entry_point_reports.txt", "\n".join(lines) + "\n")
