"""Perceivers, pictures and views for tests."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Final

import numpy as np

from aeros.runtime.perception.perceiver_run import ViewInput
from aeros.runtime.ports import CameraPicture, CameraView
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.load import CertifiedCode
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.model.perception import Perceiver, PictureRequest

VIEW: Final = CameraView((0.5, 0.0, 1.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0)
_SPAN: Final = SourceSpan(Source("perceivers.yaml", ""), 0, 0)
_HEADER: Final = "import numpy as np\nfrom aeros.perception import Estimate, View, estimate\n"


def picture(time: float = 1.0, size: tuple[int, int] = (8, 6), camera: str = "overhead") -> CameraPicture:
    """A picture whose n-th byte is n modulo 251, and whose pixels are 1 m, 1.001 m … deep."""
    pixels = size[0] * size[1]
    rgb = (np.arange(3 * pixels) % 251).astype(np.uint8).tobytes()
    depth = (1.0 + np.arange(pixels) / 1000.0).astype(np.float32).tobytes()
    return CameraPicture(camera, time, *size, rgb, depth, VIEW)


def perceiver(
    *provides: str,
    pictures: tuple[PictureRequest, ...] = (PictureRequest("overhead", 4, 3, True),),
    readings: tuple[str, ...] = (),
    rate: Fraction | None = None,
    timeout: Fraction = Fraction(1, 5),
    memory: int = 64 << 20,
) -> Perceiver:
    read_as = dict(zip(readings, readings, strict=True))
    return Perceiver("eye", "eye", "see", pictures, read_as, rate, provides, timeout, memory, _SPAN, _SPAN)


def code(body: str, top: str = "") -> CertifiedCode:
    """A perceiver with this body, in which `view` is the first view."""
    lines = "".join(f"    {line}\n" for line in body.strip("\n").splitlines())
    text = f"{_HEADER}{top}\ndef see(view):\n{lines}"
    return CertifiedCode(CodeFile("hostile", "eye.py", "/hostile/eye.py", text.encode()), "see")


def view(
    time: float = 1.0, readings: Mapping[str, Any] | None = None, taken: CameraPicture | None = None
) -> ViewInput:
    return ViewInput(time, readings or {}, {}, {"overhead": taken or picture(time)})
