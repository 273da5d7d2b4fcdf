"""What is compiled when flexura is built: the kernels, by the C compiler here, or by zig for FLEXURA_PLATFORM.

Where there is no compiler the wheel has none, is for all platforms, and NumPy does what they do.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).parent / "src"))

WHEELS = {
    "x86_64-linux": "manylinux_2_17_x86_64",
    "aarch64-linux": "manylinux_2_17_aarch64",
    "x86_64-windows": "win_amd64",
    "x86_64-darwin": "macosx_11_0_x86_64",
    "aarch64-darwin": "macosx_11_0_arm64",
}
"""What wheels call platforms."""


class Kernels(BuildHookInterface):
    """Compiles the kernels into wheels, and into the checkout for editable installations."""

    def dependencies(self) -> list[str]:
        """What builds need."""
        return ["ziglang"] if os.environ.get("FLEXURA_PLATFORM") else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before files are chosen. Raises OptionError where a platform is asked for that cannot be compiled for."""
        from flexura.errors import OptionError
        from flexura.kernels.build import build

        platform = os.environ.get("FLEXURA_PLATFORM")
        try:
            built = build(platform)
        except OptionError as error:
            if platform:
                raise
            self.app.display_warning(f"kernels are not compiled, NumPy does what they do: {error}")
            return
        if version != "editable":
            build_data["artifacts"].append(built.relative_to(self.root).as_posix())
            own = WHEELS[platform] if platform else sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data |= {"pure_python": False, "tag": f"py3-none-{own}"}
