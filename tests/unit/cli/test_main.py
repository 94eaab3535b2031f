from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import aeros
from aeros.cli.main import main
from aeros.cli.run import decide
from aeros.exit_codes import Exit, exit_for
from aeros.runtime.audit.log import verify_log
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS
from aeros.spec.obligations.verdicts import Conclusion

ROOT = Path(__file__).parents[3]


def raising(error: BaseException) -> object:
    def prove(*arguments: object, **named: object) -> None:
        raise error

    return prove


def test_help_and_version_are_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, shown in ((["--help"], "exit codes: 0"), (["--version"], f"aeros {aeros.__version__}")):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 0
        assert shown in capsys.readouterr().out


def test_code_that_proves_and_reports_is_imported_only_by_commands_that_need_it() -> None:
    script = "import sys, aeros.cli.main, aeros.cli.author.explain; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "aeros.spec.obligations.verdicts" in loaded
    assert (
        not {"aeros.spec.verification.reports", "aeros.spec.verification.verify", "sqlite3", "yaml", "z3"}
        & loaded
    )


@pytest.mark.parametrize(
    ("command", "old", "new"),
    [(command, old, new) for command, names in RENAMED_OPTIONS.items() for old, new in names.items()],
)
def test_an_old_option_is_refused_with_its_current_name(
    command: str, old: str, new: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for word in (old, f"{old}=it"):
        assert main([command, word]) == Exit.USAGE
        assert capsys.readouterr().err == f"aeros: option `{old}` was renamed; use `{new}`\n"
    with pytest.raises(SystemExit):
        main([command, *{"audit": ["show"], "new": ["ecm"]}.get(command, []), "--help"])
    shown = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
    assert new in shown
    assert old not in shown


def test_an_argument_after_two_dashes_is_no_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["graph", "--", "--what"])
    assert ended.value.code == Exit.USAGE
    message = capsys.readouterr().err
    assert "argument MODULE: no file or folder `--what`" in message
    assert "was renamed" not in message
    Path("--what").mkdir()
    assert main(["graph", "--", "--what"]) == Exit.REJECTED
    message = capsys.readouterr().err
    assert "--what" in message
    assert "was renamed" not in message


