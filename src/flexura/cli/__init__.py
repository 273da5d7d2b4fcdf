"""The shell's `flexura VERB FILE`: the same verbs as in Python, printed."""

from flexura.cli.app import main

__all__ = ["main"]
