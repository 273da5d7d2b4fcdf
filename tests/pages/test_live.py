"""The server of the live page: whom it answers, what it works out, what it reads and writes, and how it ends."""

from __future__ import annotations

import http.client
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

import flexura as fx
from flexura.pages.live import Ask, Described
from flexura.pages.live.session import Session
from helpers import forked
from helpers.live_page import PATIENCE, ROOT, Served, served, talk

GUIDE = ROOT / "examples" / "guide" / "guide.yaml"
STROKE = {"kind": "move", "dof": "carriage.tx", "amplitude": 1e-3}
FRF = {"input": "carriage.tx", "output": "carriage.tx", "low": 10.0, "high": 200.0}


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """The file of `guide`, alone in its folder, which nothing changes."""
    return Path(shutil.copy(GUIDE, tmp_path_factory.mktemp("live")))


@pytest.fixture(scope="module")
def guide(file) -> Iterator[Served]:
    with served(file, "--keep") as own:
        yield own


@pytest.fixture
def copy(tmp_path) -> Path:
    return Path(shutil.copy(GUIDE, tmp_path))


def get(own: Served, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    """Status, text and headers of what is answered to a request."""
    with closing(http.client.HTTPConnection("127.0.0.1", int(own.host.split(":")[1]), timeout=PATIENCE)) as link:
        link.request("GET", path, headers={"Host": own.host, **headers})
        answer = link.getresponse()
        return answer.status, answer.read().decode(), {key.lower(): value for key, value in answer.getheaders()}


def test_the_page_is_given_to_those_who_know_the_token(guide):
    status, text, headers = get(guide, guide.path)
    assert status == 200 and "parallel leaf-spring guide" in text and "Content-Security-Policy" in text
    assert headers["cache-control"] == "no-store" and headers["referrer-policy"] == "no-referrer"


@pytest.mark.parametrize("path", ["/", "/guide.yaml", "/socket", "/%2e%2e/guide.yaml", "/x/", "/" + "a" * 32 + "/"])
def test_nothing_is_given_to_others(guide, path):
    status, text, _ = get(guide, path)
    assert status in (403, 404) and "leaf" not in text and guide.path.strip("/") not in text


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1", "localhost:1", ""])
def test_other_hosts_are_refused(guide, host):
    assert get(guide, guide.path, Host=host)[0] in (400, 403)
    assert get(guide, guide.path, Origin="http://evil.example")[0] == 403


def test_this_machine_by_its_name_is_none_of_them(guide):
    assert get(guide, guide.path, Host=guide.host.replace("127.0.0.1", "localhost"))[0] == 200


@pytest.mark.parametrize(
    "how",
    [
        {"origin": "http://evil.example"},
        {"origin": None},
        {"origin": "https://127.0.0.1"},
        {"path": "/" + "a" * 32 + "/"},
        {"headers": {"Host": "evil.example"}},
    ],
)
def test_a_websocket_from_elsewhere_is_refused(guide, how):
    with pytest.raises(InvalidStatus) as refused, talk(guide, **how):
        pass
    assert refused.value.response.status_code in (400, 403)


def test_only_this_machine_is_listened_to(guide):
    addresses = {own[4][0] for own in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in addresses - {"127.0.0.1", "127.0.1.1"}:
        with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
            socket.create_connection((address, int(guide.host.split(":")[1])), timeout=2)


def test_sliders_are_the_parameters_with_their_bounds(guide):
    with talk(guide) as (_, opened):
        own = {slider["name"]: slider for slider in opened["sliders"]}
    thickness = own["thickness"]
    assert (thickness["value"], thickness["unit"]) == (0.5, "mm")
    assert (thickness["low"], thickness["high"], thickness["minimum"], thickness["maximum"]) == (0.1, 2, True, True)
    assert own["width"]["low"] < 20 < own["width"]["high"]
    assert not own["width"]["minimum"] and not own["width"]["maximum"]
    assert opened["file"] == "guide.yaml" and own["length"]["source"] == "example"


def test_parameters_at_zero_move_as_far_as_others_of_their_kind(tmp_path):
    more = "  shift: 0 mm\n  lift: {value: 0 mm, maximum: 5 mm}\n  count: 4\n  tilt: 0 deg\n"
    text = (ROOT / "examples/guide/guide.yaml").read_text(encoding="utf-8")
    file = tmp_path / "zero.yaml"
    file.write_text(text.replace("parameters:\n", f"parameters:\n{more}", 1), encoding="utf-8")
    with served(file) as own, talk(own) as (_, opened):
        sliders = {slider["name"]: slider for slider in opened["sliders"]}
    ends = {name: tuple(sliders[name][key] for key in ("value", "low", "high", "unit")) for name in ("shift", "lift")}
    assert ends == {"shift": (0, -20, 20, "mm"), "lift": (0, -5, 5, "mm")}
    assert sliders["tilt"]["low"] < 0 < sliders["tilt"]["high"]


def test_frequencies_are_those_of_modes(guide):
    values, parameters = {"thickness": 0.41, "length": 73.0}, {"thickness": 0.41e-3, "length": 73e-3}
    with talk(guide) as (own, _):
        told = own.all_of(own.ask(values, modes=4))
    found = told["numbers"]
    truth = fx.modes(fx.load(GUIDE), parameters, n=4, order="full").frequency_hz
    assert [row["text"] for row in found["rows"]] == [f"{hz:.5g}" for hz in truth]
    assert all(row["proof"].startswith("within") and not row["flag"] for row in found["rows"])
    picture = told["picture"]
    assert list(told)[:2] == ["numbers", "picture"] and picture["row"] == found["rows"][0]
    points = picture["buffers"]["points"]
    x = np.frombuffer(picture["bytes"], "<f4", points["bytes"] // 4, points["offset"]).reshape(points["shape"])
    assert np.ptp(x[:, 2]) > 0.073 and points["offset"] % 4 == 0


def test_rigid_motions_are_said_beside_as_many_others(tmp_path):
    text = GUIDE.read_text(encoding="utf-8")
    (tmp_path / "free.yaml").write_text(text[: text.index("ground:")], encoding="utf-8")
    with served(tmp_path / "free.yaml", "-n", "3") as own, talk(own) as (page, opened):
        found = page.all_of(page.ask({"thickness": 0.6}, modes=opened["modes"]))["numbers"]
    wanted = fx.modes(fx.load(tmp_path / "free.yaml"), {"thickness": 0.6e-3}, n=9, order="full")
    rows = found["rows"]
    assert [row["rigid"] for row in rows] == [mode.is_rigid for mode in wanted.modes] == [True] * 6 + [False] * 3
    assert [row["proof"] for row in rows[:6]] == ["rigid motion"] * 6 and not any(row["flag"] for row in rows)
    assert [row["text"] for row in rows] == [f"{hz:.5g}" for hz in wanted.frequency_hz] and found["shown"] == 7


def test_facts_of_parts_follow_once_the_hand_rests(guide):
    def sizes(message):
        return {dict(own).get("section") for own in message["facts"].values()} - {None}

    with talk(guide) as (own, _):
        assert sizes(own.all_of(own.ask({}))["facts"]) == {"0.5 x 20 mm"}
        assert sizes(own.all_of(own.ask({"thickness": 0.4}))["facts"]) == {"0.4 x 20 mm"}
        assert own.all_of(own.ask({"thickness": 0.4}, shown=2))["facts"]["facts"] == {}


def test_what_takes_longer_follows(guide):
    with talk(guide) as (own, _):
        found = own.all_of(own.ask({"thickness": 0.4}, response=FRF, load=STROKE))
    model = fx.assemble(fx.load(GUIDE), {"thickness": 0.4e-3})
    assert found["motions"]["texts"]["1"].startswith("carriage moves along x")
    force = 1e-3 / fx.compliance(model, nodes=["carriage"])[0, 0]
    state = fx.statics(model, loads={"carriage": [force, 0, 0, 0, 0, 0]})
    assert found["stress"]["rows"][0]["factor"] == pytest.approx(state.stresses().factor_to_yield, rel=1e-6)
    curves = found["response"]["buffers"]["curves"]
    hz, size, _ = np.frombuffer(found["response"]["bytes"], "<f4", curves["bytes"] // 4, curves["offset"]).reshape(
        3, -1
    )
    wanted = fx.frequency_response(
        model, frequency_hz=hz.astype(float), inputs=["carriage.tx"], outputs=["carriage.tx"], damping=0.01
    )
    np.testing.assert_allclose(size, np.abs(wanted.response[:, 0, 0]), rtol=1e-3)
    assert "assumed" in found["response"]["notes"][0]


def test_how_far_the_part_may_be_follows_beside_each_frequency(guide):
    with talk(guide) as (own, _):
        found = own.all_of(own.ask({"thickness": 0.4}, modes=3))["model errors"]
    wanted = fx.modes(fx.load(GUIDE), {"thickness": 0.4e-3}, n=3, order="full").model_errors
    assert [found["errors"][str(k)]["text"] for k in (1, 2, 3)] == list(wanted.texts) and len(found["errors"]) == 3
    assert found["errors"]["1"]["why"] == wanted.causes[0] and "leaf" in wanted.causes[0]


class Still:
    """A worker that does at once what it is given, while the hand moves or rests."""

    def __init__(self, is_moving: bool) -> None:
        self.is_moving = is_moving

    def submit(self, _: object, work: Callable[[], None]) -> None:
        work()

    def is_waiting(self, _: object = None) -> bool:
        return self.is_moving


class Said(list[str]):
    """The kinds of what a page is told."""

    def put(self, kind: str, _: str | bytes) -> None:
        self.append(kind)


def said_of_eight(is_moving: bool) -> Said:
    """What is told of as many designs."""
    own = Described(fx.assemble(fx.load(GUIDE)).plan, 3, (), 0)
    said = Said()
    session: Any = Session(cast(Any, Still(is_moving)), cast(Any, lambda: own), cast(Any, said))
    for serial in range(8):
        session.receive(Ask(type="design", serial=serial, values={}, modes=3))
    return said


@pytest.mark.parametrize(("is_moving", "frame", "pictures"), [(True, np.inf, 0), (True, 0.0, 8), (False, np.inf, 8)])
def test_numbers_come_first_and_pictures_are_left_out_where_the_hand_has_moved_on(
    monkeypatch, is_moving, frame, pictures
):
    monkeypatch.setattr("flexura.pages.live.session.FRAME", frame)
    said = said_of_eight(is_moving)
    assert [own for own in said if own in ("numbers", "picture")] == 8 * ["numbers", "picture"][: 1 + bool(pictures)]
    assert said.count("picture") == pictures


@pytest.mark.parametrize("is_moving", [True, False])
def test_model_errors_wait_until_the_hand_rests_and_come_last(monkeypatch, is_moving):
    monkeypatch.setattr("flexura.pages.live.session.PATIENCE", 0.0)
    monkeypatch.setattr("flexura.pages.live.session.FRAME", 0.0)
    said = said_of_eight(is_moving)
    if is_moving:
        assert {"picture", "holds", "motions"} <= {*said} and not {"facts", "model errors", "settled"} & {*said}
    else:
        assert said[-2:] == ["model errors", "settled"] and said.count("model errors") == 8


def test_rows_keep_their_identity_through_a_crossing(tmp_path):
    """Two blocks on springs of their own: their frequencies are closed forms, and cross where stiffnesses are equal."""
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    with served(tmp_path / "two.yaml", "-n", "2") as own, talk(own) as (page, _):
        hz = {}
        for k in (1.0, 1.5, 1.9, 2.1, 3.0):
            rows = page.all_of(page.ask({"soft": k}, modes=2))["numbers"]["rows"]
            hz[k] = {row["mode"]: row["hz"] for row in rows}
    for k, rows in hz.items():
        assert rows[1] == pytest.approx(np.sqrt(1e3 * k) / (2 * np.pi), rel=1e-6)
        assert rows[2] == pytest.approx(np.sqrt(2e3) / (2 * np.pi), rel=1e-6)


TWO = """flexura: 1
name: two
parameters: {soft: {value: 1 N/mm, minimum: 0.5 N/mm, maximum: 4 N/mm}}
nodes: {a: [0, 0, 0], b: [1 cm, 0, 0], foot: [0, 0, 1 cm]}
masses:
  first: {node: a, mass: 1 kg}
  second: {node: b, mass: 1 kg}
springs:
  one: {nodes: [a, foot], stiffness: {tx: soft}}
  two: {nodes: [b, foot], stiffness: {tx: 2 N/mm}}
ground: {foot: clamped, a: {free: [tx]}, b: {free: [tx]}}
"""


def test_of_500_moves_the_last_wins_and_others_are_dropped(guide):
    with talk(guide) as (own, _):
        for k in range(500):
            last = own.ask({"thickness": 0.3 + 1e-3 * k})
        found, pictures = {}, 0
        while True:
            message = own.next()
            pictures += message["type"] == "picture"
            if message["type"] == "settled":
                break
            found[message["type"]] = message
    truth = fx.modes(fx.load(GUIDE), {"thickness": (0.3 + 1e-3 * 499) * 1e-3}, order="full").frequency_hz
    assert found["numbers"]["serial"] == found["picture"]["serial"] == last == message["serial"] and pictures < 250
    assert found["numbers"]["rows"][0]["text"] == f"{truth[0]:.5g}"


def test_two_pages_do_not_see_one_another(copy):
    """Leaves of twice the thickness between rigid joints are 2^3 as stiff."""
    text = copy.read_text(encoding="utf-8")
    copy.write_text(text.replace("reference: x\n", "reference: x\n        root: rigid\n"), encoding="utf-8")
    with served(copy) as own_file, talk(own_file) as (a, _), talk(own_file) as (b, _):
        thin, thick = a.ask({"thickness": 0.3}), b.ask({"thickness": 0.6})
        own = a.all_of(thin)["numbers"]["rows"][0]["hz"], b.all_of(thick)["numbers"]["rows"][0]["hz"]
    assert own[1] / own[0] == pytest.approx(2**1.5, rel=0.03)


@pytest.mark.parametrize(
    "values", [{"thickness": 3.0}, {"thickness": 0.05}, {"width": -1.0}, {"length": 0.0}, {"width": 0.0}]
)
def test_a_design_that_cannot_be_is_said_at_its_slider(guide, values):
    with talk(guide) as (own, _):
        own.all_of(own.ask({"distance": 60.0}))
        found = own.all_of(own.ask({"distance": 60.0, **values}))
        assert [problem["sliders"] for problem in found["refused"]["problems"]] == [list(values)] * len(
            found["refused"]["problems"]
        )
        assert found["refused"]["problems"][0]["text"]
        assert "settled" in own.all_of(own.ask({"distance": 60.0}))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"thickness": 3.0}, "parameter thickness = 3 mm is above its maximum 2 mm"),
        ({"thickness": 0.05}, "parameter thickness = 0.05 mm is below its minimum 0.1 mm"),
    ],
)
def test_a_bound_is_said_in_the_unit_of_the_slider(guide, values, text):
    with talk(guide) as (own, _):
        assert [problem["text"] for problem in own.all_of(own.ask(values))["refused"]["problems"]] == [text]


