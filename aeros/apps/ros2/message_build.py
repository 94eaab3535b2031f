"""Build of the ROS 2 message packages into wheels, from tools on PyPI, for a Python without a distribution.

A robot's workspace builds `aeros_msgs` with colcon, and has the other packages from its distribution.
Elsewhere this module makes a temporary environment with ROS 2's generators, builds the packages with CMake,
and packs what they install. A wheel is kept in the user's cache under the digest of its definitions, Python
and tools.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import venv
import zipfile
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Final

from aeros.files import make_folder

_DEFINITIONS: Final = Path(__file__).parents[2] / "runtime" / "bus"

PACKAGES: Final = ("aeros_msgs", "control_msgs", "foxglove_msgs", "tf2_msgs")
"""Packages that AEROS defines messages of; PyPI has no wheel of any."""

_VERSION: Final = "1.0.0"

_FORMAT: Final = "2"
"""Counted up when this module builds otherwise, so that older wheels in the cache are not used."""

_RUNTIME: Final = ("ros-common-interfaces", "ros-rclpy", "ros-rmw-fastrtps-cpp", "ros-action-msgs")

_TOOLS: Final = (
    *(f"ros-ament-{name}" for name in ("package", "cmake", "cmake-core", "cmake-python", "cmake-ros")),
    *(f"ros-ament-cmake-export-{name}" for name in ("definitions", "dependencies", "include-directories")),
    *(f"ros-ament-cmake-export-{name}" for name in ("interfaces", "libraries", "link-flags", "targets")),
    *(f"ros-ament-cmake-{name}" for name in ("gen-version-h", "include-directories", "libraries")),
    *(f"ros-ament-cmake-{name}" for name in ("ros-core", "target-dependencies", "test", "version", "gtest")),
    *(f"ros-ament-cmake-{name}" for name in ("gmock", "pytest", "vendor-package")),
    *(f"ros-rosidl-{name}" for name in ("adapter", "cli", "cmake", "core-generators", "core-runtime")),
    *(f"ros-rosidl-{name}" for name in ("default-generators", "default-runtime", "dynamic-typesupport")),
    *(f"ros-rosidl-generator-{name}" for name in ("c", "cpp", "py", "type-description")),
    *(f"ros-rosidl-{name}" for name in ("parser", "pycommon", "runtime-c", "runtime-cpp")),
    *(f"ros-rosidl-typesupport-{name}" for name in ("c", "cpp", "fastrtps-c", "fastrtps-cpp", "interface")),
    *(f"ros-rosidl-typesupport-introspection-{name}" for name in ("c", "cpp")),
    "catkin_pkg",
)
"""Distributions on PyPI that a build needs: wheels of ROS 2 declare runtime dependencies alone."""


class MessageBuildError(Exception):
    """The message packages cannot be built; the message says why."""


def build_digest(package: str) -> str:
    """Compute the digest of everything that the wheel of a package depends on.

    Args:
        package: Name of the package.

    Returns:
        Hexadecimal digits: of the definitions, this Python, and the versions of installed ROS 2 wheels.
    """
    folder = _DEFINITIONS / package
    parts = [_FORMAT, sysconfig.get_platform(), sys.implementation.cache_tag or "", *_pinned(_RUNTIME)]
    for path in sorted(one for one in folder.rglob("*") if one.is_file()):
        parts += [path.relative_to(folder).as_posix(), hashlib.sha256(path.read_bytes()).hexdigest()]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def cache_folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the folder that keeps built wheels.

    Args:
        environment: Variables of the environment.

    Returns:
        A folder in the user's cache, which may not exist yet.
    """
    root = environment.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "aeros" / "ros2-messages"


def build_messages(cache: Path, report: Callable[[str], None]) -> list[Path]:
    """Build the wheels that the cache does not hold.

    Args:
        cache: Folder of the wheels.
        report: Called with a line for each step.

    Returns:
        The wheels, one for each of `PACKAGES`.

    Raises:
        MessageBuildError: A tool is missing or fails.
    """
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    wheels = [
        cache / build_digest(package) / f"{package}-{_VERSION}-{tag}-{tag}-{platform}.whl"
        for package in PACKAGES
    ]
    missing = [
        (package, wheel) for package, wheel in zip(PACKAGES, wheels, strict=True) if not wheel.exists()
    ]
    if not missing:
        return wheels
    for tool in ("cmake", "ninja", "g++"):
        if shutil.which(tool) is None:
            raise MessageBuildError(f"`{tool}` is needed: install cmake, ninja-build and g++")
    with tempfile.TemporaryDirectory(prefix="aeros-messages-") as work:
        prefix = Path(work) / "env"
        report("installing ROS 2's generators from PyPI into a temporary environment")
        venv.create(prefix, with_pip=True, symlinks=True)
        _run([str(prefix / "bin" / "pip"), "install", "-q", *_pinned((*_RUNTIME, *_TOOLS))], dict(os.environ))
        _correct_include_folders(prefix)
        for package, wheel in missing:
            report(f"building {package}")
            made = Path(work) / package
            _build(_DEFINITIONS / package, made, prefix)
            make_folder(wheel.parent, 0o700)
            _pack(package, made / "install", wheel, f"{tag}-{tag}-{platform}")
    return wheels


