"""Wishes that cannot be are told in words, where they stand, before anything is listed; damaged folders go on."""

import json

import numpy as np
import pytest

from flexura.errors import ModelError, OptionError
from flexura.modelfile import read_as
from flexura.synthesis import WishFile, room_of
from flexura.synthesis.drafts import _move
from flexura.synthesis.search import Store

KEYS = {"freedoms": "{platform: [x]}", "envelope": "[60 mm, 60 mm, 40 mm]"}


def read(**keys):
    lines = [f"  {key}: {value}" for key, value in {**KEYS, **keys}.items() if value]
    return read_as(WishFile, "\n".join(["wish:", *lines]) + "\n", "wish.yaml").wish


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"stroke": "{x: 40 mm}"}, "moves the middle of the envelope by 40 mm"),
        ({"stroke": "{x: 0 mm}"}, "stroke.x: a stroke is a length or an angle, positive"),
        ({"stroke": "{x: 3}"}, "stroke.x: .* with its unit"),
        ({"stroke": "{x: 1 deg}"}, "the stroke of x is a length"),
        ({"stroke": "{rz: 1 deg}"}, "along rz, which is no freedom"),
        ({"freedoms": "{platform: [rx]}", "about": "[0, 0, 100 m]", "stroke": "{rx: 1 deg}"}, "by 1744.98 mm"),
        ({"freedoms": "{screws: {a: {axis: x, pitch: 1e9 m}}}", "stroke": "{a: 1 deg}"}, "of a moves the middle"),
        ({"freedoms": "{screws: {a: {axis: x, pitch: infinite}}}", "stroke": "{a: 1 deg}"}, "of a is a length"),
        ({"freedoms": "{screws: {a: {axis: x, pitch: p}}}"}, "screws.a: pitch: p is no number"),
        ({"freedoms": "{screws: {a: {axis: [0, 0, 0]}}}"}, "all components are zero"),
        ({"freedoms": "{platform: [x, tx]}"}, "named twice"),
        ({"freedoms": "{platform: [x], screws: {a: {axis: x}}}"}, "of the platform or screws"),
        ({"about": "[0, 0, far]"}, "about: far is no number"),
        ({"envelope": ""}, "wish.envelope: required"),
        ({"envelope": "[60, 60 mm, 40 mm]"}, "envelope.0: a length carries a unit"),
        ({"make": "{thinnest: 100 mm}"}, "webs of 100 mm are thicker than half the envelope"),
        ({"make": "{process: cast}"}, "make.process"),
        ({"make": "{material: unobtainium}"}, "make: unobtainium is no material"),
        ({"platform": "{material: unobtainium}"}, "platform: unobtainium is no material"),
        ({"platform": "{mass: -1 kg}"}, "must be positive"),
        ({"drives": "3 steam engines along q"}, "so many of a kind along an axis"),
        ({"drives": "2 voice coils along x and z"}, "along two axes are along the base, and that is z-"),
    ],
    ids=lambda own: own if isinstance(own, str) else "",
)
def test_what_cannot_be_is_told_where_it_stands(keys, told):
    with pytest.raises(ModelError, match=told) as caught:
        read(**keys)
    assert str(caught.value).splitlines()[1].startswith("wish.yaml:")


@pytest.mark.parametrize(
    ("screws", "stroke", "moves"),
    [
        ("{a: {axis: z, pitch: 2 mm}}", "{a: 20 mrad}", {"rz": 0.02}),
        ("{a: {axis: [1, 1, 0], pitch: infinite}}", "{a: 1 mm}", {"x": 1e-3 / 2**0.5}),
        ("{a: {axis: [1, 1, 0]}, b: {axis: [1, -1, 0]}}", "{a: 20 mrad}", {"rx": 0.02 / 2**0.5, "ry": 0.02 / 2**0.5}),
        (
            "{a: {axis: z, point: [0, 30 mm, 0]}, b: {axis: z, point: [0, -30 mm, 0]}}",
            "{a: 20 mrad, b: 10 mrad}",
            {"rz": 0.03, "x": 0.3e-3},
        ),
    ],
)
def test_strokes_along_screws_move_the_point_of_the_wish(screws, stroke, moves):
    """By as many of its components as there are freedoms: a turn by a about z moves what is b below its axis by a b."""
    wish = read(freedoms=f"{{screws: {screws}}}", stroke=stroke, about="[0, 0, 0]")
    found = _move(wish, room_of(wish))
    ends = {name: float(end.split()[0]) / 1e3 for name, (_, end) in found.items()}
    assert ends.keys() == moves.keys()
    for name, end in moves.items():
        assert abs(ends[name]) == pytest.approx(end, rel=1e-8)


def test_damaged_folders_go_on_with_what_is_whole(tmp_path):
    Store(tmp_path, "a wish", 8).add("rest 0", {"gap": np.array([1.0])})
    with (tmp_path / "known.jsonl").open("ab") as file:
        file.write(b'[1]\n"x"\n{"gap": [2.0]}\n{"name": "b", "gap": ["x"]}\n\xff\xfe\n{"name": "rest 1", "ga')
    store = Store(tmp_path, "a wish", 8)
    assert list(store.known) == ["rest 0"]
    store.add("rest 2", {"gap": np.array([3.0])})
    again = Store(tmp_path, "a wish", 8).known
    assert list(again) == ["rest 0", "rest 2"] and again["rest 2"]["gap"] == [3.0]
    for line, text in ((json.dumps({"wish": "other"}), "another wish"), ("\x00", "another wish")):
        (tmp_path / "known.jsonl").write_text(line + "\n")
        with pytest.raises(OptionError, match=text):
            Store(tmp_path, "a wish", 8)
    (tmp_path / "file").write_text("")
    with pytest.raises(OptionError, match="cannot be written to"):
        Store(tmp_path / "file", "a wish", 8)