def test_a_bound_that_depends_on_others_is_said_in_the_unit_of_the_slider(tmp_path):
    text = TWO.replace("maximum: 4 N/mm}}", "maximum: 4 N/mm}, stiff: {value: 2*soft, maximum: 5.5 N/mm}}")
    (tmp_path / "two.yaml").write_text(text.replace("tx: 2 N/mm", "tx: stiff"), encoding="utf-8")
    with served(tmp_path / "two.yaml") as own, talk(own) as (page, _):
        problem = page.all_of(page.ask({"soft": 3.0}))["refused"]["problems"][0]
    assert problem == {"text": "parameter stiff = 6 N/mm is above its maximum 5.5 N/mm", "sliders": ["soft"]}


def test_a_stroke_is_assumed_where_the_file_has_none(guide, tmp_path):
    with talk(guide) as (_, opened):
        height = next(own["value"] for own in opened["sliders"] if own["name"] == "length")
        stroke = opened["stroke"]
        assert stroke["dof"] == "carriage.tx" and stroke["assumed"]
        assert 0.005 < stroke["amplitude"] / (height * 1e-3) < 0.02
    text = GUIDE.read_text(encoding="utf-8") + "motion: {move: {carriage: {x: [-2 mm, 3 mm]}}}\n"
    (tmp_path / "guide.yaml").write_text(text, encoding="utf-8")
    with served(tmp_path / "guide.yaml") as own, talk(own) as (_, opened):
        assert opened["stroke"] == {"dof": "carriage.tx", "amplitude": 3e-3, "assumed": False}


