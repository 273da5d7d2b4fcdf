from flexura.io.fmu.code import c_sources as c_sources
from flexura.io.fmu.code import sources_of as sources_of
from flexura.io.fmu.compilers import FLAGS as FLAGS
from flexura.io.fmu.compilers import shared_library as shared_library
from flexura.io.fmu.package import write_fmi3 as write_fmi3
from flexura.io.fmu.package import write_fmu as write_fmu
