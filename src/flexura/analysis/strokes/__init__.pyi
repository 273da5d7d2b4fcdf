from flexura.analysis.strokes.charts import stroke_chart as stroke_chart
from flexura.analysis.strokes.equilibrium_path import FromTo as FromTo
from flexura.analysis.strokes.equilibrium_path import driven_displacement as driven_displacement
from flexura.analysis.strokes.low_order_motion import LowOrderMotion as LowOrderMotion
from flexura.analysis.strokes.low_order_motion import low_order_motion as low_order_motion
from flexura.analysis.strokes.pose import StrokePose as StrokePose
from flexura.analysis.strokes.stroke import Stroke as Stroke
from flexura.analysis.strokes.stroke import stroke as stroke