def _pinned(names: tuple[str, ...]) -> list[str]:
    """Return requirements: the version that is installed here, so that the libraries fit; else any."""
    found = []
    for name in names:
        try:
            found.append(f"{name}=={metadata.version(name)}")
        except metadata.PackageNotFoundError:
            found.append(name)
    return found


def _build(source: Path, work: Path, prefix: Path) -> None:
    # The generators find each other by these, as after `source setup.bash`.
    environment = {
        **os.environ,
        "PATH": f"{prefix / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "AMENT_PREFIX_PATH": str(prefix),
        "CMAKE_PREFIX_PATH": str(prefix),
        "LD_LIBRARY_PATH": os.pathsep.join(
            str(one) for one in (prefix / "lib", *sorted(prefix.glob("lib/python*/site-packages/ros_*.libs")))
        ),
        # The wheels start Python anew to set that variable, unless this one is set.
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    environment.pop("PYTHONPATH", None)
    settings = {
        "CMAKE_INSTALL_PREFIX": work / "install",
        "CMAKE_BUILD_TYPE": "Release",
        "BUILD_TESTING": "OFF",
        "Python3_EXECUTABLE": prefix / "bin" / "python",
        "Python3_FIND_VIRTUALENV": "ONLY",
    }
    defined = [f"-D{name}={value}" for name, value in settings.items()]
    _run(["cmake", "-G", "Ninja", "-S", str(source), "-B", str(work / "build"), *defined], environment)
    _run(["cmake", "--build", str(work / "build"), "--target", "install"], environment)


def _correct_include_folders(prefix: Path) -> None:
    """Put this Python's include folders in place of those of the machine that built the wheels."""
    script = "import numpy, sysconfig; print(sysconfig.get_paths()['include'], numpy.get_include())"
    python, numpy = _run([str(prefix / "bin" / "python"), "-c", script], dict(os.environ)).split()
    for path in (prefix / "share").rglob("*.cmake"):
        text = path.read_text("utf-8")
        if "/opt/python/" in text:
            path.write_text(_with_include_folders(text, python, numpy), "utf-8")


def _with_include_folders(text: str, python: str, numpy: str) -> str:
    lines = []
    for line in text.splitlines(keepends=True):
        if "/opt/python/" in line and "INTERFACE_INCLUDE_DIRECTORIES" in line:
            key = line[: line.index('"')]
            kept = [one for one in line.split('"')[1].split(";") if not one.startswith("/opt/python/")]
            lines.append(f'{key}"{";".join((*kept, python, numpy))}"\n')
        else:
            lines.append(line)
    return "".join(lines)


def _pack(package: str, installed: Path, wheel: Path, tags: str) -> None:
    """Pack an installation: modules at the top, libraries and descriptions where the prefix has them."""
    (modules,) = installed.glob("lib/python*/site-packages")
    own = modules / package
    info, data = f"{package}-{_VERSION}.dist-info", f"{package}-{_VERSION}.data/data"
    files: dict[str, bytes] = {}
    for path in sorted(one for one in installed.rglob("*") if one.is_file()):
        if path.is_relative_to(own):
            files[path.relative_to(modules).as_posix()] = path.read_bytes()
        elif not path.is_relative_to(modules):
            files[f"{data}/{path.relative_to(installed).as_posix()}"] = path.read_bytes()
    files[f"{info}/METADATA"] = f"Metadata-Version: 2.1\nName: {package}\nVersion: {_VERSION}\n".encode()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: aeros\nRoot-Is-Purelib: false\nTag: {tags}\n".encode()
    )
    record = io.StringIO()
    rows = csv.writer(record, lineterminator="\n")
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        rows.writerow((name, f"sha256={digest}", len(content)))
    rows.writerow((f"{info}/RECORD", "", ""))
    files[f"{info}/RECORD"] = record.getvalue().encode()
    part = wheel.with_suffix(".part")
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    part.replace(wheel)


def _run(command: list[str], environment: Mapping[str, str]) -> str:
    """Run a tool and return what it printed.

    Raises:
        MessageBuildError: It fails; the message has the end of its output.
    """
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode != 0:
        end = "\n".join((done.stdout + done.stderr).splitlines()[-15:])
        raise MessageBuildError(f"`{' '.join(command[:2])}` failed:\n{end}")
    return done.stdout
