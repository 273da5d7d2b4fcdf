"""Which corrections beyond beam theory a member may have, and how its ends are held."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator

from flexura.mechanism.base import refuse
from flexura.mechanism.quantity import NonNegativeLength

Correction = Literal["plate", "warping", "shear", "notch", "root"]
CORRECTIONS: tuple[Correction, ...] = get_args(Correction)
_RULE = f"corrections are auto, none, or a list of some of {', '.join(CORRECTIONS)}"
_ROOT = "root is elastic or rigid, for both ends or as a pair, the first for the first node, as in [rigid, elastic]"
_FILLET = "fillet is a radius, for both ends or as a pair, the first for the first node, as in [0 mm, 1 mm]"
_ENDS = "ends are two of clamped and free, the first for the first node, as in [clamped, free]"


def _corrections(raw: Any) -> Any:
    if raw in ("auto", "none") and isinstance(raw, str):
        return raw
    names = (raw,) if isinstance(raw, str) else raw
    if not isinstance(names, list | tuple) or not names or not all(isinstance(name, str) for name in names):
        raise refuse(_RULE, "corrections: none leaves beam theory as it is")
    for name in names:
        if name not in CORRECTIONS:
            close = get_close_matches(name, (*CORRECTIONS, "auto", "none"), n=1)
            raise refuse(_RULE, f"did you mean {close[0]}?" if close else f"{name!r} is none of them")
    if len(set(names)) < len(names):
        raise refuse("one is named twice: every correction is named once")
    return tuple(names)


def _ends(raw: Any) -> Any:
    if raw is None or (
        isinstance(raw, list | tuple) and len(raw) == 2 and all(end in ("clamped", "free") for end in raw)
    ):
        return raw
    raise refuse(_ENDS)


def _root(raw: Any) -> Any:
    kinds = [raw, raw] if isinstance(raw, str) else raw
    if isinstance(kinds, list | tuple) and len(kinds) == 2 and all(kind in ("elastic", "rigid") for kind in kinds):
        return tuple(kinds)
    raise refuse(_ROOT)


def _fillet(raw: Any) -> Any:
    pair = raw if isinstance(raw, list | tuple) else [raw, raw]
    if len(pair) != 2:
        raise refuse(_FILLET)
    return tuple(pair)


Corrections = Annotated[Literal["auto", "none"] | tuple[Correction, ...], BeforeValidator(_corrections)]
"""`auto`, `none`, or the names of corrections that apply whatever the theory says of itself."""
End = Literal["clamped", "free"]
Ends = Annotated[tuple[End, End], BeforeValidator(_ends)]
RootKind = Literal["elastic", "rigid"]
Fillet = Annotated[tuple[NonNegativeLength, NonNegativeLength], BeforeValidator(_fillet)]
Root = Annotated[tuple[RootKind, RootKind], BeforeValidator(_root)]
