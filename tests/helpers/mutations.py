"""Files with something changed: bytes, numbers, words and lines, and the arrays inside archives and HDF5 files."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

import numpy as np

_listed = str.split

NUMBERS = (
    *_listed("0 -0 1 -1 2 3 6 7 255 65536 99999999 2147483648 4294967296 -9223372036854775808 18446744073709551616"),
    *_listed("1e308 1e309 -1e308 1e-308 5e-324 1e400 1e150 1e200 nan -nan inf -inf Infinity True 1/0 0/0 (1 1,5 1_000"),
    *_listed(".1 5. 1e 1e+ 1.2.3 --1 +1 1D3 1.0D+01 2.5p 0x10 \u0661\u0662 1j"),
    *("", " ", "1 2", "1e5 Hz", "1 mm", "1 kg", "30 deg", "1" + 400 * "0"),
)
"""Texts to stand in the place of a number."""

WORDS = (
    *_listed("null ~ true [] {} {a:b} '' \" ' # % &a *a !!int | > << --- x -1 58 NONE file units (((( ) [mm] t/0 pi"),
    *_listed("symmetric array coordinate skew-symmetric complex pattern integer hermitian sqrt(-1) m^1000000 2**16"),
    *("[1, 2]", "{a: b}", "    -1", "1e9999 m", "a" * 70, "x" * 300, "../../etc/passwd", "\x00", "\x1b[31m"),
    *("\u202e", "\u00e9", "\ufeff", "\ud7ff", "\U0001f600"),
)
"""Texts to stand in the place of a word."""

EDGES = (0, 1, 2, *(2**n - k for n in (3, 7, 8, 15, 16, 31, 32, 63, 64) for k in (1, 0)))
"""Whole numbers at the ends of their types."""

_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
_WORD = re.compile(rb"[^\W\d]\w*|[^\s\w]+")

Mutation = Callable[[bytes, Random], bytes]


def mutated(content: bytes, name: str, rng: Random, others: Sequence[bytes] = ()) -> bytes:
    """The content of a file with one to four things changed; `name` says the kind, `others` are spliced in."""
    suffix = name.rpartition(".")[2]
    if suffix in _CONTAINERS and not name.startswith("crash") and rng.random() < 0.6:
        take, make = _CONTAINERS[suffix]
        with warnings.catch_warnings(), np.errstate(all="ignore"):  # of numbers that a type cannot hold
            warnings.simplefilter("ignore")
            content = make(_changed_arrays(take(content), rng), rng)
        if rng.random() < 0.7:
            return content
    is_text = b"\0" not in content[:4096]
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4))):
        if others and rng.random() < 0.05:
            other = rng.choice(others)
            content = content[: rng.randint(0, len(content))] + other[rng.randint(0, len(other)) :]
            continue
        kinds = (*_OF_TEXT, *_OF_TEXT, *_OF_BYTES) if is_text else (*_OF_BYTES, *_OF_BYTES, _number)
        content = rng.choice(kinds)(content, rng)
    return content


def _span(content: bytes, rng: Random, longest: int = 64) -> tuple[int, int]:
    start = rng.randint(0, len(content))
    return start, min(len(content), start + rng.randint(1, longest))


def _flip(content: bytes, rng: Random) -> bytes:
    found = bytearray(content or b"\0")
    for _ in range(rng.choice((1, 1, 2, 8))):
        found[rng.randrange(len(found))] ^= 1 << rng.randrange(8)
    return bytes(found)


def _byte(content: bytes, rng: Random) -> bytes:
    found = bytearray(content or b"\0")
    found[rng.randrange(len(found))] = rng.choice((0, 9, 10, 13, 32, 34, 127, 128, 255, rng.randrange(256)))
    return bytes(found)


def _cut(content: bytes, rng: Random) -> bytes:
    start, stop = _span(content, rng)
    return content[:start] + content[stop:]


def _end(content: bytes, rng: Random) -> bytes:
    return content[: rng.randint(0, len(content))]


def _last(content: bytes, rng: Random) -> bytes:
    """Without what is last: a newline, a digit."""
    return content[: max(0, len(content) - rng.randint(1, 4))]


def _double(content: bytes, rng: Random) -> bytes:
    start, stop = _span(content, rng)
    return content[:stop] + content[start:stop] * rng.choice((1, 1, 3, 100)) + content[stop:]


def _whole_number(content: bytes, rng: Random) -> bytes:
    """A binary number of 1 to 8 bytes somewhere is one at an edge."""
    size, order = rng.choice((1, 2, 4, 8)), rng.choice(("little", "big"))
    at = rng.randint(0, max(0, len(content) - size))
    new = (rng.choice(EDGES) % 2 ** (8 * size)).to_bytes(size, order)  # pyright: ignore[reportArgumentType]
    return content[:at] + new + content[at + size :]


def _put(content: bytes, match: re.Match[bytes], text: str) -> bytes:
    return content[: match.start()] + text.encode("utf-8", "surrogatepass") + content[match.end() :]


def _number(content: bytes, rng: Random) -> bytes:
    found = list(_NUMBER.finditer(content[: 1 << 16]))
    return _put(content, rng.choice(found), rng.choice(NUMBERS)) if found else _byte(content, rng)


def _word(content: bytes, rng: Random) -> bytes:
    found = list(_WORD.finditer(content[: 1 << 16]))
    if not found:
        return _byte(content, rng)
    own = rng.choice(found)[0].decode("utf-8", "replace")
    return _put(content, rng.choice(found), rng.choice((rng.choice(WORDS), own)))


def _number_suffix(content: bytes, rng: Random) -> bytes:
    found = list(_NUMBER.finditer(content[: 1 << 16]))
    if not found:
        return _byte(content, rng)
    match = rng.choice(found)
    behind = rng.choice((b"p", b"D3", b"e", b"x", b".", b"-", b"\0", b","))
    return content[: match.end()] + behind + content[match.end() :]


def _line(content: bytes, rng: Random) -> bytes:
    """A line is gone, twice there, moved, empty, or cut short."""
    lines = content.splitlines(keepends=True) or [b""]
    k = rng.randrange(len(lines))
    match rng.randrange(5):
        case 0:
            del lines[k]
        case 1:
            lines.insert(k, lines[k] * rng.choice((1, 1, 50)))
        case 2:
            lines.insert(rng.randrange(len(lines)), lines.pop(k))
        case 3:
            lines[k] = b"\n"
        case _:
            lines[k] = lines[k][: rng.randint(0, len(lines[k]))]
    return b"".join(lines)


_OF_BYTES: tuple[Mutation, ...] = (_flip, _byte, _cut, _end, _double, _whole_number, _last)
_OF_TEXT: tuple[Mutation, ...] = (_number, _number, _number_suffix, _word, _word, _line, _line)


def _changed_arrays(arrays: dict[str, Any], rng: Random) -> dict[str, Any]:
    """One or two arrays gone, called otherwise, or of another shape, type or content."""
    found = dict(arrays)
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(list(found) or ["samples"])
        own = np.asarray(found.pop(name, np.zeros(3)))
        if rng.random() < 0.85:
            others = rng.choice(list(found) or [name]), f"{name}/x", "frf0.response"
            called = rng.choice((name, name, name, name, *others))
            found[called] = _array(own, rng)
    return found


def _array(own: Any, rng: Random) -> Any:
    edges = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e308, 1e-308, 5e-324, 1e100, 2.0**63)
    flat = own.ravel()
    match rng.randrange(11):
        case 0:
            return own[..., : max(0, own.shape[-1] - 1)] if own.ndim else np.atleast_1d(own)
        case 1:
            return own[None]
        case 2:
            return flat
        case 3:
            return own.T
        case 4:
            return np.zeros((0,) * rng.randint(1, 3))
        case 5:
            return np.array(rng.choice(WORDS)) if rng.random() < 0.5 else np.array([rng.choice(WORDS)] * len(flat))
        case 6:
            kind = rng.choice(("f4", ">f8", "i1", "u8", "c16", "?", "S3", "U5", "i8", "f2", "M8[s]", "m8[ns]"))
            try:
                return own.astype(kind)
            except (TypeError, ValueError, OverflowError):
                return np.zeros(own.shape, dtype=kind)
        case 7:
            return np.array([(1, 2.0)], dtype=[("a", "i4"), ("b", "f8")])
        case 8:
            return np.concatenate([flat, flat])
        case _:
            kind = own.dtype if own.dtype.kind in "fc" else np.dtype(float)
            new = np.zeros(own.shape) if own.dtype.kind not in "fciu" else own.astype(kind)
            if new.size:
                new.ravel()[rng.randrange(new.size)] = rng.choice(edges)
            return np.full_like(new, rng.choice(edges)) if rng.random() < 0.2 else new


def _from_npz(content: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(content)) as archive:
        return {name: archive[name] for name in archive.files}


def _to_npz(arrays: dict[str, Any], rng: Random) -> bytes:
    stream = io.BytesIO()
    (np.savez if rng.random() < 0.5 else np.savez_compressed)(stream, **arrays)  # pyright: ignore[reportArgumentType]
    return stream.getvalue()


def _from_hdf5(content: bytes) -> dict[str, Any]:
    import h5py

    found: dict[str, Any] = {}
    with h5py.File(io.BytesIO(content), "r") as root:

        def take(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                text = h5py.check_string_dtype(item.dtype) is not None
                found[name] = np.asarray(item.asstr()[()] if text else item[()])

        root.visititems(take)
    return found


def _to_hdf5(arrays: dict[str, Any], rng: Random) -> bytes:
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w") as root:
        for name, array in arrays.items():
            at = name.replace(".", "/")
            try:
                if np.asarray(array).dtype.kind in "UO":
                    text = np.array([str(x).replace("\0", "") for x in np.ravel(array)], dtype=object)
                    root.create_dataset(at, np.shape(array), h5py.string_dtype(), text.reshape(np.shape(array)))
                elif rng.random() < 0.2 and np.ndim(array):
                    root.create_dataset(at, data=array, chunks=True, compression="gzip")
                elif rng.random() < 0.1:
                    root.attrs[at] = array
                else:
                    root[at] = array
            except (TypeError, ValueError, OSError, RuntimeError):
                continue  # what the format cannot hold
    return stream.getvalue()


_CONTAINERS: dict[str, tuple[Callable[[bytes], dict[str, Any]], Callable[[dict[str, Any], Random], bytes]]] = {
    "npz": (_from_npz, _to_npz),
    "h5": (_from_hdf5, _to_hdf5),
}
