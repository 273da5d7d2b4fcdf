from flexura.io.uff.models import scalar_notes as scalar_notes
from flexura.io.uff.models import write_results_uff as write_results_uff
from flexura.io.uff.reader import read_uff as read_uff
from flexura.io.uff.writer import write_uff as write_uff
