"""What candidates are made and proven by: a STEP file, a DXF file where all is cut along one line, and the part itself
as one solid beside the winner."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexura.analysis import modes
from flexura.deadline import Listener, Progress, time_limit
from flexura.errors import FlexuraError
from flexura.fem import as_beams, cut_profile
from flexura.files import read_bytes, write_file
from flexura.full_order import assemble
from flexura.mechanism import Mechanism, with_rigid_bodies, without_fillets
from flexura.modelfile import load
from flexura.outlines import write_dxf
from flexura.solid.interchange import write_step
from flexura.solid.verification import verify
from flexura.synthesis.posts import BELOW
from flexura.synthesis.result import Candidate, Candidates, WholeCandidate, WholeCandidateMode

MADE = 10
"""Candidates of which there are files for making them."""

WHOLE_SECONDS = 900.0
"""Seconds for the winner as one solid."""

WHOLE_MODES = 6
"""Modes of it."""


@dataclass
class Making:
    """What is known of candidates, by their files and what is in these, in a file of the folder."""

    folder: Path

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / "made.json"

    def known(self) -> dict[str, Any]:
        """All of it; nothing where the file is missing or damaged."""
        try:
            return dict(json.loads(self.path.read_text(encoding="utf-8")))
        except (OSError, ValueError):
            return {}

    def of(self, kind: str, own: Candidate, make: Callable[[], Any], files: Callable[[Any], list[str]]) -> Any:
        """What is known of a candidate, or is made now and kept; anew where one of its files is gone."""
        known, digest = self.known(), hashlib.sha256(read_bytes(self.folder / own.file)).hexdigest()
        key = f"{own.file} {kind}"
        there = known.get(key, {})
        if there.get("sha256") != digest or not all((self.folder / name).exists() for name in files(there["is"])):
            known[key] = {"sha256": digest, "is": make()}
            text = json.dumps(known, indent=1) + "\n"
            write_file(self.path, lambda to: to.write_text(text, encoding="utf-8"))
        return known[key]["is"]


def made(found: Candidates, folder: Path, whole: bool, report: Listener) -> Iterator[Candidates]:
    """Candidates with the files for making the first ten, and then with the winner verified `whole`. What is in the
    folder already is not made again where a candidate's file is the same. Raises what `load` does."""
    kept = Making(folder)
    first = found.candidates[:MADE]
    candidates = []
    for k, own in enumerate(first):
        report(Progress("files for making the best", k, len(first)))
        files, without = kept.of("files", own, lambda own=own: _files(own, folder), lambda known: known[0])
        candidates.append(replace(own, made=tuple(files), not_made=tuple(without)))
    found = replace(found, candidates=(*candidates, *found.candidates[len(first) :]))
    yield found
    if whole and first:

        def solve() -> dict[str, Any]:
            report(Progress("the winner as one solid, which may take minutes"))
            return _whole(load(folder / first[0].file))

        outcome = kept.of("whole", first[0], solve, lambda _: [])
        told = tuple(WholeCandidateMode(**own) for own in outcome["modes"])
        whole_one = WholeCandidate(first[0].file, told, outcome["seconds"], tuple(outcome["notes"]))
        yield replace(found, whole=whole_one)


def _files(own: Candidate, folder: Path) -> tuple[list[str], list[str]]:
    """Names of the files that were written, and why others were not."""
    plain = as_beams(load(folder / own.file), "auto")
    stem, files, without = Path(own.file).stem, list[str](), list[str]()

    def step(path: Path) -> None:
        write_step(assemble(plain), path)

    def dxf(path: Path) -> None:
        write_dxf(cut_profile(assemble(with_rigid_bodies(plain)), lambda name: name.endswith(BELOW)), path)

    for suffix, write in ((".step", step), (".dxf", dxf)):
        try:
            write(folder / f"{stem}{suffix}")
            files.append(f"{stem}{suffix}")
        except FlexuraError as error:
            (folder / f"{stem}{suffix}").unlink(missing_ok=True)
            without.append(f"no {suffix[1:].upper()}: {' '.join(str(error).split())}")
    return files, without


def _whole(mechanism: Mechanism) -> dict[str, Any]:
    """The modes of a mechanism beside those of its part as one solid, and whether these lie within the model error; or
    why there is none."""
    try:
        with time_limit(WHOLE_SECONDS):
            found = verify(mechanism, whole=True, n=WHOLE_MODES)
            stated = modes(without_fillets(mechanism), n=WHOLE_MODES + 2)  # as the solid is
    except FlexuraError as error:
        return {"modes": [], "seconds": 0.0, "notes": [f"not verified whole: {' '.join(str(error).split())}"]}
    rows = []
    for own in found.modes:
        row: dict[str, Any] = {"frequency_hz": own.frequency_hz, "described_hz": own.described_hz}
        row |= {"difference": own.difference, "low": None, "high": None, "is_within": None}
        if own.described_hz is not None:
            k = int(abs(stated.frequency_hz - own.described_hz).argmin())
            if (error := stated.model_error[k]) is not None:
                low, high = error
                off = own.frequency_hz / own.described_hz - 1
                row |= {"low": low, "high": high}
                row["is_within"] = bool(low - own.uncertainty <= off <= high + own.uncertainty)
        rows.append(row)
    return {"modes": rows, "seconds": found.seconds, "notes": list(found.notes)}
