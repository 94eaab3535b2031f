"""Meshes in the robot's description: inside the text for viewers, as files for RViz."""

from __future__ import annotations

import struct
from base64 import b64decode
from pathlib import Path
from urllib.parse import unquote, urlparse
from xml.etree.ElementTree import Element, fromstring

import pytest

from aeros.runtime.bus.robot_description import robot_description
from aeros.runtime.bus.viewer.link_visuals import embedded_visuals, encode_stl, filed_visuals
from aeros.runtime.ports import Ball, ColouredMesh, Hull, LinkModel, RobotBody

CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
FACE = ColouredMesh(CORNERS, ((0, 1, 2),), (1.0, 0.0, 0.0))
BASE = Hull("link0", 0, CORNERS, 0.0)
UPPER = Hull("link1", 1, CORNERS, 0.0)
FLAT = Hull("plate", 2, CORNERS[:3], 0.0)
BODY = RobotBody(
    ((0.0, 0.0, 0.3), (0.0, 0.0, 0.2)),
    (0.0, 0.0, 0.1),
    tuple(Ball(hull.link, hull.joint, (0.1, 0.2, 0.3), 0.5) for hull in (BASE, UPPER, FLAT)),
    (BASE, UPPER, FLAT),
)
MODELS = {UPPER: LinkModel((FACE, FACE._replace(colour=(0.0, 0.0, 1.0))), "a -- b.urdf: Apache-2.0")}


def links_of(text: str) -> dict[str, Element]:
    return {one.attrib["name"]: one for one in fromstring(text).findall("link")}  # noqa: S314 - our own text


def addresses(link: Element) -> list[str]:
    return [one.attrib["filename"] for one in link.findall("visual/geometry/mesh")]


def test_viewers_get_each_link_inside_the_text() -> None:
    text = robot_description("arm", BODY, ("a", "b"), embedded_visuals(MODELS))
    links = links_of(text)
    for name in ("base", "a_link"):
        (address,) = addresses(links[name])
        head, _, data = address.partition(",")
        assert head == "data:model/gltf-binary;base64"
        assert b64decode(data)[:4] == b"glTF"
        assert [one.attrib for one in links[name].findall("collision/geometry/sphere")] == [{"radius": "0.5"}]
    assert "<!-- a - - b.urdf: Apache-2.0 -->" in text


def test_a_link_without_a_mesh_is_drawn_as_its_balls() -> None:
    link = links_of(robot_description("arm", BODY, ("a", "b"), embedded_visuals({})))["b_link"]
    assert addresses(link) == []
    assert len(link.findall("visual/geometry/sphere")) == 1
    assert link.findall("collision") == []


def test_rviz_gets_a_file_for_each_colour_of_a_link(tmp_path: Path) -> None:
    folder = tmp_path / "a run" / "link_meshes"
    links = links_of(robot_description("arm", BODY, ("a", "b"), filed_visuals(folder, MODELS)))
    paths = [Path(unquote(urlparse(one).path)) for one in addresses(links["a_link"])]
    assert paths == [folder / "link1-0.stl", folder / "link1-1.stl"]
    assert paths[0].read_bytes() == encode_stl(FACE)
    colours = [one.attrib["rgba"] for one in links["a_link"].findall("visual/material/color")]
    assert colours == ["1.0 0.0 0.0 1", "0.0 0.0 1.0 1"]
    assert len(addresses(links["base"])) == 1


def test_every_file_is_in_the_folder_and_of_one_hull(tmp_path: Path) -> None:
    """Links may be named as parts of others, and a link may have two hulls."""
    visuals = filed_visuals(tmp_path / "meshes", {})
    wide = UPPER._replace(corners=tuple((2.0 * x, y, z) for x, y, z in CORNERS))
    outside, part = (UPPER._replace(link=name) for name in ("../above", "arm/link1\0"))
    found = [visuals(hull) for hull in (UPPER, wide, outside, part, UPPER)]
    paths = [Path(unquote(urlparse(one.address).path)) for (one,) in found]
    assert [path.parent for path in paths] == [tmp_path / "meshes"] * 5
    assert all(path.is_file() for path in paths)
    assert len(set(paths)) == 4
    assert paths[0] == paths[4]
    assert paths[0].read_bytes() != paths[1].read_bytes()


@pytest.mark.parametrize("origin", ["a---b.urdf", "----", "a -", "a\x01b", "a\udcffb"])
def test_the_origin_of_a_mesh_leaves_the_text_well_formed(origin: str) -> None:
    models = {UPPER: LinkModel((FACE,), origin)}
    links = links_of(robot_description("arm", BODY, ("a", "b"), embedded_visuals(models)))
    assert len(addresses(links["a_link"])) == 1


def test_balls_remain_where_files_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    links = links_of(robot_description("arm", BODY, ("a", "b"), filed_visuals(tmp_path / "taken", MODELS)))
    assert not any(addresses(one) for one in links.values())
    assert len(links["a_link"].findall("visual/geometry/sphere")) == 1


def test_stl_has_the_corners_of_each_triangle() -> None:
    data = encode_stl(FACE)
    (count,) = struct.unpack_from("<I", data, 80)
    assert (count, len(data)) == (1, 84 + 50)
    assert struct.unpack_from("<9f", data, 84 + 12) == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