@pytest.mark.parametrize(
    "message",
    [
        "",
        "{",
        "[]",
        "null",
        b"\0\1\2",
        '{"type": "design"}',
        '{"type": "design", "serial": 1, "values": {"thickness": NaN}}',
        '{"type": "design", "serial": 1, "values": {"thickness": 1e999}}',
        '{"type": "design", "serial": 1, "values": {}, "modes": 100000}',
        '{"type": "design", "serial": -1, "values": {}}',
        '{"type": "design", "serial": 1, "values": {}, "more": 1}',
        '{"type": "read", "file": "/etc/passwd"}',
        "[" * 100_000,
    ],
)
def test_what_is_not_understood_is_said_and_harms_nobody(guide, message):
    with talk(guide) as (own, _):
        own.say(message)
        assert own.until("misunderstood")["text"]
        assert "settled" in own.all_of(own.ask({}))


def test_a_message_that_is_too_large_ends_its_page_alone(guide):
    with talk(guide) as (other, _):
        with talk(guide) as (own, _), pytest.raises(ConnectionClosed):
            own.say(" " * 1_000_000)
            own.next()
        assert "settled" in other.all_of(other.ask({}))


def test_a_page_that_talks_nonsense_is_no_longer_listened_to(guide):
    with talk(guide) as (own, _), pytest.raises(ConnectionClosed):
        for _ in range(50):
            own.say("nonsense")
        while True:
            own.next()


