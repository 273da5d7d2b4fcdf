"""Studies of many designs: what is asked of them, how they are sampled and run, and what follows."""

from flexura.lazy import face

face(__name__)
