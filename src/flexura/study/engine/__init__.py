"""Blocks of designs evaluated on processes or a cluster, kept as shards of a folder, and read again as one table."""

from flexura.lazy import face

face(__name__)
