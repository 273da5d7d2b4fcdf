from flexura.io.fmu.code import FLAGS as FLAGS
from flexura.io.fmu.code import SOURCES as SOURCES
from flexura.io.fmu.code import c_sources as c_sources
from flexura.io.fmu.code import shared_library as shared_library
from flexura.io.fmu.package import write_fmu as write_fmu
