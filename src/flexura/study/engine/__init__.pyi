from flexura.study.engine.run import run as run
from flexura.study.engine.shards import arrow_table as arrow_table
from flexura.study.engine.table import ALL_REQUIREMENTS as ALL_REQUIREMENTS
from flexura.study.engine.table import StudyTable as StudyTable
from flexura.study.engine.table import Summary as Summary
from flexura.study.engine.table import open_study as open_study
from flexura.study.engine.work import jumps_of as jumps_of
from flexura.study.engine.workers import blocks_of as blocks_of
