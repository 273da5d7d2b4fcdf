"""What there is to draw of a mechanism: solids, members, marks, as meshes."""

from flexura.lazy import face

face(__name__)
