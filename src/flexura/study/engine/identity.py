"""What makes a study itself: the data that its results depend on, and the hashes that its shards are named by."""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from hashlib import sha256
from typing import Any

from flexura._version import __version__
from flexura.errors import ModelError
from flexura.modelfile import dumps
from flexura.records import Record
from flexura.study.engine.work import Work

FORMAT = 1
"""Of the manifest and the shards."""

UNRELATED = {"description", "studies", "test"}
"""Keys of a mechanism that no result of a study depends on."""

DIGITS = 16
"""Of a hash in the name of a file."""


@dataclass(frozen=True, repr=False)
class Identity(Record):
    """Plain data that describe a study: `manifest` is written beside its shards, `essence` is what is hashed."""

    _shown = ("key",)

    manifest: dict[str, Any]
    essence: dict[str, Any]

    @classmethod
    def of(cls, work: Work) -> Identity:
        """The identity of a study: mechanism, fixed parameters, questions, space, version and size of blocks."""
        mechanism = work.questions.plan.mechanism
        left_out = UNRELATED & set(type(mechanism).model_fields)
        plain = json.loads(mechanism.model_dump_json(exclude=left_out, fallback=_plain))
        shared = {
            "format": FORMAT,
            "flexura": __version__,
            "parameters": dict(sorted(work.fixed.items())),
            "questions": [own.text for own in work.questions.quantities],
            "space": work.space.describe(),
            "designs": work.space.size,
            "designs of a shard": work.size,
        }
        try:
            text = dumps(mechanism)
        except ModelError:  # of parameters whose unit nobody has told
            text = None
        columns = [{"name": name, "holds": what} for name, what in work.headings()]
        manifest = {**shared, "name": mechanism.name, "columns": columns, "mechanism": text}
        return cls(manifest, {**shared, "mechanism": plain})

    @cached_property
    def key(self) -> str:
        """The hash of everything that the results depend on."""
        return _hashed(self.essence)

    def text(self) -> str:
        """The manifest as a file."""
        return json.dumps({**self.manifest, "key": self.key}, indent=1, ensure_ascii=False, allow_nan=True) + "\n"


def shard_hash(key: str, number: int) -> str:
    """What names the shard of a block of the study with a key."""
    return _hashed([key, number])[:DIGITS]


def _plain(value: Any) -> str:
    """An exponent of a unit, which releases of pydantic before 2.13 do not know, as those after it write it."""
    if isinstance(value, Fraction):
        return str(value)
    raise TypeError(f"{type(value).__name__} is not plain data")


def _hashed(data: Any) -> str:
    return sha256(json.dumps(data, sort_keys=False, separators=(",", ":")).encode()).hexdigest()
