"""The page of designs tells why each is there, from a result and the files beside it."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest

from flexura.errors import ModelError
from flexura.pages.report import gallery, save_designs
from flexura.pages.report.gallery import AIMS, MOST, undominated
from flexura.study.requirements import Requirement
from flexura.synthesis import Candidate, Candidates, WholeCandidate, WholeCandidateMode
from helpers.browser import DESKTOP, PHONE, Opened, serious_findings, shot

GUIDE = Path(__file__).parents[2] / "examples/guide/guide.yaml"
HOSTILE = "a <script>alert(1)</script> & \"b\" 'c' </style>"


def required(name: str, text: str, value: float, limit: float, unit: str) -> Requirement:
    verdict = "met" if value >= limit else "not known" if np.isnan(value) else "missed"
    return Requirement(
        name, text, verdict, value, limit, unit, (value - limit) / limit, None, None, "not asked", "", 0, 0.0, ""
    )


def candidate(number: int, first_hz: float, mass: float, stiff: float = 6e6, **more) -> Candidate:
    own = (
        required("first mode", "f1 >= 400 Hz", first_hz, 400.0, "Hz"),
        required(HOSTILE, "stiffness(platform.x) >= 5 N/um", stiff, 5e6, "N/m"),
    )
    named = {
        "topology": f"{number} wires at the side",
        "over": 0,
        "gap": 20.0,
        "least_gap": 10.0,
        "limbs": number,
        **more,
    }
    return Candidate(
        f"candidate-{number:02d}.yaml", freedoms="2R1T", first_hz=first_hz, mass=mass, requirements=own, **named
    )


def found(*candidates: Candidate) -> Candidates:
    return Candidates(HOSTILE, "2R1T", 61, 40, 2600, candidates, {"freedoms": 3, HOSTILE: 30, "spare": 0}, (HOSTILE,))


DESIGNS = found(
    candidate(1, 700.0, 0.040), candidate(2, 500.0, 0.020, 9e6), candidate(3, 450.0, 0.030), candidate(4, 300.0, 0.010)
)
"""Three that meet all, the third of which the second dominates, and one that does not."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("designs")
    for number in (1, 2, 3):  # the file of the fourth is missing
        shutil.copy(GUIDE, folder / f"candidate-{number:02d}.yaml")
    (folder / "wish.yaml").write_text(f"name: {HOSTILE!r}\n", encoding="utf-8")
    save_designs(DESIGNS, folder, wish=folder / "wish.yaml")
    return folder


@pytest.fixture(scope="module")
def cards(folder) -> dict[str, str]:
    text = (folder / "index.html").read_text(encoding="utf-8")
    return dict(re.findall(r'<section id="([\w-]+)"[^>]*>(.*?)</section>', text, re.DOTALL))


def test_cards_say_why_they_are_there(cards):
    assert [own for own in cards if own.startswith("candidate")] == [f"candidate-0{k}" for k in (1, 2, 3, 4)]
    assert "Of those that meet all: highest first mode, fewest limbs." in cards["candidate-01"]
    assert f"Of those that meet all: lightest, largest margin, stiffest ({escape(HOSTILE)})." in cards["candidate-02"]
    assert "first mode 500 Hz, 29 % below the 700 Hz of candidate-01" in cards["candidate-02"]
    assert "Dominated: candidate-02 " in cards["candidate-03"]
    assert "Does not meet all: first mode missed." in cards["candidate-04"]
    assert "Better than any of those that meet all: mass 10 g." in cards["candidate-04"]


def test_verdicts_are_words_in_colours(cards):
    assert '<td class="good">met</td>' in cards["candidate-01"]
    assert '<td class="bad">missed</td>' in cards["candidate-04"]


def test_counts_stand_at_the_top(cards):
    assert "3 designs of 4 meet everything" in cards["counts"]
    for row in ("<td>topologies listed</td><td>61</td>", "<td>40, in 2600 designs</td>", "freedoms</td><td>3</td>"):
        assert row in cards["counts"]
    assert "spare" not in cards["counts"]


def test_pictures_sizes_and_scenes_are_of_the_files(cards):
    for number in (1, 2, 3):
        assert 'src="data:image/png;base64,' in cards[f"candidate-0{number}"]
        assert "<td>thickness</td>" in cards[f"candidate-0{number}"]
        assert f'data-viewer="candidate-0{number}"' in cards[f"candidate-0{number}"]
    assert "candidate-04.yaml could not be drawn" in cards["candidate-04"]


