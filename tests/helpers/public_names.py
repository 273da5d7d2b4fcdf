"""All names that users may rely on, each in the one namespace where it is found."""

from __future__ import annotations

from types import ModuleType

import flexura

NAMESPACES = ("describe", "modal", "models", "solid", "testing", "types", "view")
"""Faces of rooms that are public beside the top of the package."""

FOR_OTHER_ROOMS = {
    "modal": {
        *("CLOSE", "DEPENDENT_SHAPES", "REPEATED"),
        *("assignment", "best_pairs", "channel_gain", "close_groups"),
        *("in_order", "in_space", "largest_motion", "mac_with_spaces", "orthogonality", "pair_by_mac", "space_mac"),
        *("track_modes", "trusted_channels"),
    },
    "view": {
        *(
            "COLOURS",
            "HIDDEN",
            "MODE_SIZE",
            "NAMES",
            "Grid",
            "Kind",
            "Look",
            "Solids",
            "customary_camera",
            "draw_sheet",
        ),
        *("mode_scale", "moved_solids", "solids", "stresses_along", "visible_flexures"),
    },
}
"""What these faces show to other rooms alone."""

IN_TWO_PLACES = "Mechanism"
"""It is what is described, and what every verb is asked of."""


def public_names() -> dict[str, object]:
    """Names as they follow `flexura.`, such as `modes` and `describe.Material`, with what they name."""
    found = {name: getattr(flexura, name) for name in dir(flexura) if name not in NAMESPACES}
    for namespace in NAMESPACES:
        module = getattr(flexura, namespace)
        assert isinstance(module, ModuleType)
        own = set(dir(module)) - FOR_OTHER_ROOMS.get(namespace, set())
        found |= {f"{namespace}.{name}": getattr(module, name) for name in sorted(own)}
    del found[f"describe.{IN_TWO_PLACES}"]
    return found
