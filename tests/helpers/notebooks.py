"""Notebooks run in a kernel of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]


def run(*cells: str) -> list[list[Any]]:
    """The outputs of every cell, which has to end without an error."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    return [cell["outputs"] for cell in executed(notebook)["cells"]]


def executed(notebook: Any, folder: Path = ROOT) -> Any:
    """The notebook, run in a folder, with its outputs. Raises CellExecutionError where a cell ends with an error."""
    where = {"metadata": {"path": str(folder)}}
    return NotebookClient(notebook, timeout=300, kernel_name="python3", resources=where).execute()


def shown(outputs: list[Any]) -> list[dict[str, Any]]:
    """What outputs show, by MIME type each; what is printed is left out."""
    return [own["data"] for own in outputs if own["output_type"] in ("execute_result", "display_data")]