@pytest.mark.parametrize("ask", [{"response": {**FRF, "input": "nothing.tx"}}, {"response": {**FRF, "high": 5.0}}])
def test_a_response_that_cannot_be_is_said(guide, ask):
    with talk(guide) as (own, _):
        found = own.all_of(own.ask({}, **ask))
    assert found["no response"]["error"] and "settled" in found


def save(own, file, values, **others):
    own.say({"type": "save", "file": file, "values": values, **others})
    return own.until("saved", "exists", "not saved")


def test_a_design_is_saved_beside_the_file(copy):
    before = copy.read_bytes()
    with served(copy) as own, talk(own) as (page, _):
        assert save(page, "thin.yaml", {"thickness": 0.41})["type"] == "saved"
        new = copy.with_name("thin.yaml")
        found = fx.load(new)
        assert found.parameters["thickness"].value == 0.41e-3
        assert found.parameters["thickness"].maximum == 2e-3 and "0.5 mm" in found.parameters["thickness"].source
        text = new.read_text(encoding="utf-8")
        assert 'extends: "guide.yaml"' in text and "length" not in text
        assert save(page, "thin.yaml", {"thickness": 0.6})["type"] == "exists" and new.read_text("utf-8") == text
        assert save(page, "thin.yaml", {"thickness": 0.6}, overwrite=True)["type"] == "saved"
        assert fx.load(new).parameters["thickness"].value == 0.6e-3
        new.unlink()
        files = sorted(path.name for path in copy.parent.iterdir())
    assert copy.read_bytes() == before and files == ["guide.yaml"]


