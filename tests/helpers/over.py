"""Many small cases as one test: quicker than a test for each where all of them take less than pytest does."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest

FAILURES = (Exception, pytest.fail.Exception)


def over(names: str | tuple[str, ...], cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """As `pytest.mark.parametrize`, in one test, which tells all cases that fail; they share its fixtures."""
    keys = [names] if isinstance(names, str) and "," not in names else names
    keys = [key.strip() for key in (keys.split(",") if isinstance(keys, str) else keys)]
    values = [tuple(case) if len(keys) > 1 else (case,) for case in cases]

    def decorated(test: Callable[..., None]) -> Callable[..., None]:
        def test_all(**fixtures: Any) -> None:
            failed: list[BaseException] = []
            for value in values:
                try:
                    test(**fixtures, **dict(zip(keys, value, strict=True)))
                except FAILURES as error:
                    error.add_note(f"with {', '.join(f'{k} = {v!r}' for k, v in zip(keys, value, strict=True))}")
                    failed.append(error)
            assert values, "no cases"
            if len(failed) == 1:
                raise failed[0]
            if failed:
                raise BaseExceptionGroup(f"{len(failed)} of {len(values)} cases", failed)

        signature = inspect.signature(test)
        left = [own for own in signature.parameters.values() if own.name not in keys]
        for name in ("__name__", "__qualname__", "__doc__", "__module__", "__dict__"):
            setattr(test_all, name, getattr(test, name))
        test_all.__signature__ = signature.replace(parameters=left)  # pyright: ignore[reportFunctionMemberAccess]
        return test_all

    return decorated
