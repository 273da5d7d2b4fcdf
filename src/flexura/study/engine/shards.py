"""The folder of a study: a manifest of what makes it itself, and a Parquet file for each block that is done."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from flexura._version import __version__
from flexura.errors import ModelError, OptionError, need
from flexura.files import read_text, write_file
from flexura.modelfile import dumps
from flexura.records import Record
from flexura.study.engine.work import PROVEN, REASON, Columns, Work

STUDY_FORMAT = 1
"""Of the manifest and the shards."""

UNRELATED = {"description", "studies", "test"}
"""Keys of a mechanism that no result of a study depends on."""

HASH_DIGITS = 16
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
            "format": STUDY_FORMAT,
            "flexura": __version__,
            "parameters": dict(sorted(work.fixed.items())),
            "questions": [quantity.text for quantity in work.questions.quantities],
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
    return _hashed([key, number])[:HASH_DIGITS]


def _plain(value: Any) -> str:
    """An exponent of a unit, which releases of pydantic before 2.13 do not know, as those after it write it."""
    if isinstance(value, Fraction):
        return str(value)
    raise TypeError(f"{type(value).__name__} is not plain data")


def _hashed(data: Any) -> str:
    return sha256(json.dumps(data, sort_keys=False, separators=(",", ":")).encode()).hexdigest()


MANIFEST = "study.json"
EARLIER = "earlier"
_NAMED = re.compile(r"(\d{10})-([0-9a-f]{16})\.parquet")
_KEY = b"flexura study"


class Folder:
    """The folder of a study, which may not be there yet."""

    def __init__(self, path: str | Path) -> None:
        self.path: Path = Path(path)

    def manifest(self) -> dict[str, Any]:
        """What the folder is of. Raises OptionError where there is no study, or one that cannot be read."""
        file = self.path / MANIFEST
        if not file.is_file():
            raise OptionError(f"{self.path}: there is no study here (no {MANIFEST})")
        try:
            manifest = json.loads(read_text(file))
            if manifest["format"] != STUDY_FORMAT:
                raise OptionError(
                    f"{file}: format {manifest['format']!r:.20} is not known; this version reads {STUDY_FORMAT}"
                )
            return {**manifest, "key": str(manifest["key"]), "columns": list(manifest["columns"])}
        except (ValueError, LookupError, TypeError) as error:
            raise OptionError(f"{file}: not the manifest of a study, or damaged: {error}") from None

    def file(self, key: str, number: int) -> Path:
        """Where the shard of a block is."""
        return self.path / f"{number:010d}-{shard_hash(key, number)}.parquet"

    def numbers(self, key: str) -> list[int]:
        """Blocks of a study that have a file, in order."""
        names = (_NAMED.fullmatch(file.name) for file in self.path.iterdir()) if self.path.is_dir() else ()
        return sorted(int(name[1]) for name in names if name and name[2] == shard_hash(key, int(name[1])))

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Have the folder to oneself, made when it is missing; a killed process holds it no longer.

        Raises OptionError when another process works in it, or it cannot be made.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            number = os.open(self.path, os.O_RDONLY) if os.name == "posix" else None
        except OSError as error:
            raise OptionError(f"{self.path}: the folder of a study cannot be made: {error.strerror}") from None
        try:
            if number is not None and not _lock(number):
                raise OptionError(f"{self.path}: another process works on the study of this folder")
            yield
        finally:
            if number is not None:
                os.close(number)

    def prepare(self, identity: Identity, say: Callable[[str], None]) -> None:
        """Make the folder that of a study. A study of something else that is there is put aside, and said so; one that
        was put aside is taken up again. Raises OptionError when the folder cannot be written to, or holds other files
        that a table of `*.parquet` would mix in.
        """
        before = self.manifest() if (self.path / MANIFEST).exists() else None
        keys = {identity.key, *([before["key"]] if before else [])}
        known = {self.file(key, number).name for key in keys for number in self.numbers(key)}
        other = sorted(file.name for file in self.path.glob("*.parquet") if file.name not in known)
        if other:
            raise OptionError(f"{self.path} holds {other[0]}, which is not of this study; take another folder")
        if before is not None and before["key"] != identity.key:
            say(f"{self.path} held another study ({_changed(before, identity)}): that is in its folder {EARLIER} now")
            self._move(before["key"], self.path, self._aside(before["key"]))
        if not (self.path / MANIFEST).exists():
            write_file(self.path / MANIFEST, lambda file: file.write_text(identity.text(), encoding="utf-8"))
        if self._aside(identity.key).is_dir():
            say(f"{self.path}: this study was begun here before, and goes on")
            self._move(identity.key, self._aside(identity.key), self.path)

    def _aside(self, key: str) -> Path:
        return self.path / EARLIER / key[:16]

    def _move(self, key: str, source: Path, target: Path) -> None:
        """Move the shards of a study, and its manifest behind them where the other folder has none."""
        try:
            target.mkdir(parents=True, exist_ok=True)
            for number in Folder(source).numbers(key):
                name = self.file(key, number).name
                (source / name).replace(target / name)
            (source / MANIFEST).replace(target / MANIFEST)
            if source != self.path:
                with suppress(OSError):
                    source.rmdir()
                    source.parent.rmdir()
        except OSError as error:
            raise OptionError(f"{source} cannot be moved to {target}: {error.strerror}") from None

    def write(self, key: str, number: int, columns: Columns) -> None:
        """Write a shard in one step. Raises OptionError when it cannot be written."""
        data, form = arrow_table(columns, {_KEY: _stamp(key, number)}), need("pyarrow.parquet", "study")
        repeated = [name for name, column in columns.items() if column.dtype == object]
        write_file(
            self.file(key, number),
            lambda file: form.write_table(
                data,
                file,
                compression="zstd",
                use_dictionary=repeated,
                row_group_size=len(data),
                write_page_checksum=True,
            ),
        )

    def fault(self, key: str, number: int, designs: int) -> str:
        """What is wrong with a shard, by its size and footer; nothing with one that is whole."""
        form, lib = need("pyarrow.parquet", "study"), need("pyarrow", "study")
        try:
            footer = form.read_metadata(self.file(key, number))
        except (OSError, lib.ArrowException) as error:
            return " ".join(str(error).split())[:100]
        if (footer.metadata or {}).get(_KEY) != _stamp(key, number):
            return "it is of something else"
        return "" if footer.num_rows == designs else f"{footer.num_rows} designs in place of {designs}"

    def read(self, key: str, number: int, columns: list[str] | None = None) -> Columns:
        """The columns of a shard, or some of them. Raises OptionError for one that is damaged."""
        form, lib, file = need("pyarrow.parquet", "study"), need("pyarrow", "study"), self.file(key, number)
        try:
            data = form.ParquetFile(file, page_checksum_verification=True).read(columns)
        except (OSError, lib.ArrowException) as error:
            hint = "take it away and run the study again, which works it out anew"
            raise OptionError(f"{file}: damaged ({' '.join(str(error).split())[:100]}); {hint}") from None
        return {name: data[name].to_numpy() for name in data.column_names}


def _lock(number: int) -> bool:
    """Whether a folder could be locked, by its number; True where there are no locks."""
    try:
        import fcntl

        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:
        return True
    except OSError:
        return False
    return True


def _stamp(key: str, number: int) -> bytes:
    return f"{key} {number}".encode()


def arrow_table(columns: Columns, metadata: dict[bytes, bytes] | None = None) -> Any:
    """An Arrow table of columns."""
    lib = need("pyarrow", "study")
    kinds = {REASON: lib.string(), PROVEN: lib.bool_()}
    arrays = {name: lib.array(column, type=kinds.get(name)) for name, column in columns.items()}
    return lib.table(arrays, metadata=metadata)


def _changed(before: dict[str, Any], identity: Identity) -> str:
    """What differs between two studies, in a few words."""
    names = {
        "mechanism": "the mechanism",
        "parameters": "its parameters",
        "questions": "what is asked",
        "space": "what varies",
        "flexura": "the version of flexura",
    }
    changed = [words for name, words in names.items() if before.get(name) != identity.manifest.get(name)]
    return f"{', '.join(changed) or 'its description'} differ{'' if len(changed) > 1 else 's'}"
