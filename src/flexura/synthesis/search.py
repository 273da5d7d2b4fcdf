"""From all topologies of a wish to a few mechanisms: sizes sampled at rest, the best led through their strokes, and
the best of these optimised."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from itertools import product, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexura._version import __version__
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, Progress, no_listener
from flexura.errors import OptionError
from flexura.files import write_file
from flexura.full_order import plan_of
from flexura.modelfile import read_as, save, text_of
from flexura.study.engine import Blocks, blocks_of
from flexura.study.requirements import described_relations
from flexura.synthesis.drafts import draft
from flexura.synthesis.drives import driven
from flexura.synthesis.making import made
from flexura.synthesis.optima import SECONDS, Judged, Optima, judged
from flexura.synthesis.result import Candidate, Candidates, freedoms_in_short
from flexura.synthesis.screening import AtRest, OverStroke
from flexura.synthesis.topologies import topologies, with_stout_posts
from flexura.synthesis.wish import Room, WishFile, room_of, si
from flexura.thresholds import STILL

SAMPLES = 64
"""Designs of each topology at rest."""

LED = 100
"""Designs that are led through their strokes, the best of each topology first."""

FINALISTS = 24
"""Topologies of which the best design is judged, with bodies that bend and model errors."""

FIRST = 3
"""Of these that are shown before the others are known."""

OPTIMISED = 10
"""Of these that are optimised, the best of each set of kinds and numbers of limbs first."""


@verb
def design(
    wish: str | Path,
    *,
    folder: str | Path,
    most: int = 300,
    samples: int = SAMPLES,
    verify: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
    found: Callable[[Candidates], object] | None = None,
) -> Candidates:
    """Mechanisms that do what a wish file asks for, best first, written into a folder as mechanism files.

    All topologies of the grammar are listed, and of the plainest, `most` of them, `samples` designs each worked out at
    rest; the best are led through their strokes, and the best of these optimised. STEP and DXF files are made of the
    first ten, and with `verify` the winner is verified as one solid, which takes a minute or more and some gigabytes.
    What is done of a wish is kept in the folder, and the same call goes on there; `found` is told of the candidates as
    soon as there are some, and whenever one is better. Raises ModelError for what is wrong with the wish, and
    OptionError where nothing is found.
    """
    text = text_of(Path(wish))
    file = read_as(WishFile, text, str(wish))
    report = progress or no_listener
    room = room_of(file.wish)
    _sane(room)
    report(Progress("topologies"))
    listed = topologies(room, file.wish.make.process, si(file.wish.make.thinnest))
    if file.wish.drives is not None and file.wish.drives.is_stacks:
        listed = driven(listed, room, file.wish, si(file.wish.make.thinnest))
    if not listed:
        raise OptionError(_nothing(file, room))
    described_relations(plan_of(draft(listed[0], file, room, file.name)))  # what cannot be asked is told before
    chosen = (with_stout_posts(own, room, si(file.wish.make.thinnest)) for own in listed[:most])
    work = AtRest(file, room, tuple(chosen), samples)
    store = Store(Path(folder), text, samples)
    remarks = list(_notes(len(listed), most))
    run = _Run(store, workers, scheduler, report, remarks)
    at_rest = dict(run.blocks("topologies at rest", work, [f"rest {n}" for n in range(work.blocks)]))
    order = _best_first(at_rest)
    if not order:
        raise OptionError(f"none of the {work.blocks} topologies has a design that can be worked out at rest")
    written = _Written(work, at_rest, len(listed), Path(folder), remarks, found)
    for n in order[:FIRST]:
        written.add(judged(work, n, at_rest[n]["values"][0]))
    result = written.write()
    led = OverStroke(work, tuple(_led(at_rest, order)))
    keys = [f"strokes {n} {_mark(values)}" for n, values in led.chosen]
    strokes = dict(run.blocks("strokes of the best", led, keys))
    best = _best_led(led, strokes)[:FINALISTS]
    for k, (n, values) in enumerate(best):
        report(Progress("the best as a whole", k, len(best)))
        written.add(judged(work, n, values))
    result = written.write()
    optima = Optima(work, tuple(written.various()[:OPTIMISED]))
    for k, columns in run.blocks("optima of the best", optima, [f"optimum {own.key}" for own in optima.begun]):
        own = optima.begun[k]
        if not len(columns["values"]):
            remarks.append(f"{own.candidate.topology}: no search leads to a design that is better than the best sample")
            continue
        if not columns["ended"]:
            remarks.append(f"{own.candidate.topology}: the search for an optimum ended after {SECONDS:g} s, unfinished")
        if written.add(judged(work, own.number, columns["values"])):
            result = written.write()
    if tuple(remarks) != result.notes:
        result = written.write()
    for with_files in made(result, Path(folder), verify, report):
        written.keep(result := with_files)
    return result


class _Run(NamedTuple):
    """How blocks are worked out: what is known is taken from the store, and all else by workers."""

    store: Store
    workers: int | None
    scheduler: str | None
    report: Listener
    remarks: list[str]

    def blocks(self, words: str, work: Blocks, keys: Sequence[str]) -> Iterator[tuple[int, dict[str, Array]]]:
        """What all blocks come to, by number, as soon as they are done; `keys` are their names in the store."""
        known = self.store.known
        left = [n for n, key in enumerate(keys) if key not in known]
        yield from ((n, known[key]) for n, key in enumerate(keys) if key in known)
        self.report(Progress(words, work.blocks - len(left), work.blocks))
        if not left:
            return
        with closing(blocks_of(work, iter(left), self.workers, self.scheduler, self.remarks.append)) as blocks:
            for done, (number, columns) in enumerate(blocks, work.blocks - len(left) + 1):
                self.store.add(keys[number], columns)
                self.report(Progress(words, done, work.blocks))
                yield number, columns


def _best_first(at_rest: dict[int, dict[str, Array]]) -> list[int]:
    """Topologies by the scores of their best designs."""
    scores = {n: float(own["score"][0]) for n, own in at_rest.items() if np.isfinite(own["score"][0])}
    return sorted(scores, key=lambda n: (-scores[n], n))


def _led(at_rest: dict[int, dict[str, Array]], order: Sequence[int]) -> Iterator[tuple[int, Array]]:
    """The designs that are led through their strokes: the best of each topology, then the second ones, and so on."""
    designs = ([(n, k) for k in np.flatnonzero(np.isfinite(at_rest[n]["score"]))] for n in order)
    chosen = [own for turn in zip_longest(*designs) for own in turn if own is not None][:LED]
    for n in order:
        places = [k for number, k in chosen if number == n]
        if places:
            yield n, at_rest[n]["values"][places]


def _best_led(led: OverStroke, strokes: dict[int, dict[str, Array]]) -> list[tuple[int, Array]]:
    """Topologies with their best designs: first those of which solids are clear of each other, by least margins."""
    found = []
    for k, own in strokes.items():
        score = 1e3 * own["clear"] + np.clip(np.nan_to_num(own["margin"], nan=-10.0), -10.0, 10.0)
        best, (number, values) = int(np.argmax(score)), led.chosen[k]
        found.append((-score[best], number, values[best]))
    return [(number, values) for _, number, values in sorted(found, key=lambda own: own[:2])]


def _mark(values: Array) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()[:16]


@dataclass
class _Written:
    """What is found so far, and how it is written: the best design of each topology."""

    work: AtRest
    at_rest: dict[int, dict[str, Array]]
    n_topologies: int
    folder: Path
    remarks: list[str]
    found: Callable[[Candidates], object] | None

    def __post_init__(self) -> None:
        self.best: dict[int, Judged] = {}

    def add(self, own: Judged) -> bool:
        """A design; whether it is better than that of the same topology."""
        known = self.best.get(own.number)
        if known is not None and known.rank <= own.rank:
            return False
        self.best[own.number] = own
        return True

    @property
    def ranked(self) -> list[Judged]:
        """Best first."""
        return sorted(self.best.values(), key=lambda own: own.rank)

    def various(self) -> list[Judged]:
        """The best of each set of kinds and numbers of limbs, best first, then the second ones, and so on."""
        places: dict[tuple[object, ...], int] = {}
        turns = list[tuple[int, Judged]]()
        for own in self.ranked:
            of = self.work.listed[own.number]
            limbs = (of.drive and of.drive.name, *((p.kind.name, p.count) for p in of.patterns))
            places[limbs] = place = places.get(limbs, 0) + 1
            turns.append((place, own))
        return [own for _, own in sorted(turns, key=lambda turn: turn[0])]

    def write(self) -> Candidates:
        """The candidates, with their files written."""
        work = self.work
        candidates = tuple(_written(own, k, self.folder) for k, own in enumerate(self.ranked))
        result = Candidates(
            name=work.file.name,
            freedoms=freedoms_in_short(work.room.freedoms),
            n_topologies=self.n_topologies,
            n_at_rest=work.blocks,
            n_designs=int(sum(own["count"] for own in self.at_rest.values())),
            candidates=candidates,
            ruled_out=_ruled_out(work, self.at_rest),
            notes=tuple(self.remarks),
        )
        self.keep(result)
        return result

    def keep(self, result: Candidates) -> None:
        """Write the list, and tell of it."""
        text = json.dumps(result.to_dict(), indent=1) + "\n"
        write_file(self.folder / "design.json", lambda to: to.write_text(text, encoding="utf-8"))
        if self.found is not None:
            self.found(result)


def _notes(found: int, most: int) -> tuple[str, ...]:
    told = ["posts stand on the base, which is rigid here; blocks that are drawn below walls may be parts of their own"]
    if found > most:
        told.append(f"{found - most} topologies, those with the most limbs, were listed and not worked out")
    return tuple(told)


class Store:
    """What blocks come to, by their names, in a file that grows line by line."""

    def __init__(self, folder: Path, text: str, samples: int) -> None:
        mark = hashlib.sha256(f"{__version__}\n{samples}\n{text}".encode()).hexdigest()
        self.path: Path = folder / "known.jsonl"
        self.known: dict[str, dict[str, Array]] = {}
        header = json.dumps({"wish": mark})
        try:
            folder.mkdir(parents=True, exist_ok=True)
            text = self.path.read_text(encoding="utf-8", errors="replace") if self.path.exists() else ""
            if not text.endswith("\n"):  # new, or of a last line that was cut off
                with self.path.open("a", encoding="utf-8") as to:
                    to.write("\n" if text else f"{header}\n")
        except OSError as error:
            raise OptionError(f"{folder} cannot be written to: {error.strerror}") from None
        first, *lines = text.splitlines() or [header]
        if first != header:
            raise OptionError(f"{folder} has the designs of another wish; name another folder")
        for line in lines:
            with suppress(ValueError, LookupError, TypeError, AttributeError):  # of a line that is damaged
                own = json.loads(line)
                name = own.pop("name")
                self.known[name] = {column: np.array(values, dtype=float) for column, values in own.items()}

    def add(self, name: str, columns: dict[str, Any]) -> None:
        """Keep what a block came to."""
        self.known[name] = columns
        with self.path.open("a", encoding="utf-8") as file:
            row = {column: values.tolist() for column, values in columns.items()}
            file.write(json.dumps({"name": name, **row}) + "\n")


def _sane(room: Room) -> None:
    """Refuse what contradicts itself."""
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    if (room.outside(room.middle + signs * room.platform) > STILL * room.size).any():
        rule = "wish.platform: it is not within the envelope, which stands on the base"
        raise OptionError(f"{rule}; make it smaller or move it")
    if room.freedoms.dimension == 6:
        raise OptionError("wish.freedoms: all six are free, so that nothing is to be held")


def _nothing(file: WishFile, room: Room) -> str:
    """Why there is no topology, in words."""
    lines = room.wrenches.lines().dimension
    text = f"no topology of the grammar holds this by {file.wish.make.process} limbs"
    if lines < room.wrenches.dimension:
        return (
            f"{text}: lines span {lines} of the {room.wrenches.dimension} constraints, so that wires and leaves alone"
            " cannot, and no guide that fits the envelope can; give it more room, or wish other freedoms"
        )
    return (
        f"{text} in this envelope: give it more room around the platform, or move the platform so that the lines that"
        " are borne meet it; rotations pass through `about`"
    )


def _ruled_out(work: AtRest, at_rest: dict[int, dict[str, Array]]) -> dict[str, int]:
    """How many topologies miss each requirement that is asked at rest, in the best design that was found."""
    counts = dict.fromkeys(["freedoms", *(names := work.required_of(work.listed[0]))], 0)
    for known in at_rest.values():
        counts["freedoms"] += not known["gap"][0] >= work.file.wish.gap
        for name, margin in zip(names, known["margins"][0], strict=True):
            counts[name] += not margin >= 0
    return counts


def _written(own: Judged, number: int, folder: Path) -> Candidate:
    """The candidate with its file written; what was made of another one in its place is gone."""
    name = f"candidate-{number + 1:02d}.yaml"
    path = folder / name
    before = path.read_bytes() if path.exists() else b""
    save(own.mechanism, path)
    if path.read_bytes() != before:
        for suffix in (".step", ".dxf", ".html"):
            path.with_suffix(suffix).unlink(missing_ok=True)
    return replace(own.candidate, file=name)
