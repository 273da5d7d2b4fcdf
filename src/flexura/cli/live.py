"""The command of the live page."""

from __future__ import annotations

from typing import Annotated

import typer

from flexura.cli.options import File


def live_command(
    file: File,
    port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Port to listen at: the first from 8650 that is free.")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
    keep: Annotated[bool, typer.Option("--keep", help="Do not end when the last page is closed.")] = False,
    n: Annotated[int, typer.Option("-n", min=1, max=30, help="Number of modes.")] = 6,
) -> None:
    """A page on this machine whose sliders are the parameters: 3-D, frequencies, responses, stresses follow."""
    from flexura.pages.live import live

    live(file, port=port, browser=browser, keep=keep, n=n)
