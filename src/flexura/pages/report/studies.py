"""The studies of many designs that a file describes, small ones worked out; and solids and a test beside the model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from math import prod
from typing import NamedTuple

from matplotlib.figure import Figure

from flexura.errors import Diagnostic, FlexuraError, foremost
from flexura.mechanism import DescribedStudy, OptimumStudy, Range, SweepStudy, ToleranceStudy
from flexura.pages.report.document import (
    Block,
    Bullets,
    Content,
    Evidence,
    Fact,
    Paragraph,
    Picture,
    Table,
    Tone,
    warned,
)
from flexura.pages.report.subject import Subject
from flexura.pages.report.understood import png_of
from flexura.solid.verification import verify
from flexura.structure import Plan
from flexura.study.engine import StudyTable
from flexura.study.optimum import Optimum, optimize
from flexura.study.questions import Relation, formula, questions, relation
from flexura.study.requirements import described_relations, requirements
from flexura.study.sweeps import sweep
from flexura.study.tolerances import Tolerance, tolerance
from flexura.tables import number, percent, quantity
from flexura.testing.virtual import FoundMode, virtual_test
from flexura.view import draw_optimum, draw_sweep, draw_tolerance

LARGE = 1500
"""Free DOFs of mechanisms of which studies are not worked out here."""

TOGETHER, ALONE = 20_000, 60
"""Designs of a study that is worked out: where all are asked at once, and where each takes its own time."""

VARIABLES, STARTS = 4, 8
"""Of an optimum that is worked out: what varies, and searches."""

TONES: dict[str, Tone] = {"met": "good", "missed": "bad", "not known": "warning"}
"""Of verdicts on requirements."""

SLOW = ("reach", "worst")
"""What takes the time of a stroke in each design."""

MOST_WARNINGS = 3


class Worked(NamedTuple):
    """A study that was worked out: tables, each with the lines of its evidence, the picture, and what it says."""

    tables: Sequence[Table]
    said: Sequence[str]
    figure: Figure
    facts: Sequence[Fact]
    warnings: Sequence[Diagnostic]


def required(subject: Subject) -> Content:
    """What is required of the mechanism, each with its verdict."""
    command = subject.commands("check")
    if not subject.mechanism.requirements:
        text = "The file requires nothing (`requirements:`), e.g. `first mode: f1 >= 100 Hz`; what is asked so:"
        return Content.absent(text, command)
    found = requirements(subject.plan, subject.parameters)
    lines = [(own.name, own.why) for own in found.requirements]
    rows = [(f"{own.name}: {own.text}", own.state, own.verdict) for own in found.requirements]
    table = Table(
        ["requirement", "is", "verdict"], rows, evidence=Evidence(command, lines, essential=True), tones=TONES
    )
    is_bad = any(own.verdict == "missed" for own in found.requirements)
    tone = "bad" if is_bad else "warning" if found.warnings else "good"
    met = sum(own.verdict == "met" for own in found.requirements)
    facts = [Fact("requirements", f"{met} of {len(rows)} met")]
    return Content([Paragraph(found.headline, tone), table], facts=facts, warnings=found.warnings)


def studies(subject: Subject) -> Content:
    """The described studies, each with the command that makes it again."""
    described = subject.mechanism.studies
    if not described:
        text = (
            "The file describes no studies (`studies:`): sweeps, optima and tolerances. One that is named in the shell:"
        )
        asked = ["--vary", "NAME=LOW:HIGH:9", "--ask", "f1"]
        command = subject.commands("sweep", asked, "vary={'NAME': (LOW, HIGH, 9)}, ask='f1'", posed=False)
        return Content.absent(text, command)
    if subject.commands.pose:
        text = "Studies are of the mechanism as its file describes it; this report is about a pose that was asked for."
        return Content.absent(text)
    blocks, facts, warnings, state = list[Block](), list[Fact](), list[Diagnostic](), "shown"
    for name, own in described.items():
        blocks.append(Paragraph(f"{name}: {own.words}"))
        command = subject.commands(own.kind, ["--study", name], f"study={name!r}", posed=False)
        try:
            found = _worked(subject, name, own)
        except FlexuraError as error:
            blocks += [Bullets([f"{type(error).__name__}: {error}"], "bad"), Evidence(command, summary="command")]
            state = "failed"
            continue
        if found is None:
            blocks += [Paragraph("It takes longer than a report does:", "soft"), Evidence(command, summary="command")]
            continue
        blocks += _shown(name, found, command)
        facts += found.facts
        warnings += found.warnings
    return Content(blocks, "failed" if state == "failed" else "shown", facts, warnings)


def _shown(name: str, found: Worked, command: str) -> list[Block]:
    """The blocks of a study that was worked out."""
    blocks: list[Block] = [Picture(png_of(found.figure), f"study {name}")]
    if found.said:
        blocks.append(Bullets(found.said))
    for k, own in enumerate(found.tables):
        lines = () if own.evidence is None else own.evidence.lines
        evidence = Evidence(command, lines, essential=k == 0)
        blocks.append(Table(own.headings, own.rows, own.numbers, own.caption, evidence))
    if found.warnings:
        blocks.append(Bullets(foremost(found.warnings, MOST_WARNINGS), "warning"))
    return blocks


def _worked(subject: Subject, name: str, study: DescribedStudy) -> Worked | None:
    """A study worked out, None where that takes long. Raises FlexuraError."""
    plan, own = subject.plan, study.own
    required = described_relations(plan).values()
    if plan.topology.n_dof > LARGE or not _is_small(plan, own, list(required)):
        return None
    if isinstance(own, OptimumStudy):
        best = optimize(plan, subject.parameters, study=name)
        assert isinstance(best, Optimum)
        return _optimum(best)
    verb, told = _VERBS[type(own)]
    return told(verb(plan, subject.parameters, study=name, workers=1))


def _is_small(plan: Plan, own: SweepStudy | OptimumStudy | ToleranceStudy, required: Sequence[Relation]) -> bool:
    """Whether a study, with what is required beside it, takes little time. Raises OptionError for what cannot be
    asked."""
    if isinstance(own, OptimumStudy):
        texts = [own.maximise or own.minimise or ""]
        limits = [*(relation(plan, text) for text in own.subject_to), *required]
        sides = [side for limit in limits for side in (limit.left, limit.right)]
        if own.goals or own.starts > STARTS or len(own.vary) > VARIABLES:
            return False
        kinds = {asked.kind for part in (formula(plan, texts[0]), *sides) for asked in part.quantities}
        return all(isinstance(v, Range) and not v.integer for v in own.vary.values()) and not kinds & set(SLOW)
    asked = questions(plan, list(own.ask)) if own.ask else None
    others = [relation(plan, text).questions for text in own.require] if isinstance(own, ToleranceStudy) else []
    others += [each.questions for each in required]
    is_stacked = all(each.is_stacked for each in (asked, *others) if each is not None)
    return _designs(own) <= (TOGETHER if is_stacked else ALONE)


def _designs(own: SweepStudy | ToleranceStudy) -> float:
    """About how many designs a study has, infinitely many of integers without steps."""
    if isinstance(own, ToleranceStudy):
        return own.samples * (len(own.vary) + 2)
    counts = [len(v) if not isinstance(v, Range) else v.steps or float("inf") for v in own.vary.values()]
    if own.samples is not None:
        return own.samples
    return max(counts) if own.sampling == "list" else prod(counts)


def _optimum(found: Optimum) -> Worked:
    word = "optimum" if found.is_feasible else "nearest"
    rows = [
        [own.name, *(quantity(value, own.unit, 6) for value in (own.start, own.value)), own.at_bound]
        for own in found.variables
    ]
    lines = [("conditions of an optimum", f"hold to {found.kkt_residual:.1g} of the gradient")]
    lines += [("note", note) for note in found.notes]
    proofs = [[own.text, quantity(own.checked, own.unit, 6), own.by] for own in found.proof]
    tables = [
        Table(["parameter", "before", word, "at its bound"], rows, (1, 2), "parameters", Evidence("", lines)),
        Table(["quantity", "worked out anew", "by"], proofs, (1,), f"at the {word}"),
    ]
    said = [str(own) for own in (*found.violations, *found.active)]
    facts = [Fact(found.goal, quantity(found.value, found.unit, 6))] if found.is_feasible else []
    return Worked(tables, said, draw_optimum(found), facts, found.warnings)


def _sweep(found: StudyTable) -> Worked:
    rows = [[name, low, str(first), high, str(last)] for name, low, first, high, last in found.extremes()]
    lines = [("designs", f"{found.done}, {found.failed} without an answer"), *(("note", note) for note in found.notes)]
    headings = ["quantity", "lowest", "in design", "highest", "in design"]
    table = Table(headings, rows, (1, 2, 3, 4), f"of {found.done} designs", Evidence("", lines))
    return Worked([table], [], draw_sweep(found), [], found.warnings)


def _tolerance(found: Tolerance) -> Worked:
    rows = [
        [
            own.text,
            *(quantity(value, own.unit) for value in (own.nominal, own.mean.value)),
            quantity(own.deviation, own.unit, 3),
            *(quantity(end.value, own.unit) for end in (own.worst_low, own.worst_high)),
            found.tighten_first[own.text] or "",
        ]
        for own in found.quantities
    ]
    headings = [
        "quantity",
        "nominal",
        "mean",
        "standard deviation",
        "worst case, low",
        "worst case, high",
        "tighten first",
    ]
    lines = [("samples", f"{found.samples} of {len(found.sizes)} independent sizes")]
    lines += [("note", note) for note in found.notes]
    table = Table(headings, rows, range(1, 6), "spreads", Evidence("", lines))
    said = [
        f"{own.text}: {percent(own.share.value, 4)} of parts ({percent(own.share.low, 4)} to"
        f" {percent(own.share.high, 4)}, at {100 * found.confidence:g} %)"
        for own in found.yields
    ]
    facts = [Fact(own.text, f"{percent(own.share.value, 4)} of parts") for own in found.yields]
    return Worked([table], said, draw_tolerance(found), facts, found.warnings)


_VERBS: dict[type, tuple[Callable[..., object], Callable[..., Worked]]] = {
    SweepStudy: (sweep, _sweep),
    ToleranceStudy: (tolerance, _tolerance),
}


QUICK = 1_000_000
"""Samples in time of all hits up to which a test is simulated for a report."""
HEADINGS = {
    "solid frequency [Hz]": "solid Hz",
    "frequency [Hz]": "beams Hz",
    "relative error": "relative difference",
    "mac": "MAC",
}
"""Columns of a verification, in words."""


def against_the_solid(subject: Subject) -> Content:
    """Beam models beside solid finite elements, where that is asked for. Raises FlexuraError."""
    options = ["-n", str(subject.n)]
    command = subject.commands("verify", options, f"n={subject.n}", posed=False)
    if not subject.solid:
        text = (
            "The validity of beams on this mechanism is not in this report: solid finite elements take seconds"
            " to minutes. --solid puts them in; alone they are:"
        )
        return Content.absent(text, command)
    found = verify(subject.mechanism, dict(subject.parameters), n=subject.n)
    columns = found.to_columns()
    rows = [[_cell(columns[name][k]) for name in columns] for k in range(len(next(iter(columns.values()), ())))]
    numbers = [k for k, name in enumerate(columns) if name not in ("model", "pair", "what moves")]
    lines = [("note", note) for note in found.notes]
    headings = [HEADINGS.get(name, name) for name in columns]
    made: list[Block] = [Table(headings, rows, numbers, evidence=Evidence(f"{command} --json", lines, essential=True))]
    made += warned(found.warnings)
    return Content(made, warnings=found.warnings)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else number(value)
    return "" if value is None else str(value)


def tested(subject: Subject) -> Content:
    """The described hammer test, simulated and identified, where it is quick. Raises FlexuraError."""
    test = subject.mechanism.test
    if test is None:
        text = (
            "The file describes no test (`test:`), so none is simulated; `flexura calibrate` fits parameters to"
            " measured frequencies."
        )
        return Content.absent(text)
    command = subject.commands("virtual-test", posed=False)
    samples = subject.samples
    if samples > QUICK:
        text = f"The test has {samples:.3g} samples, too many to simulate for a report; by itself it is:"
        return Content.absent(text, command)
    found = virtual_test(subject.mechanism, dict(subject.parameters))
    headings = [
        "mode",
        "no sensors Hz",
        "sensors on Hz",
        "mass effect",
        "identified Hz",
        "rad/s",
        "off",
        "damping %",
        "off",
        "MAC",
        "confidence",
    ]
    rows = [
        [str(m.number), number(m.bare_hz), number(m.mass_loaded_hz), f"{100 * m.mass_effect:+.2f} %", *_identified(m)]
        for m in found.modes
    ]
    hits, placements = len(found.measurement.recordings), len(list(found.test.placed()))
    lines = [("records", f"{hits} hits, {placements} placements, noise with seed {found.seed}")]
    lines += [("note", note) for note in dict.fromkeys(found.notes)]
    blocks: list[Block] = [
        Paragraph(
            "Simulated with the noise that the file describes, then identified as a measurement would be; nothing here"
            " was measured."
        ),
        Table(headings, rows, range(11), evidence=Evidence(command, lines, essential=True)),
    ]
    if found.false_hz:
        listed = ", ".join(quantity(f, "Hz") for f in found.false_hz)
        blocks.append(Paragraph(f"Identified where there is no mode: {listed}", "warning"))
    missed = sum(m.identified_hz is None for m in found.modes)
    facts = [Fact("modes that the test would find", f"{len(found.modes) - missed} of {len(found.modes)}")]
    return Content(blocks, facts=facts, warnings=found.warnings)


def _identified(mode: FoundMode) -> list[str]:
    if mode.identified_hz is None or mode.identified_damping is None or mode.mac is None or mode.confidence is None:
        return ["missed", "", "", f"({100 * mode.damping_ratio:.3g})", "", "", ""]
    hz = mode.identified_hz
    errors = [f"{100 * (mode.error or 0.0):+.3f} %", f"{100 * mode.identified_damping:.3f}"]
    errors.append("" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %")
    return [number(hz), number(2 * math.pi * hz), *errors, f"{mode.mac:.3f}", f"{mode.confidence:.2f}"]
