"""Packages that only some of what flexura does needs: the extras of its installation."""

from __future__ import annotations

import warnings
from importlib import import_module
from types import ModuleType

from flexura.errors import OptionError


def need(module: str, extra: str) -> ModuleType:
    """Import a module of an extra, without its warnings and without changes to their filters.

    Raises OptionError that names the extra when the module, or a library that it is linked to, is missing or older than
    what is installed beside it.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return import_module(module)
        except ModuleNotFoundError:
            raise OptionError(f"this needs the package {module}: pip install 'flexura[{extra}]'") from None
        except OSError as error:
            raise OptionError(f"{module} needs a library of the system, by its package manager: {error}") from None
        except Exception as error:  # whatever a package raises that was built for another release of NumPy
            said = f"{module} is installed, but cannot be imported ({' '.join(str(error).split())[:200]})"
            raise OptionError(f"{said}: pip install --upgrade 'flexura[{extra}]'") from None
