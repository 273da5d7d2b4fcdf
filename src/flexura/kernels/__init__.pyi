from flexura.kernels.library import Kernel as Kernel
from flexura.kernels.library import Struct as Struct
from flexura.kernels.library import address as address
from flexura.kernels.library import is_compiled as is_compiled
from flexura.kernels.library import packed as packed
from flexura.kernels.library import scratch as scratch
from flexura.kernels.library import without as without
