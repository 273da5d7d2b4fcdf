"""One page that tells what is known of a mechanism, with the evidence of every number."""

from flexura.lazy import face

face(__name__)
