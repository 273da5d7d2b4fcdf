"""What the viewer saves, read without any of it: PNG by its pixels, GLB by its specification (glTF 2.0)."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from helpers.browser import pixels
from helpers.two_boxes import BODY, FLEXURE, two_boxes
from helpers.viewer_page import like


def saved(page: Page, button: str) -> tuple[str, bytes]:
    with page.expect_download() as waiting:
        page.get_by_role("button", name=button).click()
    return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()


@pytest.mark.parametrize("ratio", [1, 3])
def test_a_picture_has_the_model_and_its_caption(show, ratio):
    page = show(device_scale_factor=ratio)
    ratio = max(2, ratio)
    name, data = saved(page, "save as PNG")
    assert name == "two-boxes-mode-1-22.44-Hz.png"
    image = pixels(data)
    box = page.locator(".fx-picture").bounding_box()
    assert image.shape[1] == box["width"] * ratio and abs(image.shape[0] - (box["height"] + 64) * ratio) <= ratio
    assert like(image, BODY).sum() > 5000 * ratio and like(image, FLEXURE).sum() > 5000 * ratio
    caption = image[-64 * ratio :]
    ink = (caption.max(axis=-1) < 90).sum()
    assert ink > 150 * ratio, "no text under the picture"


class Glb:
    """A GLB taken apart as its specification says."""

    TYPES = {5126: "<f4", 5125: "<u4"}

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\x00" and rest % 4 == 0 and 28 + size + rest == length
        self.binary = data[28 + size :]
        assert self.json["buffers"] == [{"byteLength": rest}]

    def numbers(self, accessor: int) -> np.ndarray:
        own = self.json["accessors"][accessor]
        view = self.json["bufferViews"][own["bufferView"]]
        each = {"SCALAR": 1, "VEC3": 3}[own["type"]]
        data = self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        values = np.frombuffer(data, dtype=self.TYPES[own["componentType"]]).reshape(own["count"], each)
        if "min" in own:
            np.testing.assert_array_equal(values.min(axis=0), np.float32(own["min"]))
            np.testing.assert_array_equal(values.max(axis=0), np.float32(own["max"]))
        return values

    def mesh(self, name: str) -> dict[str, Any]:
        node = next(own for own in self.json["nodes"] if own["name"] == name)
        return self.json["meshes"][node["mesh"]]


def test_a_model_has_its_parts_in_metres_and_moves_as_shown(show):
    page = show()
    name, data = saved(page, "save as GLB")
    assert name == "two-boxes-mode-1-22.44-Hz.glb"
    own = Glb(data)
    assert [node["name"] for node in own.json["nodes"]] == [
        "base", "arm[1].leaf", "<b>spring</b>", "tip", "two boxes",
    ]  # fmt: skip
    (leaf,) = own.mesh("arm[1].leaf")["primitives"]
    places = own.numbers(leaf["attributes"]["POSITION"])
    np.testing.assert_allclose(
        [places.min(axis=0), places.max(axis=0)], [[0.005, -0.005, -0.02], [0.05, 0.005, 0.02]], atol=1e-7
    )
    moved = own.numbers(leaf["targets"][0]["POSITION"])
    np.testing.assert_allclose(moved, np.tile([0, 0, 0.02], (8, 1)), atol=1e-6)
    (base,) = own.mesh("base")["primitives"]
    assert not own.numbers(base["targets"][0]["POSITION"]).any()
    corners = own.numbers(leaf["indices"])[:, 0]
    assert corners.size == 36 and set(corners) == set(range(8))
    assert own.mesh("arm[1].leaf")["extras"]["targetNames"] == ["mode 1: 22.44 Hz"]
    assert [own.mesh(name)["primitives"][0]["mode"] for name in ("base", "<b>spring</b>", "tip")] == [4, 1, 0]


def test_z_of_the_mechanism_points_upward(show):
    own = Glb(saved(show(), "save as GLB")[1])
    x, y, z, w = next(node for node in own.json["nodes"] if node["name"] == "two boxes")["rotation"]
    v, axis = np.array([0, 0, 1.0]), np.array([x, y, z])
    turned = v + 2 * w * np.cross(axis, v) + 2 * np.cross(axis, np.cross(axis, v))
    np.testing.assert_allclose(turned, [0, 1, 0], atol=1e-12)


def test_colours_are_those_of_the_kinds(show):
    own = Glb(saved(show(), "save as GLB")[1])
    material = own.json["materials"][own.mesh("base")["primitives"][0]["material"]]
    linear = np.array(material["pbrMetallicRoughness"]["baseColorFactor"][:3])
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert "#{:02x}{:02x}{:02x}".format(*np.round(255 * srgb).astype(int)) == BODY
    assert material["name"] == "bodies"


def test_the_animation_is_a_cycle_of_a_mode(show):
    own = Glb(saved(show(), "save as GLB")[1])
    (animation,) = own.json["animations"]
    assert animation["name"] == "mode 1: 22.44 Hz"
    assert {channel["target"]["node"] for channel in animation["channels"]} == {0, 1, 2, 3}
    assert {channel["target"]["path"] for channel in animation["channels"]} == {"weights"}
    sampler = animation["samplers"][0]
    times, weights = own.numbers(sampler["input"])[:, 0], own.numbers(sampler["output"])[:, 0]
    assert times[0] == 0 and np.all(np.diff(times) > 0)
    np.testing.assert_allclose(weights, np.sin(2 * np.pi * times / times[-1]), atol=1e-6)


def test_a_stroke_goes_through_its_poses(show):
    page = show()
    page.get_by_role("radio", name="stroke of arm").check()
    name, data = saved(page, "save as GLB")
    assert name == "two-boxes-stroke-of-arm.glb"
    own = Glb(data)
    (leaf,) = own.mesh("arm[1].leaf")["primitives"]
    heights = [own.numbers(target["POSITION"])[0, 2] for target in leaf["targets"]]
    np.testing.assert_allclose(heights, [-0.02, -0.008, 0.01, 0.02], atol=1e-6)
    sampler = own.json["animations"][0]["samplers"][0]
    np.testing.assert_array_equal(own.numbers(sampler["output"]).reshape(4, 4), np.eye(4))


def test_what_is_hidden_is_not_saved(show):
    page = show()
    page.get_by_role("checkbox", name="bodies 1").uncheck()
    own = Glb(saved(page, "save as GLB")[1])
    assert "base" not in [node["name"] for node in own.json["nodes"]]


def test_undeformed_nothing_moves(show):
    page = show(two_boxes(name="a/b: c"))
    page.get_by_role("radio", name="undeformed").check()
    name, data = saved(page, "save as GLB")
    own = Glb(data)
    assert name == "a-b-c-undeformed.glb"
    assert "animations" not in own.json and "targets" not in own.mesh("base")["primitives"][0]
