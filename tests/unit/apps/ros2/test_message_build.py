"""Wheels of the message packages are kept by the digest of their definitions, and are what pip installs."""

from __future__ import annotations

import csv
import io
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from aeros.apps.ros2 import message_build
from aeros.apps.ros2.message_build import (
    PACKAGES,
    MessageBuildError,
    build_digest,
    build_messages,
    cache_folder,
)
from aeros.runtime.bus import messages
from aeros.runtime.bus.messages import Message

_TEXT = '  INTERFACE_INCLUDE_DIRECTORIES "{}"\n'


def test_the_cache_is_the_users(tmp_path: Path) -> None:
    assert cache_folder({"XDG_CACHE_HOME": str(tmp_path)}) == tmp_path / "aeros" / "ros2-messages"


def test_a_change_of_a_definition_changes_the_digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(message_build, "_DEFINITIONS", tmp_path)
    file = tmp_path / "some_msgs" / "msg" / "One.msg"
    file.parent.mkdir(parents=True)
    file.write_text("bool a\n")
    before = build_digest("some_msgs")
    assert build_digest("some_msgs") == before
    file.write_text("bool b\n")
    assert build_digest("some_msgs") != before


def test_a_wheel_in_the_cache_is_not_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")  # so that nothing can be built
    with pytest.raises(MessageBuildError, match="cmake, ninja-build and g"):
        build_messages(tmp_path, lambda line: None)
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    for package in PACKAGES:
        folder = tmp_path / build_digest(package)
        folder.mkdir()
        (folder / f"{package}-1.0.0-{tag}-{tag}-{platform}.whl").touch()
    assert [one.name.partition("-")[0] for one in build_messages(tmp_path, lambda line: None)] == [*PACKAGES]


def test_include_folders_of_the_machine_that_built_the_wheels_are_replaced() -> None:
    built_in = "/opt/python/cp311/include;/usr/own;/opt/python/cp311/numpy/_core/include"
    corrected = message_build._with_include_folders(_TEXT.format(built_in), "/here/python", "/here/numpy")
    assert corrected == _TEXT.format("/usr/own;/here/python;/here/numpy")
    other = "set(x /opt/python/cp311)\n"
    assert message_build._with_include_folders(other, "/here/python", "/here/numpy") == other


def test_a_wheel_records_its_files_and_puts_libraries_beside_the_interpreter(tmp_path: Path) -> None:
    installed = tmp_path / "install"
    for name in (
        "lib/python3.11/site-packages/some_msgs/__init__.py",
        "lib/python3.11/site-packages/some_msgs-1.0.0.egg-info/PKG-INFO",
        "lib/libsome_msgs.so",
        "share/some_msgs/package.xml",
    ):
        (installed / name).parent.mkdir(parents=True, exist_ok=True)
        (installed / name).write_text(name)
    message_build._pack("some_msgs", installed, tmp_path / "one.whl", "cp311-cp311-linux_x86_64")
    with zipfile.ZipFile(tmp_path / "one.whl") as wheel:
        names = set(wheel.namelist())
        recorded = {
            row[0] for row in csv.reader(io.StringIO(wheel.read("some_msgs-1.0.0.dist-info/RECORD").decode()))
        }
    assert names == recorded
    assert {one for one in names if "dist-info" not in one} == {
        "some_msgs/__init__.py",
        "some_msgs-1.0.0.data/data/lib/libsome_msgs.so",
        "some_msgs-1.0.0.data/data/share/some_msgs/package.xml",
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_the_build_file_of_a_package_lists_its_definitions(package: str) -> None:
    folder = message_build._DEFINITIONS / package
    listed = (folder / "CMakeLists.txt").read_text()
    defined = [one for kind in ("msg", "action") for one in folder.glob(f"{kind}/*")]
    assert defined
    assert [one.name for one in defined if f'"{one.parent.name}/{one.name}"' not in listed] == []


def test_every_message_of_aeros_has_a_definition() -> None:
    folder = message_build._DEFINITIONS / "aeros_msgs"
    kinds = [one for one in vars(messages).values() if isinstance(one, type) and issubclass(one, Message)]
    own = {one.ros for one in kinds if one is not Message and one.ros.startswith("aeros_msgs/")}
    parts = {name.removeprefix("aeros_msgs/").partition("_")[0] for name in own}
    assert parts == {
        f"{one.parent.name}/{one.stem}" for kind in ("msg", "action") for one in folder.glob(f"{kind}/*")
    }
