"""What is in the gallery, told by the first lines of its files, which are read whole only when they are used."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flexura.errors import OptionError, did_you_mean

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Entry:
    """A mechanism of the gallery: its file is `path`, and `line` the first sentence that it says of itself."""

    name: str
    line: str
    path: Path

    @property
    def text(self) -> str:
        """The file as it is."""
        return self.path.read_text(encoding="utf-8")


def entries() -> list[Entry]:
    """All mechanisms of the gallery, by name."""
    return [Entry(path.stem, _first_sentence(path), path) for path in sorted(FOLDER.glob("*.yaml"))]


def entry(name: str) -> Entry:
    """One mechanism of the gallery. Raises OptionError for a name that it does not have."""
    known = {listed.name: listed for listed in entries()}
    asked = name.strip().removesuffix(".yaml").replace("-", "_")
    if asked not in known:
        hint = did_you_mean(asked, known, "flexura examples lists them")
        raise OptionError(f"there is no {name!r} in the gallery; {hint}")
    return known[asked]


def _first_sentence(path: Path) -> str:
    """Of the description that a file begins with: indented lines below `description: |`."""
    words = list[str]()
    with path.open(encoding="utf-8") as lines:
        for line in lines:
            if line.startswith("description:"):
                words = [""]
            elif words and line.strip() and not line.startswith(" "):
                break
            elif words:
                words.append(line.strip())
    text = " ".join(words).strip()
    first, stop, _ = text.partition(". ")
    return first + stop.strip() if stop else text
