"""Which designs a study is of: what varies, and how it is sampled."""

from flexura.lazy import face

face(__name__)
