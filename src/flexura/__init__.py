"""flexura: low-order dynamic models of flexure-based compliant mechanisms, with evidence for every number.

    import flexura

    mechanism = flexura.load("examples/rpr/rpr.yaml")
    result = flexura.modes(mechanism, n=6)
    print(result.frequency_hz, result.evidence.complete)

Names are imported on first use, so that `import flexura` stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flexura._version import __version__

if TYPE_CHECKING:
    from flexura.analysis import ActuatorState as ActuatorState
    from flexura.analysis import CheckReport as CheckReport
    from flexura.analysis import Clash as Clash
    from flexura.analysis import ComplianceSpectrum as ComplianceSpectrum
    from flexura.analysis import Doubt as Doubt
    from flexura.analysis import Drift as Drift
    from flexura.analysis import Evidence as Evidence
    from flexura.analysis import Freedom as Freedom
    from flexura.analysis import FrequencyResponse as FrequencyResponse
    from flexura.analysis import Kinetostatics as Kinetostatics
    from flexura.analysis import LeftOut as LeftOut
    from flexura.analysis import MemberStress as MemberStress
    from flexura.analysis import Mode as Mode
    from flexura.analysis import Modes as Modes
    from flexura.analysis import Preload as Preload
    from flexura.analysis import ScrewAxis as ScrewAxis
    from flexura.analysis import SignalFile as SignalFile
    from flexura.analysis import Statics as Statics
    from flexura.analysis import Stresses as Stresses
    from flexura.analysis import TimeResponse as TimeResponse
    from flexura.analysis import check as check
    from flexura.analysis import compliance as compliance
    from flexura.analysis import drift as drift
    from flexura.analysis import frequency_response as frequency_response
    from flexura.analysis import internal_force_rows as internal_force_rows
    from flexura.analysis import kinetostatics as kinetostatics
    from flexura.analysis import member_stresses as member_stresses
    from flexura.analysis import modes as modes
    from flexura.analysis import preload as preload
    from flexura.analysis import read_signals as read_signals
    from flexura.analysis import screw_axis as screw_axis
    from flexura.analysis import signals as signals
    from flexura.analysis import statics as statics
    from flexura.analysis import stress_rows as stress_rows
    from flexura.analysis import tangent_stiffness as tangent_stiffness
    from flexura.analysis import time_response as time_response
    from flexura.errors import Exceeded as Exceeded
    from flexura.errors import ExpressionError as ExpressionError
    from flexura.errors import FlexuraError as FlexuraError
    from flexura.errors import LimitError as LimitError
    from flexura.errors import ModelError as ModelError
    from flexura.errors import OptionError as OptionError
    from flexura.errors import Problem as Problem
    from flexura.errors import SolverError as SolverError
    from flexura.experiment.calibrated import CalibratedMode as CalibratedMode
    from flexura.experiment.calibrated import CalibratedParameter as CalibratedParameter
    from flexura.experiment.calibrated import Calibration as Calibration
    from flexura.experiment.calibrated_file import save_calibrated as save_calibrated
    from flexura.experiment.calibration import calibrate as calibrate
    from flexura.experiment.channel_pairing import ChannelMatch as ChannelMatch
    from flexura.experiment.channel_pairing import ChannelPairing as ChannelPairing
    from flexura.experiment.channel_pairing import UnmatchedChannel as UnmatchedChannel
    from flexura.experiment.channel_pairing import pair_channels as pair_channels
    from flexura.experiment.correlation import Correlation as Correlation
    from flexura.experiment.correlation import ModePair as ModePair
    from flexura.experiment.correlation import correlate as correlate
    from flexura.experiment.criteria import comac as comac
    from flexura.experiment.criteria import frac as frac
    from flexura.experiment.criteria import mac as mac
    from flexura.experiment.data_files import read_measurement as read_measurement
    from flexura.experiment.data_files import write_measurement as write_measurement
    from flexura.experiment.estimation import estimate_frf as estimate_frf
    from flexura.experiment.frequency_list import MeasuredFrequencies as MeasuredFrequencies
    from flexura.experiment.frequency_list import read_frequencies as read_frequencies
    from flexura.experiment.identification import identify as identify
    from flexura.experiment.identified import IdentifiedModes as IdentifiedModes
    from flexura.experiment.identified import ModeEvidence as ModeEvidence
    from flexura.experiment.identified import Poles as Poles
    from flexura.experiment.measurement import MeasuredChannel as MeasuredChannel
    from flexura.experiment.measurement import MeasuredFRF as MeasuredFRF
    from flexura.experiment.measurement import Measurement as Measurement
    from flexura.experiment.measurement import Recording as Recording
    from flexura.experiment.misfit import Misfit as Misfit
    from flexura.experiment.mode_pairing import ModePairing as ModePairing
    from flexura.experiment.mode_pairing import pair_modes as pair_modes
    from flexura.experiment.overlay import FRFOverlay as FRFOverlay
    from flexura.experiment.response_sensitivity import ResponseSensitivities as ResponseSensitivities
    from flexura.experiment.response_sensitivity import response_sensitivities as response_sensitivities
    from flexura.experiment.sensitivity import Sensitivities as Sensitivities
    from flexura.experiment.sensitivity import sensitivities as sensitivities
    from flexura.experiment.sensor_placement import SensorPlacement as SensorPlacement
    from flexura.experiment.sensor_placement import place_sensors as place_sensors
    from flexura.experiment.stand import TrueModes as TrueModes
    from flexura.experiment.virtual_test import FoundMode as FoundMode
    from flexura.experiment.virtual_test import VirtualTest as VirtualTest
    from flexura.experiment.virtual_test import virtual_test as virtual_test
    from flexura.exports import export as export
    from flexura.exports import to_control as to_control
    from flexura.mechanism import CATALOGUE as CATALOGUE
    from flexura.mechanism import DOF_NAMES as DOF_NAMES
    from flexura.mechanism import Accelerometer as Accelerometer
    from flexura.mechanism import BaseMotion as BaseMotion
    from flexura.mechanism import BaseRotation as BaseRotation
    from flexura.mechanism import Box as Box
    from flexura.mechanism import Circle as Circle
    from flexura.mechanism import CircularContour as CircularContour
    from flexura.mechanism import CircularPattern as CircularPattern
    from flexura.mechanism import CornerFilletedContour as CornerFilletedContour
    from flexura.mechanism import Cylinder as Cylinder
    from flexura.mechanism import Damping as Damping
    from flexura.mechanism import DampingBand as DampingBand
    from flexura.mechanism import Dashpot as Dashpot
    from flexura.mechanism import DiagonalDamping as DiagonalDamping
    from flexura.mechanism import DiagonalStiffness as DiagonalStiffness
    from flexura.mechanism import EllipticalContour as EllipticalContour
    from flexura.mechanism import Expression as Expression
    from flexura.mechanism import Flexure as Flexure
    from flexura.mechanism import ForceActuator as ForceActuator
    from flexura.mechanism import ForceSensor as ForceSensor
    from flexura.mechanism import HammerPoint as HammerPoint
    from flexura.mechanism import HyperbolicContour as HyperbolicContour
    from flexura.mechanism import Instance as Instance
    from flexura.mechanism import Leaf as Leaf
    from flexura.mechanism import LinearPattern as LinearPattern
    from flexura.mechanism import Link as Link
    from flexura.mechanism import Load as Load
    from flexura.mechanism import Material as Material
    from flexura.mechanism import Matrix as Matrix
    from flexura.mechanism import Mechanism as Mechanism
    from flexura.mechanism import Meshed as Meshed
    from flexura.mechanism import MirrorPattern as MirrorPattern
    from flexura.mechanism import ModalTest as ModalTest
    from flexura.mechanism import MomentActuator as MomentActuator
    from flexura.mechanism import MotionSensor as MotionSensor
    from flexura.mechanism import Notch as Notch
    from flexura.mechanism import ParabolicContour as ParabolicContour
    from flexura.mechanism import Parameter as Parameter
    from flexura.mechanism import PiezoStack as PiezoStack
    from flexura.mechanism import Plate as Plate
    from flexura.mechanism import PointMass as PointMass
    from flexura.mechanism import Rayleigh as Rayleigh
    from flexura.mechanism import Rectangle as Rectangle
    from flexura.mechanism import Reduction as Reduction
    from flexura.mechanism import RigidBody as RigidBody
    from flexura.mechanism import Rotation as Rotation
    from flexura.mechanism import RoundNotch as RoundNotch
    from flexura.mechanism import SectionConstants as SectionConstants
    from flexura.mechanism import Spring as Spring
    from flexura.mechanism import StraightContour as StraightContour
    from flexura.mechanism import Substructure as Substructure
    from flexura.mechanism import Superelement as Superelement
    from flexura.mechanism import Support as Support
    from flexura.mechanism import TabulatedContour as TabulatedContour
    from flexura.mechanism import Tube as Tube
    from flexura.mechanism import TwoAxisNotch as TwoAxisNotch
    from flexura.mechanism import VShapedContour as VShapedContour
    from flexura.mechanism import parameter as parameter
    from flexura.methods import Comparison as Comparison
    from flexura.methods import ComparisonRow as ComparisonRow
    from flexura.methods import compare as compare
    from flexura.modelfile import dumps as dumps
    from flexura.modelfile import load as load
    from flexura.modelfile import loads as loads
    from flexura.modelfile import save as save
    from flexura.modelfile import schema as schema
    from flexura.reduction import Certificate as Certificate
    from flexura.reduction import LowOrderModel as LowOrderModel
    from flexura.reduction import NaturalFrequencies as NaturalFrequencies
    from flexura.reduction import NestedModel as NestedModel
    from flexura.reduction import certify as certify
    from flexura.reduction import condense as condense
    from flexura.reduction import interface_reduction as interface_reduction
    from flexura.reduction import natural_frequencies as natural_frequencies
    from flexura.reduction import nested as nested
    from flexura.reduction import reduce as reduce
    from flexura.reduction import unproven_frequencies as unproven_frequencies
    from flexura.sizes import size_limits as size_limits
    from flexura.solid.imported import ImportedPart as ImportedPart
    from flexura.solid.imported import imported as imported
    from flexura.solid.parts import with_solid_parts as with_solid_parts
    from flexura.solid.readers import read_ansys as read_ansys
    from flexura.solid.readers import read_calculix as read_calculix
    from flexura.solid.step import write_step as write_step
    from flexura.solid.stored import MatrixEvidence as MatrixEvidence
    from flexura.solid.stored import StoredMatrices as StoredMatrices
    from flexura.solid.verify import SolidRow as SolidRow
    from flexura.solid.verify import Verification as Verification
    from flexura.solid.verify import VerificationRow as VerificationRow
    from flexura.solid.verify import verify as verify
    from flexura.structure import FullOrderModel as FullOrderModel
    from flexura.structure import Plan as Plan
    from flexura.structure import assemble as assemble
    from flexura.systems import Channel as Channel
    from flexura.systems import ComplexModes as ComplexModes
    from flexura.systems import ModalSystem as ModalSystem
    from flexura.systems import Neglected as Neglected
    from flexura.systems import StateSpace as StateSpace
    from flexura.systems import System as System
    from flexura.systems import neglected_bound as neglected_bound
    from flexura.systems import state_space as state_space
    from flexura.systems import system as system
    from flexura.view import draw_bode as draw_bode
    from flexura.view import draw_correlation as draw_correlation
    from flexura.view import draw_doubts as draw_doubts
    from flexura.view import draw_frf_overlay as draw_frf_overlay
    from flexura.view import draw_mechanism as draw_mechanism
    from flexura.view import draw_mode as draw_mode
    from flexura.view import draw_mode_pair as draw_mode_pair
    from flexura.view import draw_nyquist as draw_nyquist
    from flexura.view import draw_response_matrix as draw_response_matrix
    from flexura.view import draw_sensors as draw_sensors
    from flexura.view import draw_shape_pair as draw_shape_pair
    from flexura.view import draw_time as draw_time
    from flexura.view import draw_verification as draw_verification
    from flexura.view import save_correlation as save_correlation
    from flexura.view import save_doubts as save_doubts
    from flexura.view import save_figures as save_figures
    from flexura.view import save_modes as save_modes
    from flexura.view import save_pictures as save_pictures
    from flexura.view import save_verification as save_verification
    from flexura.view.calibration import draw_calibration as draw_calibration
    from flexura.view.identification import draw_stabilisation as draw_stabilisation
    from flexura.view.identification import draw_synthesis as draw_synthesis
    from flexura.view.identification import save_identification as save_identification
    from flexura.view.virtual_test import draw_virtual_test as draw_virtual_test
    from flexura.view.virtual_test import save_virtual_test as save_virtual_test

_EXPORTS = {
    "flexura.analysis": (
        *("ActuatorState", "CheckReport", "Clash", "ComplianceSpectrum", "Doubt", "Drift", "Evidence", "Freedom"),
        "FrequencyResponse",
        *("Kinetostatics", "MemberStress", "Mode", "Modes", "Preload", "ScrewAxis", "SignalFile", "Statics"),
        *("LeftOut", "Stresses", "TimeResponse", "check", "compliance", "drift", "frequency_response"),
        *("internal_force_rows", "kinetostatics", "member_stresses", "modes", "preload", "read_signals"),
        *("screw_axis", "signals", "statics", "stress_rows", "tangent_stiffness", "time_response"),
    ),
    "flexura.errors": (
        *("Exceeded", "ExpressionError", "FlexuraError", "LimitError", "ModelError", "OptionError", "Problem"),
        "SolverError",
    ),
    "flexura.experiment.data_files": ("read_measurement", "write_measurement"),
    "flexura.experiment.estimation": ("estimate_frf",),
    "flexura.experiment.identification": ("identify",),
    "flexura.experiment.identified": ("IdentifiedModes", "ModeEvidence", "Poles"),
    "flexura.experiment.misfit": ("Misfit",),
    "flexura.experiment.measurement": ("MeasuredChannel", "MeasuredFRF", "Measurement", "Recording"),
    "flexura.experiment.calibrated": ("CalibratedMode", "CalibratedParameter", "Calibration"),
    "flexura.experiment.calibrated_file": ("save_calibrated",),
    "flexura.experiment.calibration": ("calibrate",),
    "flexura.experiment.channel_pairing": ("ChannelMatch", "ChannelPairing", "UnmatchedChannel", "pair_channels"),
    "flexura.experiment.correlation": ("Correlation", "ModePair", "correlate"),
    "flexura.experiment.criteria": ("comac", "frac", "mac"),
    "flexura.experiment.frequency_list": ("MeasuredFrequencies", "read_frequencies"),
    "flexura.experiment.mode_pairing": ("ModePairing", "pair_modes"),
    "flexura.experiment.overlay": ("FRFOverlay",),
    "flexura.experiment.response_sensitivity": ("ResponseSensitivities", "response_sensitivities"),
    "flexura.experiment.sensitivity": ("Sensitivities", "sensitivities"),
    "flexura.experiment.sensor_placement": ("SensorPlacement", "place_sensors"),
    "flexura.experiment.stand": ("TrueModes",),
    "flexura.experiment.virtual_test": ("FoundMode", "VirtualTest", "virtual_test"),
    "flexura.exports": ("export", "to_control"),
    "flexura.mechanism": (
        *("CATALOGUE", "DOF_NAMES", "Accelerometer", "BaseMotion", "BaseRotation", "Box", "Circle", "CircularContour"),
        *("CircularPattern", "CornerFilletedContour", "Cylinder", "Damping", "DampingBand", "Dashpot"),
        *("DiagonalDamping", "DiagonalStiffness", "EllipticalContour", "Expression", "Flexure"),
        *("ForceActuator", "ForceSensor", "HammerPoint", "HyperbolicContour", "Instance", "Leaf", "LinearPattern"),
        *("Link", "Load", "Material", "Matrix", "Mechanism", "MirrorPattern", "ModalTest", "MomentActuator"),
        *(
            "Meshed",
            "MotionSensor",
            "Notch",
            "ParabolicContour",
            "Parameter",
            "PiezoStack",
            "Plate",
            "PointMass",
            "Rayleigh",
        ),
        *("Rectangle", "RigidBody", "Rotation", "RoundNotch", "SectionConstants", "Spring", "StraightContour"),
        *("Reduction", "Meshed"),
        *("Substructure", "Superelement", "Support", "TabulatedContour", "Tube", "TwoAxisNotch"),
        *("VShapedContour", "parameter"),
    ),
    "flexura.methods": ("Comparison", "ComparisonRow", "compare"),
    "flexura.modelfile": ("dumps", "load", "loads", "save", "schema"),
    "flexura.reduction": (
        *("Certificate", "LowOrderModel", "NaturalFrequencies", "NestedModel", "certify", "condense"),
        *("interface_reduction", "natural_frequencies", "nested", "reduce", "unproven_frequencies"),
    ),
    "flexura.sizes": ("size_limits",),
    "flexura.solid.imported": ("ImportedPart", "imported"),
    "flexura.solid.parts": ("with_solid_parts",),
    "flexura.solid.readers": ("read_ansys", "read_calculix"),
    "flexura.solid.step": ("write_step",),
    "flexura.solid.stored": ("MatrixEvidence", "StoredMatrices"),
    "flexura.solid.verify": ("SolidRow", "Verification", "VerificationRow", "verify"),
    "flexura.structure": ("FullOrderModel", "Plan", "assemble"),
    "flexura.systems": (
        *(
            "Channel",
            "ComplexModes",
            "ModalSystem",
            "Neglected",
            "StateSpace",
            "System",
            "neglected_bound",
            "state_space",
        ),
        *("system",),
    ),
    "flexura.view": (
        *("draw_bode", "draw_correlation", "draw_doubts", "draw_frf_overlay", "draw_mechanism", "draw_mode"),
        *("draw_nyquist", "draw_response_matrix", "draw_sensors", "draw_shape_pair", "draw_time"),
        *("draw_mode_pair", "draw_verification", "save_correlation", "save_doubts", "save_figures", "save_modes"),
        "save_pictures",
        *("save_verification",),
    ),
    "flexura.view.calibration": ("draw_calibration",),
    "flexura.view.identification": ("draw_stabilisation", "draw_synthesis", "save_identification"),
    "flexura.view.virtual_test": ("draw_virtual_test", "save_virtual_test"),
}
_MODULE_OF = {name: module for module, names in _EXPORTS.items() for name in names}

__all__ = ["__version__", *_MODULE_OF]  # noqa: PLE0604  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'flexura' has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
