"""Packages that only some of what flexura does needs: the extras of its installation."""

from __future__ import annotations

import platform
import re
import warnings
from importlib import import_module, metadata
from types import ModuleType

from flexura.errors import OptionError

EXTRAS = {
    "ansys": "matrices and meshes of Ansys",
    "cluster": "studies on a dask cluster",
    "control": "systems of python-control",
    "experiment": "measured data in UFF and HDF5",
    "export": "models for MATLAB, HDF5, ParaView and UFF",
    "fmi": "FMUs run as a check",
    "live": "the live page: flexura live",
    "notebook": "three dimensions in notebooks",
    "pandas": "to_frame of results",
    "parquet": "tables as Parquet files",
    "solid": "meshes of solids by gmsh, and a quicker sparse solver",
    "study": "studies kept in folders, and Pareto fronts",
}
"""What flexura can be installed with beside what it always needs, and what each is for."""


def packages_of(extra: str) -> list[str]:
    """Packages that an extra installs on this system, as the installation says."""
    listed = metadata.requires("flexura") or []
    own = (line.partition(";") for line in listed)
    chosen = [(name, marker) for name, _, marker in own if re.search(rf"extra\s*==\s*['\"]{extra}['\"]", marker)]
    return [re.split(r"[\s<>=!~\[(]", name.strip())[0] for name, marker in chosen if _holds(marker)]


def _holds(marker: str) -> bool:
    """Whether what a requirement says of the system, beside the extra, is so here."""
    here = {"platform_system": platform.system(), "platform_machine": platform.machine()}
    return all(here[key] == value for key, value in re.findall(r"(platform_\w+)\s*==\s*['\"]([^'\"]*)['\"]", marker))


def need(module: str, extra: str) -> ModuleType:
    """Import a module of an extra, without its warnings and without changes to their filters.

    Raises OptionError that names the extra when the module, or a library that it is linked to, is missing.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return import_module(module)
        except ImportError:
            raise OptionError(f"this needs the package {module}: pip install 'flexura[{extra}]'") from None
        except OSError as error:
            raise OptionError(f"{module} needs a library of the system, by its package manager: {error}") from None
