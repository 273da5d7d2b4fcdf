"""From a mechanism to named DOFs, element arrays, and the matrices K and M."""

from flexura.lazy import face

face(__name__)
