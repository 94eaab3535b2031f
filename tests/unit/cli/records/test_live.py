"""`aeros live` as people run it: it serves the page until Ctrl-C."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

RUN = Path(__file__).parents[2] / "apps" / "data" / "run_with_a_person"


def test_a_run_is_served_until_ctrl_c(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "aeros.cli.main",
        "live",
        "--run",
        str(RUN / "audit.jsonl"),
        "--state",
        str(tmp_path / "s"),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as live:
        assert live.stdout is not None
        found = re.fullmatch(r"live +(http://127\.0\.0\.1:\d+/)\n", live.stdout.readline())
        assert found is not None
        with urllib.request.urlopen(found[1], timeout=30) as answer:  # noqa: S310 - an address of this host
            page = answer.read().decode()
        assert os.getpriority(os.PRIO_PROCESS, live.pid) == min(os.getpriority(os.PRIO_PROCESS, 0) + 10, 19)
        live.send_signal(signal.SIGINT)
        assert live.wait(30) == Exit.SUCCESS
    assert "make dumplings: " in page


def test_ports_that_cannot_be_used_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["live", "--port", port]) == Exit.USAGE
    assert f"cannot listen at port {port}: Address already in use" in capsys.readouterr().err
    with pytest.raises(SystemExit, match=str(Exit.USAGE.value)):
        main(["live", "--port", "65536"])
    assert "is no port, which is a number from 0 to 65535" in capsys.readouterr().err


def test_faults_of_the_given_files_are_shown_before_it_serves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.yaml"
    site.write_text("a: [")
    assert main(["live", "--run", str(RUN), "--site", str(site)]) == Exit.REJECTED
    assert f"{site}:1:5" in capsys.readouterr().err
    assert main(["live", "--run", str(tmp_path / "site.yaml")]) == Exit.USAGE
    assert "is no audit.jsonl: give the output folder" in capsys.readouterr().err
