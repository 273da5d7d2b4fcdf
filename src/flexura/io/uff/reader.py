"""Measurements out of universal files: time records, frequency responses with coherence, and modes."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.io.uff.datasets import (
    AXIS_NAMES,
    FREQUENCY_AXIS,
    MOTIONS,
    NOTHING,
    TIME_AXIS,
    TURNING,
    NodeFrames,
    abscissa,
    channel_of,
    data_of,
    direction_of,
    exact_of,
    frequency_unit,
    geometry_of,
    rate_of,
    read_sets,
    response_of,
    traces_of,
)
from flexura.testing.measurement import (
    FORCES,
    ChannelDescriptions,
    IdentifiedModes,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    ModeEvidence,
    Recording,
    Repeated,
    grouped,
    merged,
    repeated_note,
)

TIME, SPECTRUM, CROSS, RESPONSE, COHERENCE = 1, 2, 3, 4, 6


def read_uff(
    path: Path, descriptions: ChannelDescriptions | None = None, repeated: Repeated | None = None
) -> Measurement:
    """Read a universal file (58, 58b, 55, with 15, 2411, 82, 18, 2420 and 164).

    A time record begins where a channel comes for the second time, and forces are its inputs. Responses are collected
    into one matrix per setup and set of frequencies; those between the same channels are merged as `repeated` says.
    Units of `descriptions` count before those of the file. Datasets of other functions are left out, and named in
    notes.

    Raises OptionError without pyuff, for files, units and sampling that cannot be used, and for responses that are
    given more than once, unless `repeated` says what to make of them.
    """
    sets = read_sets(path)
    descriptions = descriptions or {}
    geometry = geometry_of(sets)
    functions = [(k, s) for k, s in enumerate(sets) if s["type"] == 58]
    left_out: dict[int, int] = {}
    records: list[_Row] = []
    pairs: list[_Pair] = []
    coherences: dict[tuple[Any, ...], list[Array]] = {}
    over: Counter[str] = Counter()
    assumed = 0
    for k, s in functions:
        where = f"{path}: dataset {k + 1}"
        kind = _kind(s)
        if kind not in (TIME, RESPONSE, COHERENCE):
            left_out[kind] = left_out.get(kind, 0) + 1
            continue
        data, exact = data_of(s, where, kind == TIME), exact_of(s)
        if kind == COHERENCE:
            coherences.setdefault(_codes(s), []).append(np.real(data))
            continue
        if kind == TIME:
            out, factor, known = channel_of(s, geometry, where, descriptions)
            assumed += not known
            records.append(_Row(out, factor * np.real(data), rate_of(s, where, exact), exact))
            continue
        out, into, factor, known = response_of(s, geometry, where, descriptions)
        assumed += not known
        hz = abscissa(s, exact, where)[: len(data)]
        H: Any = factor * np.asarray(data, dtype=complex)
        if "df" not in exact:
            over[frequency_unit(s, where)[0]] += 1
        pairs.append(_Pair(out, into, hz, H, exact, _codes(s), k + 1))
    if repeated is None or repeated == "average":  # the coherence of a mean is not known
        once = {key: gammas[0] for key, gammas in coherences.items() if len(gammas) == 1}
    else:
        once = {key: merged(gammas, repeated) for key, gammas in coherences.items()}
    notes = [f"{n} datasets of function type {kind} left out" for kind, n in left_out.items()]
    if assumed:
        notes.append(f"{assumed} datasets give no unit: taken as SI")
    notes += [f"frequencies of {n} datasets are in {u}: read as Hz" for u, n in over.items() if u.lower() != "hz"]
    notes += _channel_notes(pairs, records, len(coherences) - len(once), once)
    responses, again = _responses(pairs, once, path, repeated)
    notes += [repeated_note(again, repeated)] if again and repeated else []
    modes, traces = _modes([s for s in sets if s["type"] == 55], geometry, path), traces_of(sets, geometry)
    measurement = Measurement(
        _title(sets, path),
        tuple(_recordings(records, path)),
        tuple(responses),
        tuple(notes),
        None if modes is None else replace(modes, traces=traces),
        traces,
    )
    if not (measurement.recordings or measurement.frfs or measurement.modes):
        _refuse_empty(sets, left_out, path)
    return measurement


def _refuse_empty(sets: list[dict[str, Any]], left_out: dict[int, int], path: Path) -> NoReturn:
    """Raise OptionError with what there is in place of records, responses or modes."""
    if set(left_out) & {SPECTRUM, CROSS}:
        raise OptionError(
            f"{path}: spectra of outputs only (function types {', '.join(map(str, left_out))}), without a response to a"
            " force: modes take frequency responses, or records with a force; what was found elsewhere of such data can"
            " be compared as a list of frequencies"
        )
    kinds = sorted({str(s["type"]) for s in sets})
    raise OptionError(f"{path}: no time records, frequency responses or modes; datasets of type {', '.join(kinds)}")


@dataclass(frozen=True)
class _Row:
    """One channel of a time record, with what its dataset says exactly in ID lines."""

    channel: MeasuredChannel
    x: Array
    rate: float
    exact: dict[str, str]

    @property
    def hit(self) -> tuple[str, str]:
        """Names of its record and setup."""
        return self.exact.get("record", ""), self.exact.get("setup", "")

    @property
    def is_input(self) -> bool:
        """Whether it excites: as its dataset says, else if it is a force."""
        return self.exact["role"] == "input" if "role" in self.exact else self.channel.quantity in FORCES


@dataclass(frozen=True)
class _Pair:
    """A frequency response between two channels; `codes` are those of its datasets, `number` counts it."""

    out: MeasuredChannel
    into: MeasuredChannel
    hz: Array
    H: Complex
    exact: dict[str, str]
    codes: tuple[Any, ...]
    number: int

    @property
    def setup(self) -> str:
        """The setup that its dataset names."""
        return self.exact.get("setup", "")

    @property
    def estimator(self) -> str:
        """H1, H2 or Hv, where its dataset says so."""
        return self.exact.get("by", "")

    @property
    def averages(self) -> int | None:
        """Records that it is from, where its dataset says so."""
        return int(self.exact["n"]) if "n" in self.exact else None

    @property
    def decay(self) -> float:
        """Decay rate, 1/s, that a window has added."""
        return float(self.exact.get("decay", 0.0))

    @property
    def group(self) -> tuple[Any, ...]:
        """What the responses of one matrix have in common."""
        return self.setup, len(self.hz), float(self.hz[0]), float(self.hz[-1]), self.estimator, self.decay


def _channel_notes(
    pairs: list[_Pair], records: list[_Row], twice: int, coherences: dict[tuple[Any, ...], Array]
) -> list[str]:
    """Notes on channels without direction, and on coherences that cannot be used."""
    notes = []
    channels = [c for p in pairs for c in (p.out, p.into)] + [r.channel for r in records]
    scalars = dict.fromkeys(c.name for c in channels if c.direction is None)
    if scalars:
        notes.append(f"scalar channels, of which no direction is known: {', '.join(scalars)}")
    if twice:
        notes.append(f"coherences of {twice} responses are given more than once: left out")
    known = sum(p.codes in coherences for p in pairs)
    if 0 < known < len(pairs):
        notes.append(f"{known} of {len(pairs)} responses have a coherence: used where all of a matrix have one")
    return notes


def _codes(s: dict[str, Any]) -> tuple[Any, ...]:
    """Setup, length and channels of a response and of its coherence."""
    ends = tuple(s[f"{w}_{what}"] for w in ("rsp", "ref") for what in ("ent_name", "node", "dir"))
    return exact_of(s).get("setup", ""), int(s["num_pts"]), *ends


def _kind(s: dict[str, Any]) -> int:
    kind = int(s["func_type"])
    if kind == 0 and int(s["abscissa_spec_data_type"]) == TIME_AXIS:
        return TIME
    if kind == 0 and int(s["abscissa_spec_data_type"]) == FREQUENCY_AXIS and np.iscomplexobj(s["data"]):
        return RESPONSE
    return kind


def _title(sets: list[dict[str, Any]], path: Path) -> str:
    for s in sets:
        name = str(s.get("model_name" if s["type"] == 151 else "id1" if s["type"] == 58 else "", "")).strip()
        if name.upper() not in NOTHING and s["type"] == 151:
            return name
    return path.stem


def _recordings(rows: list[_Row], path: Path) -> list[Recording]:
    groups: list[list[_Row]] = []
    for row in rows:
        last = groups[-1] if groups else []
        again = any(r.channel == row.channel for r in last)
        if not last or again or last[0].hit != row.hit:
            groups.append([])
        groups[-1].append(row)
    recordings = []
    for k, group in enumerate(groups):
        rates, lengths = {r.rate for r in group}, {len(r.x) for r in group}
        record, setup = group[0].hit
        title = record or f"record {k + 1}"
        if len(rates) > 1 or len(lengths) > 1:
            listed = ", ".join(f"{r.channel.name}: {len(r.x)} at {r.rate:g} Hz" for r in group)
            raise OptionError(f"{path}: {title}: channels are sampled unequally ({listed}): resample them to one rate")
        inputs = tuple(i for i, r in enumerate(group) if r.is_input)
        x = np.array([r.x for r in group])
        channels = tuple(r.channel for r in group)
        recordings.append(Recording(group[0].rate, x, channels, inputs, setup, title))
    return recordings


def _responses(
    pairs: list[_Pair], coherences: dict[tuple[Any, ...], Array], path: Path, repeated: Repeated | None
) -> tuple[list[MeasuredFRF], list[tuple[str, int]]]:
    """One response per setup and frequencies; one per input where some pairs are missing. Second, the pairs that are
    merged, by name, and how often each is there.

    Raises OptionError for a pair that is there twice where nothing says how to merge it.
    """
    matrices, again = [], []
    for group in grouped(pairs, lambda p: p.group).values():
        table: dict[tuple[MeasuredChannel, MeasuredChannel], _Pair] = {}
        for ends, same in grouped(group, lambda p: (p.out, p.into)).items():
            if len(same) > 1 and repeated is None:
                _refuse_again(same[0], same[1], path)
            table[ends] = same[0] if repeated is None else replace(same[0], H=merged([p.H for p in same], repeated))
            again += [(f"{same[0].out.name} / {same[0].into.name}", len(same))] if len(same) > 1 else []
        by_outputs: dict[tuple[MeasuredChannel, ...], list[MeasuredChannel]] = {}
        for into in dict.fromkeys(p.into for p in group):
            outs = tuple(dict.fromkeys(p.out for p in group if p.into == into))
            by_outputs.setdefault(tuple(sorted(outs, key=lambda c: c.name)), []).append(into)
        for outs_sorted, ins in by_outputs.items():
            outs = [o for o in dict.fromkeys(p.out for p in group) if o in outs_sorted]
            H = np.stack([np.stack([table[o, i].H for i in ins], axis=1) for o in outs], axis=1)
            gamma = None
            if all(table[o, i].codes in coherences for o in outs for i in ins):
                rows = [np.stack([coherences[table[o, i].codes] for i in ins], axis=1) for o in outs]
                gamma = np.stack(rows, axis=1)
            lead = group[0]
            matrices.append(
                MeasuredFRF(
                    lead.hz, H, tuple(ins), tuple(outs), gamma, lead.averages, lead.estimator, lead.decay, lead.setup
                )
            )
    return matrices, again


def _refuse_again(first: _Pair, again: _Pair, path: Path) -> NoReturn:
    """Raise OptionError for two responses between the same channels."""
    hint = (
        "repeated='average' (--repeated average), 'first' or 'last' merges them; write placements of the sensors to a"
        " file each"
    )
    if first.out.direction is None or first.into.direction is None:
        hint = "without nodes and directions in the file, channels cannot be distinguished"
    raise OptionError(
        f"{path}: the response {first.out.name} / {first.into.name} is given more than once, in datasets {first.number}"
        f" and {again.number}: {hint}"
    )


def _modes(sets: list[dict[str, Any]], geometry: NodeFrames, path: Path) -> IdentifiedModes | None:
    """Normal and complex modes of datasets 55; shapes of unit modal mass where that is given."""
    usable = [s for s in sets if s.get("analysis_type") in (2, 3, 7)]
    if not usable:
        return None
    numbers = [int(n) for n in usable[0]["node_nums"]]
    keys = [f"r{i}" for i in range(1, 7) if all(f"r{i}" in s for s in usable)]
    if any([int(n) for n in s["node_nums"]] != numbers for s in usable):
        raise OptionError(f"{path}: modes (datasets 55) are at different nodes: write a file for each set of nodes")
    poles, shapes = [], []
    for s in usable:
        pole = _pole(s)
        motion = {11: 1, 12: 2}.get(int(s["spec_data_type"]), 0)
        if not np.isfinite(pole) or (motion and pole == 0):
            raise OptionError(f"{path}: a mode (dataset 55) has no frequency: {pole:g}")
        shape = np.stack([np.asarray(s[key], dtype=complex) for key in keys], axis=1).ravel() / pole**motion
        mass = float(s.get("modal_m", 0.0)) if s["analysis_type"] == 2 else 0.0
        poles.append(pole)
        shapes.append(shape / np.sqrt(mass) if mass > 0 else shape)
    order = np.argsort(np.abs(poles))
    phi = np.array(shapes)[order].T
    if not np.isfinite(phi).all():
        raise OptionError(f"{path}: shapes of modes (datasets 55) with numbers that are not finite")
    channels = [
        MeasuredChannel(
            f"{number}.{AXIS_NAMES[i]}",
            MOTIONS[8] if i < 3 else TURNING[MOTIONS[8]],
            str(number),
            direction_of(i + 1, number, geometry),
            geometry.positions.get(number),
        )
        for number in numbers
        for i in range(len(keys))
    ]
    moves = np.abs(phi).max(axis=1) > 0
    phase = np.angle(np.sum(phi**2, axis=0)) / 2
    nan = float("nan")
    unknown = ModeEvidence(
        confidence=nan,
        frequency_scatter=nan,
        damping_scatter=nan,
        modal_phase_collinearity=nan,
        mean_phase_deviation_deg=nan,
    )
    return IdentifiedModes(
        path.stem,
        np.array(poles)[order],
        phi[moves],
        np.real(phi * np.exp(-1j * phase))[moves],
        np.zeros((0, len(poles)), dtype=complex),
        (),
        tuple(c for c, m in zip(channels, moves, strict=True) if m),
        (unknown,) * len(poles),
        (),
        nan,
        (f"modes read from {path.name}: how they were identified is not known",),
    )


def _pole(s: dict[str, Any]) -> complex:
    if s["analysis_type"] != 2:
        pole = complex(s["eig"])
        return pole if pole.imag >= 0 else pole.conjugate()
    omega = 2 * np.pi * float(s["freq"])
    ratio = float(s["modal_damp_vis"]) or float(s["modal_damp_his"]) / 2
    return complex(-ratio * omega, omega * np.sqrt(max(1 - ratio**2, 0.0)))
