"""Instances of FMI 3.0 by fmpy's layer of single calls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi3 import FMU3Slave


@contextmanager
def instance(
    path: Path, kind: Any = FMU3Slave, start: float = 0.0, **options: Any
) -> Iterator[tuple[Any, dict[str, int], list[str]]]:
    """An instance after initialization, value references by name, and what is logged."""
    about = fmpy.read_model_description(str(path))
    part = about.coSimulation if kind is FMU3Slave else about.modelExchange
    folder = path.with_suffix("")
    if not folder.exists():
        fmpy.extract(str(path), str(folder))
    fmu = kind(guid=about.guid, unzipDirectory=folder, modelIdentifier=part.modelIdentifier, instanceName="one")
    log: list[str] = []
    tell = lambda _, status, category, text: log.append(f"{status} {category!r} {text.decode()}")  # noqa: E731
    fmu.instantiate(logMessage=tell, **options)
    fmu.enterInitializationMode(startTime=start)
    fmu.exitInitializationMode()
    try:
        yield fmu, {v.name: v.valueReference for v in about.modelVariables}, log
    finally:
        fmu.terminate()
        fmu.freeInstance()
