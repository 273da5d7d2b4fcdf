"""What there is to draw of a mechanism: solids, members, marks, as meshes."""
