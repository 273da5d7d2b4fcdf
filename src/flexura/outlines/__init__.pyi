from flexura.outlines.chaining import outline_of as outline_of
from flexura.outlines.curves import as_arcs as as_arcs
from flexura.outlines.curves import bulge_through as bulge_through
from flexura.outlines.dxf import read_dxf as read_dxf
from flexura.outlines.outline import Loop as Loop
from flexura.outlines.outline import Outline as Outline
from flexura.outlines.outline import Segment as Segment
from flexura.outlines.svg import read_svg as read_svg