def test_points_lead_to_cards_and_the_undominated_are_marked(cards):
    charts = re.findall(r"<svg.*?</svg>", cards["trade"], re.DOTALL)
    assert len(charts) == 2
    links = dict(re.findall(r'<a href="#(candidate-\d+)" class="([\w ]+)"', charts[0]))
    best, met = "dot meets best", "dot meets"
    assert links == {"candidate-01": best, "candidate-02": best, "candidate-03": met, "candidate-04": "dot"}


def test_names_are_text(folder):
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert text.count("</style>") == 1
    assert escape(HOSTILE) in text


def test_undominated_are_those_that_no_other_beats():
    def is_beaten(a: Candidate, b: Candidate) -> bool:
        return a.first_hz <= b.first_hz and a.mass >= b.mass and (a.first_hz, a.mass) != (b.first_hz, b.mass)

    rng = np.random.default_rng(3)
    many = [candidate(k, float(f), float(m)) for k, (f, m) in enumerate(rng.integers(400, 420, (60, 2)))]
    expected = [a for a in many if not any(is_beaten(a, b) for b in many)]
    assert undominated(many, AIMS[:2]) == expected


def test_cards_lead_to_files_and_reports_that_are_made_once(tmp_path, monkeypatch):
    shutil.copy(GUIDE, tmp_path / "candidate-01.yaml")
    mode = WholeCandidateMode(100.0, 101.0, 0.01, -0.02, 0.02, True)
    own = candidate(1, 700.0, 0.04, made=("candidate-01.step",), not_made=("no DXF: it is not flat",))
    designs = replace(
        found(own, candidate(2, 500.0, 0.02)), whole=WholeCandidate(own.file, (mode,), 60.0, ("held at its base",))
    )
    asked, make = [], gallery.report
    monkeypatch.setattr(gallery, "report", lambda *args, **kept: (asked.append(kept["file"]), make(*args, **kept)))
    for _ in range(2):
        text = save_designs(designs, tmp_path, reports=2).read_text(encoding="utf-8")
        for name in ("candidate-01.yaml", "candidate-01.html", "candidate-01.step"):
            assert f'<a href="{name}">' in text
            assert (tmp_path / name).exists() or name.endswith("step")
        assert 'href="candidate-02.html"' not in text
        assert "no DXF: it is not flat" in text
        assert "no report: " in text
        assert "1 of 1 mode within the model error" in text
    assert [path.name for path in asked] == ["candidate-01.yaml"]


def test_many_bad_numbers_and_none_at_all(tmp_path):
    lost = [replace(candidate(k, float("nan"), float("inf"), np.nan), gap=0.0) for k in range(1, MOST + 3)]
    for own, said in ((found(*lost), f"The first {MOST} of {MOST + 2}"), (found(), "0 designs of 0 meet everything")):
        text = save_designs(own, tmp_path).read_text(encoding="utf-8")
        assert said in text
        assert text.count("could not be drawn") == min(MOST, len(own.candidates))
    with pytest.raises(ModelError):
        save_designs(found(), tmp_path, wish=tmp_path / "no.yaml")


@pytest.mark.parametrize("colours", ["light", "dark"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_it_is_read_without_a_network(browser, folder, size, colours):
    with browser.new_context(viewport=size, color_scheme=colours) as context:
        opened = Opened(context)
        context.set_offline(True)
        opened.page.goto((folder / "index.html").as_uri())
        assert opened.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        shot(opened.page, f"designs_{size['width']}_{colours}")
        opened.page.locator(".scatter a").last.click()
        opened.page.wait_for_url(re.compile("#candidate-01"))
        opened.page.get_by_text("in three dimensions").first.click()
        opened.page.locator("#candidate-01 canvas").first.wait_for()
        assert not opened.outside
        assert not opened.errors
        assert not serious_findings(opened.page)


def test_a_gap_that_is_not_known_is_said_to_be_so(tmp_path):
    shutil.copy(GUIDE, tmp_path / "candidate-01.yaml")
    only = found(candidate(1, 700.0, 0.040, gap=np.nan))
    assert "a gap that is not known, and not 10" in str(only.warnings[0])
    text = save_designs(only, tmp_path).read_text(encoding="utf-8")
    assert "a gap that is not known between freedoms and constraints." in text