@pytest.mark.parametrize("arguments", [["proof"], ["--loud"]])
def test_a_word_that_is_no_command_is_a_usage_error(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == Exit.USAGE
    assert "usage: aeros" in capsys.readouterr().err


@pytest.mark.parametrize("debug", [False, True])
def test_our_own_bug_is_reported_without_a_traceback_unless_asked_for(
    debug: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(decide, "prove_configuration", raising(RuntimeError("gears")))
    monkeypatch.delenv("AEROS_DEBUG", raising=False)
    if debug:
        monkeypatch.setenv("AEROS_DEBUG", "1")
    assert main(["decide", "--ecm", ".", "--skill", "y"]) == Exit.INTERNAL_ERROR
    shown = capsys.readouterr().err
    assert "this is a bug in aeros, not in your files: RuntimeError: gears" in shown
    assert ("Traceback" in shown) is debug


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (
            PermissionError(errno.EACCES, "Permission denied", "/srv"),
            "`/srv` cannot be used: Permission denied",
        ),
        *(
            (OSError(number, "It fails", *name), f"{place} cannot be used: It fails; {cure}")
            for number, cure in (
                (errno.ENOSPC, "make room on the disk"),
                (errno.EDQUOT, "make room within your quota"),
                (errno.EFBIG, "raise the limit of `ulimit -f`"),
                (errno.EIO, "check the disk"),
                (errno.EROFS, "give a folder that can be written to"),
            )
            for name, place in (((), "a file"), (("/srv",), "`/srv`"))
        ),
        (
            OSError(errno.EMFILE, "Too many open files"),
            "the system has not enough resources: Too many open files",
        ),
    ],
)
def test_a_refusal_of_the_operating_system_is_no_bug(
    error: OSError, message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(decide, "prove_configuration", raising(error))
    assert main(["decide", "--ecm", ".", "--skill", "y"]) == Exit.REJECTED
    assert capsys.readouterr().err == f"aeros: {message}\n"


def test_streams_that_are_closed_are_no_bug() -> None:
    script = (
        "import os; [os.close(one) for one in (0, 1, 2)]; "
        "import sys; sys.stdin = sys.stdout = sys.stderr = None; "  # as Python finds it
        "from aeros.cli.main import main; "
        "code = main(['explain', 'AE509']); file = os.open(os.devnull, os.O_RDONLY); "
        "os._exit(10 * code + file)"
    )
    done = subprocess.run([sys.executable, "-c", script], check=False)
    assert 3 <= done.returncode < 10  # success, and no file has the number of a standard stream


def test_an_argument_that_is_not_utf8_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    for given in (["explain", "\udcff"], ["block", "--id", "x", "--reason", "a\udcff\udcfe"], ["\udcff"]):
        assert main(given) == Exit.USAGE
        shown = given[-1].replace("\udcff", "\\xff").replace("\udcfe", "\\xfe")
        assert capsys.readouterr().err == f"aeros: argument {len(given)} is not UTF-8: `{shown}`\n"


def test_an_output_that_cannot_be_written_is_named() -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        run = subprocess.run(
            [sys.executable, "-m", "aeros", "explain", "AE005"],
            stdout=full, stderr=subprocess.PIPE, check=False,
        )  # fmt: skip
    assert run.stderr == (
        b"aeros: `standard output` cannot be used: No space left on device; make room on the disk\n"
    )
    assert run.returncode == Exit.REJECTED


INTERRUPT = "os.kill(os.getpid(), signal.SIGINT)"


@pytest.mark.parametrize(
    "main_file",
    [
        f"try: {INTERRUPT}\nexcept KeyboardInterrupt: pass\ndef main(begin): return 0",
        f"def main(begin): {INTERRUPT}",
        f"def main(begin): begin(); {INTERRUPT}",
        f"def main(begin):\n begin()\n try: {INTERRUPT}\n except KeyboardInterrupt: return 130",
        f"def main(begin): begin(); atexit.register(lambda: {INTERRUPT}); return 0",
    ],
    ids=["import", "before", "during", "command", "exit"],
)
def test_an_interrupt_at_any_moment_ends_in_words(main_file: str, tmp_path: Path) -> None:
    for folder in ("aeros", "aeros/cli"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").touch()
    (tmp_path / "aeros" / "__main__.py").write_bytes((ROOT / "aeros" / "__main__.py").read_bytes())
    (tmp_path / "aeros" / "cli" / "main.py").write_text(f"import atexit, os, signal\n{main_file}\n")
    run = subprocess.run(
        [sys.executable, "-m", "aeros"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == Exit.INTERRUPTED
    assert run.stderr in ("interrupted\n", "")
    assert ("return 130" in main_file) is (run.stderr == "")


def test_an_error_that_an_interrupt_causes_is_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    error = ImportError("half imported")
    error.__context__ = KeyboardInterrupt()
    monkeypatch.setattr(decide, "prove_configuration", raising(error))
    assert main(["decide", "--ecm", ".", "--skill", "y"]) == Exit.INTERRUPTED
    assert capsys.readouterr().err == "interrupted\n"


def test_an_interrupt_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(decide, "prove_configuration", raising(KeyboardInterrupt()))
    assert main(["decide", "--ecm", ".", "--skill", "y"]) == Exit.INTERRUPTED
    assert capsys.readouterr().err == "interrupted\n"


def test_a_reader_that_goes_away_is_no_bug() -> None:
    bench = ROOT / "tests" / "unit" / "runtime" / "data"
    command = [sys.executable, "-m", "aeros", "decide", "--skill", "quickly"]
    command += ["--site", str(bench / "bench.yaml"), "--ecm", str(bench / "handling")]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, cwd=ROOT) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdout.close()
        process.stdin.write(b"{}\n{}\n")
        process.stdin.close()
        assert process.stderr is not None
        assert process.stderr.read() == b""
        assert process.wait(30) == Exit.CLOSED_PIPE


def test_an_alphabet_that_lacks_a_letter_is_no_failure() -> None:
    for encoding in ("ascii", "latin-1", "utf-8"):
        run = subprocess.run(
            [sys.executable, "-m", "aeros", "explain", "AE101"],
            capture_output=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONIOENCODING": encoding},
            check=False,
        )
        assert run.returncode == Exit.SUCCESS
        assert run.stderr == b""
        assert run.stdout.decode(encoding)


def test_an_arrow_is_spelt_out_where_it_cannot_be_written(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "aeros", "run", "make dumplings", "--plant", "symbolic",
         "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out")],
        capture_output=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        check=False,
    )  # fmt: skip
    assert b"Traceback" not in run.stderr
    assert run.returncode == Exit.SUCCESS, run.stderr
    assert b"\\u2192" in run.stdout


def test_the_reader_of_a_run_may_go_away(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "aeros", "run", "make dumplings", "--plant", "symbolic",
               "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out")]  # fmt: skip
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, cwd=ROOT) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        message = process.stderr.read()
    assert process.returncode == Exit.CLOSED_PIPE
    assert message == b""
    audited = verify_log(tmp_path / "out" / "audit.jsonl")
    assert audited.bad_record is None


def test_each_conclusion_has_its_exit_code() -> None:
    assert [exit_for(one) for one in Conclusion] == [Exit.SUCCESS, Exit.REJECTED, Exit.UNDECIDED]