@pytest.mark.parametrize(
    "name",
    ["../out.yaml", "/tmp/out.yaml", "guide.yaml", "a/b.yaml", "out.txt", ".hidden.yaml", "", "a\\b.yaml", "x\0.yaml"],
)
def test_nothing_is_written_elsewhere(guide, file, name):
    with talk(guide) as (page, _):
        assert save(page, name, {"thickness": 0.41}, overwrite=True)["type"] == "not saved"
    assert [path.name for path in file.parent.iterdir()] == ["guide.yaml"]
    assert not (file.parent.parent / "out.yaml").exists()


def test_links_are_not_written_through(copy, tmp_path_factory):
    target = tmp_path_factory.mktemp("elsewhere") / "kept.yaml"
    target.write_text("kept", encoding="utf-8")
    copy.with_name("link.yaml").symlink_to(target)
    with served(copy) as own, talk(own) as (page, _):
        assert save(page, "link.yaml", {"thickness": 0.41}, overwrite=True)["type"] == "not saved"
    assert target.read_text(encoding="utf-8") == "kept"


@pytest.mark.parametrize("values", [{}, {"thickness": 0.5}, {"thickness": 5.0}, {"nothing": 1.0}])
def test_what_cannot_be_saved_is_said(guide, file, values):
    with talk(guide) as (page, _):
        assert save(page, "new.yaml", values)["type"] == "not saved"
    assert not file.with_name("new.yaml").exists()


