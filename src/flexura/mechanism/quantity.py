"""The number types of a description: floats in SI, or expressions over parameters.

Every type knows its physical dimension and its permitted sign. A reader of text with units is handed in through
pydantic's validation context (key `CONTEXT_KEY`), so that this room knows nothing of unit names.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import PydanticCustomError, core_schema

from flexura.errors import ExpressionError
from flexura.expressions import Expression, Folded, checked
from flexura.expressions import dimension as dim

CONTEXT_KEY = "read_quantity"
FRACTION = "at least 0 and below 1"
Scalar = float | Expression

LARGEST_LENGTH = 1e9
"""m; of all sizes and coordinates."""

SMALLEST_LENGTH = 1e-12
"""m; of sizes that are positive."""

LARGEST = 1e60
"""Of every other quantity with a dimension in SI, and its inverse of those that are positive."""


@dataclass(frozen=True)
class Quantity:
    """What a number field expects: a physical dimension (None: any), a sign and an example for messages."""

    kind: str
    dimension: dim.Dimension | None
    example: str
    sign: str = "any"  # any | positive | non-negative | FRACTION
    angle: bool = False

    @property
    def a_kind(self) -> str:
        """The kind with its article."""
        return f"an {self.kind}" if self.kind[0] in "aeiou" else f"a {self.kind}"

    def admits(self, value: float) -> bool:
        """True when `value` has the permitted sign."""
        if self.sign == "positive":
            return value > 0
        if self.sign == FRACTION:
            return 0 <= value < 1
        return value >= 0 or self.sign == "any"

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the largest size of a value, SI, that double precision can hold beside others."""
        if self.dimension is None or self.dimension == dim.NUMBER:
            return 0.0, math.inf
        least, most = (SMALLEST_LENGTH, LARGEST_LENGTH) if self.dimension == dim.LENGTH else (1 / LARGEST, LARGEST)
        return (least if self.sign == "positive" else 0.0), most

    def __get_pydantic_core_schema__(self, _: Any, __: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(
            self._validate, serialization=core_schema.plain_serializer_function_ser_schema(lambda v: v)
        )

    def __get_pydantic_json_schema__(self, _: Any, __: GetJsonSchemaHandler) -> dict[str, Any]:
        text = f"{self.kind}, e.g. {self.example!r}; or an expression over parameters"
        numbers: dict[str, Any] = (
            {"type": "number"} if self.dimension in (None, dim.NUMBER) and not self.angle else {"const": 0}
        )
        return {"anyOf": [{"type": "string"}, numbers], "description": text}

    def _validate(self, raw: Any, info: ValidationInfo) -> Scalar:
        read: Callable[[Any, Quantity], Scalar] = (info.context or {}).get(CONTEXT_KEY, _read_si)
        try:
            value = _folded(read(raw, self))
        except ExpressionError as error:
            raise PydanticCustomError("quantity", "{rule}", {"rule": error.rule, "hint": error.hint}) from None
        if isinstance(value, float):
            if not math.isfinite(value):
                raise PydanticCustomError("quantity", "{rule}", {"rule": f"{self.a_kind} must be finite", "hint": ""})
            if not self.admits(value):
                rule = f"{self.a_kind} must be {self.sign}"
                raise PydanticCustomError("quantity", "{rule}", {"rule": rule, "hint": ""})
            least, most = self.limits
            if not least <= abs(value) <= most:
                rule = (
                    f"{self.a_kind} must be"
                    + (f" at least {least:g} and" if least else "")
                    + f" at most {most:g} in SI"
                )
                hint = "double precision cannot hold it beside others; check its unit"
                raise PydanticCustomError("quantity", "{rule}", {"rule": rule, "hint": hint})
        return value


def _folded(value: Scalar) -> Scalar:
    """An expression without parameters is the number it comes to."""
    if isinstance(value, Expression):
        checked(value.tree)
        if not value.names:
            with np.errstate(all="ignore"):
                return Folded(value.evaluate({}), value.tree)
    return value


def _read_si(raw: Any, quantity: Quantity) -> Scalar:
    """Accept what Python code writes: an SI number, an Expression, or the text of one."""
    if isinstance(raw, Expression):
        checked(raw.tree)
        Expression.parse(str(raw))  # as large as can be written, and read again
        return raw
    if isinstance(raw, str):
        return Expression.parse(raw)
    try:
        return float(raw) if not isinstance(raw, bool | bytes) else math.nan
    except (TypeError, ValueError, OverflowError):
        raise ExpressionError(f"{quantity.a_kind} is a number in SI or an expression") from None


Length = Annotated[Scalar, Quantity("length", dim.LENGTH, "10 mm")]
PositiveLength = Annotated[Scalar, Quantity("length", dim.LENGTH, "10 mm", "positive")]
NonNegativeLength = Annotated[Scalar, Quantity("length", dim.LENGTH, "10 mm", "non-negative")]
Angle = Annotated[Scalar, Quantity("angle", dim.NUMBER, "90 deg", angle=True)]
PositiveAngle = Annotated[Scalar, Quantity("angle", dim.NUMBER, "30 deg", "positive", angle=True)]
Number = Annotated[Scalar, Quantity("pure number", dim.NUMBER, "0.5")]
PositiveNumber = Annotated[Scalar, Quantity("pure number", dim.NUMBER, "0.5", "positive")]
NonNegativeNumber = Annotated[Scalar, Quantity("pure number", dim.NUMBER, "0.02", "non-negative")]
PositiveArea = Annotated[Scalar, Quantity("area", dim.AREA, "3 mm^2", "positive")]
SecondMoment = Annotated[Scalar, Quantity("second moment of area", dim.SECOND_MOMENT, "0.02 mm^4", "positive")]
PositiveMass = Annotated[Scalar, Quantity("mass", dim.MASS, "0.5 kg", "positive")]
NonNegativeMass = Annotated[Scalar, Quantity("mass", dim.MASS, "20 g", "non-negative")]
Inertia = Annotated[Scalar, Quantity("moment of inertia", dim.INERTIA, "1e-4 kg*m^2")]
Density = Annotated[Scalar, Quantity("density", dim.DENSITY, "2810 kg/m^3", "positive")]
PositivePressure = Annotated[Scalar, Quantity("modulus", dim.PRESSURE, "71.7 GPa", "positive")]
TranslationalStiffness = Annotated[Scalar, Quantity("stiffness", dim.TRANSLATIONAL_STIFFNESS, "2 N/um", "non-negative")]
RotationalStiffness = Annotated[
    Scalar, Quantity("rotational stiffness", dim.ROTATIONAL_STIFFNESS, "3 N*m/rad", "non-negative")
]
StiffnessTT = Annotated[Scalar, Quantity("stiffness", dim.TRANSLATIONAL_STIFFNESS, "2 N/um")]
StiffnessTR = Annotated[Scalar, Quantity("coupling stiffness", dim.FORCE, "5 N/rad")]
StiffnessRR = Annotated[Scalar, Quantity("rotational stiffness", dim.ROTATIONAL_STIFFNESS, "3 N*m/rad")]
PositiveStiffness = Annotated[Scalar, Quantity("stiffness", dim.TRANSLATIONAL_STIFFNESS, "2 N/um", "positive")]
Force = Annotated[Scalar, Quantity("force", dim.FORCE, "20 N")]
Moment = Annotated[Scalar, Quantity("moment", dim.ROTATIONAL_STIFFNESS, "0.5 N*m")]
Voltage = Annotated[Scalar, Quantity("voltage", dim.VOLTAGE, "75 V")]
Acceleration = Annotated[Scalar, Quantity("acceleration", dim.ACCELERATION, "9.81 m/s^2")]
PositiveVoltage = Annotated[Scalar, Quantity("voltage", dim.VOLTAGE, "100 V", "positive")]
StrainPerVolt = Annotated[Scalar, Quantity("strain per volt", dim.STRAIN_PER_VOLT, "0.9 um/m/V")]
Temperature = Annotated[Scalar, Quantity("temperature change", dim.TEMPERATURE, "20 K")]
TemperatureGradient = Annotated[Scalar, Quantity("gradient of temperature", dim.TEMPERATURE_GRADIENT, "0.1 K/mm")]
Power = Annotated[Scalar, Quantity("power", dim.POWER, "2 W")]
Conductance = Annotated[Scalar, Quantity("thermal conductance", dim.CONDUCTANCE, "0.5 W/K", "positive")]
Conductivity = Annotated[Scalar, Quantity("thermal conductivity", dim.CONDUCTIVITY, "167 W/(m*K)", "positive")]
HeatTransfer = Annotated[Scalar, Quantity("heat transfer coefficient", dim.HEAT_TRANSFER, "5 W/(m^2*K)", "positive")]
HeatCapacity = Annotated[Scalar, Quantity("specific heat capacity", dim.HEAT_CAPACITY, "900 J/(kg*K)", "positive")]
PerKelvin = Annotated[Scalar, Quantity("relative change per kelvin", dim.STRAIN_PER_KELVIN, "-250e-6/K")]
ExpansionCoefficient = Annotated[Scalar, Quantity("coefficient of expansion", dim.STRAIN_PER_KELVIN, "12 um/m/K")]
PositiveForce = Annotated[Scalar, Quantity("force", dim.FORCE, "100 N", "positive")]
PositiveMoment = Annotated[Scalar, Quantity("moment", dim.ROTATIONAL_STIFFNESS, "0.5 N*m", "positive")]
PositiveStroke = Annotated[Scalar, Quantity("stroke per volt", dim.STROKE_PER_VOLT, "0.1 um/V", "positive")]
PositiveFrequency = Annotated[Scalar, Quantity("frequency", dim.FREQUENCY, "100 Hz", "positive")]
NonNegativeFrequency = Annotated[Scalar, Quantity("frequency", dim.FREQUENCY, "100 Hz", "non-negative")]
PositiveTime = Annotated[Scalar, Quantity("time", dim.TIME, "20 ms", "positive")]
NonNegativeForce = Annotated[Scalar, Quantity("force", dim.FORCE, "0.01 N", "non-negative")]
NonNegativeAcceleration = Annotated[Scalar, Quantity("acceleration", dim.ACCELERATION, "0.01 m/s^2", "non-negative")]
DampingRatio = Annotated[Scalar, Quantity("damping ratio", dim.NUMBER, "0.01", FRACTION)]
TranslationalDamping = Annotated[
    Scalar, Quantity("damping coefficient", dim.TRANSLATIONAL_DAMPING, "5 N*s/m", "non-negative")
]
RotationalDamping = Annotated[
    Scalar, Quantity("rotational damping coefficient", dim.ROTATIONAL_DAMPING, "0.01 N*m*s/rad", "non-negative")
]
ContactDamping = Annotated[Scalar, Quantity("contact damping", dim.PER_SPEED, "0.5 s/m", "non-negative")]
AnyQuantity = Annotated[Scalar, Quantity("quantity", None, "0.3 mm")]
