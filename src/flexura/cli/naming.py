"""Which option of a command line an error is about."""

from __future__ import annotations

import re
from collections.abc import Sequence


def with_option(text: str, arguments: Sequence[str]) -> str:
    """The text of an error with the option in front that gave what it is about; as it is where that is not clear.

    An error that quotes a value, or names a parameter, is about the one option with that value, or with that value
    before its `=`; one that begins with the name of an argument is about the option of that name.
    """
    if text.startswith("-"):
        return text
    given = list(_options(arguments))
    quoted = {a or b for a, b in re.findall(r"'([^']+)'|^parameter (\w+)", text)}
    about = [(o, v) for o, v in given if v in quoted or v.partition("=")[0] in quoted or quoted & set(v.split(","))]
    if not about:
        first = re.match(r"\w+", text)
        about = [(o, v) for o, v in given if first and o.lstrip("-").replace("-", "_") == first[0]]
    if len(set(about)) != 1:
        return text
    option, value = about[0]
    return f"{option} {value!r}: {text}"


def _options(arguments: Sequence[str]) -> list[tuple[str, str]]:
    """Options of a command line, each with the text that follows it."""
    found = []
    for option, after in zip(arguments, [*arguments, ""][1:], strict=True):
        if not re.match(r"--?[A-Za-z]", option):
            continue
        name, equals, value = option.partition("=")
        found.append((name, value if equals else after))
    return found