def test_the_file_is_watched(copy):
    text = copy.read_text(encoding="utf-8")
    with served(copy) as own, talk(own) as (page, opened):
        copy.write_text(text.replace("thickness: {value: 0.5 mm", "thickness: {value: 0.6 mm"), encoding="utf-8")
        again = page.until("opened")
        assert again["revision"] > opened["revision"]
        assert next(s for s in again["sliders"] if s["name"] == "thickness")["value"] == 0.6
        copy.write_text(text.replace("thickness: thickness", "thickness: thicknes"), encoding="utf-8")
        broken = page.until("file")
        line = 1 + text[: text.index("profile: {")].count("\n")
        assert not broken["gone"] and broken["problems"][0]["where"].endswith(f"guide.yaml:{line}")
        assert page.all_of(page.ask({}))["numbers"]["revision"] == again["revision"]
        copy.unlink()
        assert page.until("file")["gone"]
        assert "settled" in page.all_of(page.ask({}))
        with talk(own) as (late, _):
            assert late.until("file")["gone"]
        copy.write_text(text, encoding="utf-8")
        assert page.until("opened")["revision"] > again["revision"]


def test_what_the_file_extends_is_watched(copy):
    own_file = copy.with_name("own.yaml")
    own_file.write_text("flexura: 1\nextends: guide.yaml\nname: own\n", encoding="utf-8")
    with served(own_file) as own, talk(own) as (page, _):
        text = copy.read_text(encoding="utf-8").replace("thickness: {value: 0.5 mm", "thickness: {value: 0.7 mm")
        copy.write_text(text, encoding="utf-8")
        again = page.until("opened")
        assert next(s for s in again["sliders"] if s["name"] == "thickness")["value"] == 0.7
        assert save(page, "guide.yaml", {"thickness": 0.41}, overwrite=True)["type"] == "not saved"


def test_what_is_no_request_is_not_worth_a_word(copy):
    with served(copy) as own:
        for line in (b"nonsense\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01\0\xff"):
            with socket.create_connection(("127.0.0.1", int(own.host.split(":")[1])), timeout=PATIENCE) as link:
                link.sendall(line)
                link.shutdown(socket.SHUT_WR)
                while link.recv(4096):
                    pass
        status, said = own.interrupt()
    assert status == 130 and "nvalid" not in said and "Traceback" not in said


def test_interrupted_it_ends(copy):
    with served(copy) as own, talk(own) as (page, _):
        page.ask({})
        status, said = own.interrupt()
        assert status == 130 and "interrupted" in said and "Traceback" not in said, said


def test_it_ends_when_the_page_is_closed_unless_it_is_kept(copy):
    with served(copy, "--keep") as kept:
        with talk(kept):
            pass
        with served(copy) as own:  # a process begins while the page of the other is closed
            with talk(own):
                pass
            assert own.process.wait(timeout=PATIENCE) == 0
        assert kept.process.poll() is None
        with talk(kept) as (page, _):
            assert "settled" in page.all_of(page.ask({}))


def run(*arguments: str) -> tuple[int, str]:
    done = forked.completed("live", *arguments, env=os.environ, timeout=PATIENCE)
    return done.returncode, done.stderr


def test_a_busy_port_is_said_and_the_next_is_taken_where_none_is_asked_for(guide, copy):
    status, said = run(str(copy), "--no-browser", "--port", guide.host.split(":")[1])
    assert status == 2 and "cannot be listened at" in said
    with served(copy) as own:
        assert own.host != guide.host


def test_a_file_that_cannot_be_used_is_said_at_once(tmp_path):
    assert run(str(tmp_path / "none.yaml"))[0] == 2
    (tmp_path / "bad.yaml").write_text("flexura: 1\nnodes: 3\n", encoding="utf-8")
    status, said = run(str(tmp_path / "bad.yaml"))
    assert status == 2 and "bad.yaml:2" in said


def test_without_a_browser_the_address_is_printed(copy):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")}
    environment["PYTHONPATH"] = str(ROOT / "src")
    command = [sys.executable, "-m", "flexura", "live", str(copy)]
    own = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert own.stdout is not None
        assert "http://127.0.0.1:" in own.stdout.readline()
        assert "no browser could be opened" in own.stdout.readline()
    finally:
        own.kill()
        own.communicate()


def test_arguments_of_live_are_checked(copy):
    for wrong in ({"port": 0}, {"port": "x"}, {"n": 0}, {"n": 1000}):
        with pytest.raises(fx.OptionError):
            fx.live(copy, **wrong)
