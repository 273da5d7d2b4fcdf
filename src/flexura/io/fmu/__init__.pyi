from flexura.io.fmu.package import shared_library as shared_library
from flexura.io.fmu.package import unit_of as unit_of
from flexura.io.fmu.package import write_fmi3 as write_fmi3
from flexura.io.fmu.package import write_fmu as write_fmu
