"""Numbers for readers: four digits and a unit in which they are short."""

from __future__ import annotations

from math import degrees, isfinite

_SCALES: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((10.0, "m"), (1e-5, "mm"), (1e-8, "µm"), (0.0, "nm")),
    "kg": ((1.0, "kg"), (1e-3, "g"), (1e-6, "mg"), (0.0, "µg")),
    "N": ((1e3, "kN"), (1.0, "N"), (1e-3, "mN"), (0.0, "µN")),
    "N·m": ((1.0, "N·m"), (1e-3, "mN·m"), (0.0, "µN·m")),
    "N/m": ((1e6, "N/µm"), (1e3, "N/mm"), (0.0, "N/m")),
    "Pa": ((1e9, "GPa"), (1e5, "MPa"), (1e3, "kPa"), (0.0, "Pa")),
    "Hz": ((1e4, "kHz"), (0.0, "Hz")),
}
"""By SI unit: from which size on which unit is taken."""

_FACTORS = {
    "mm": 1e-3, "µm": 1e-6, "nm": 1e-9, "g": 1e-3, "mg": 1e-6, "µg": 1e-9, "kN": 1e3, "mN": 1e-3, "µN": 1e-6,
    "mN·m": 1e-3, "µN·m": 1e-6, "N/µm": 1e6, "N/mm": 1e3, "GPa": 1e9, "MPa": 1e6, "kPa": 1e3, "kHz": 1e3,
}  # fmt: skip


def shown(value: float, unit: str = "") -> str:
    """A number of an SI unit in words, such as `4.5 mm` or `0.0281°`; `unknown` where it is not finite."""
    if not isfinite(value):
        return "unknown"
    if unit == "rad":
        return f"{digits(degrees(value))}°"
    scales = _SCALES.get(unit, ((0.0, unit),))
    chosen = next(name for least, name in scales if abs(value) >= least) if value else unit
    return f"{digits(value / _FACTORS.get(chosen, 1.0))} {chosen}".rstrip()


def digits(value: float) -> str:
    """Four digits, without an exponent where the number is not far from one."""
    text = f"{value:.4g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{float(text):.10f}".rstrip("0").rstrip(".")
    return text
