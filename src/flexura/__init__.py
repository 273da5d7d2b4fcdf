"""flexura: low-order dynamic models of flexure-based compliant mechanisms, with evidence for every number.

    import flexura

    mechanism = flexura.load("examples/rpr/rpr.yaml")
    result = flexura.modes(mechanism, n=6)
    print(result.frequency_hz, result.evidence.complete)

Verbs and results are here, what a mechanism is described with is in `flexura.describe`, pictures are in `flexura.view`,
what is done with models and matrices in `flexura.models`, and classes of which results are made in `flexura.types`.
Names are imported on first use, so that `import flexura` stays quick.
"""

from flexura.lazy import face

_MOVED = {
    "models": (
        "Drift ModeSensitivities ResponseSensitivities certify condense drift interface_reduction "
        "internal_force_rows member_stresses mode_sensitivities neglected_bound nested response_sensitivities "
        "screw_axis stress_rows tangent_stiffness "
    ),
    "testing": "estimate_frf read_frequencies save_calibrated",
    "types": (
        "ActuatorState Answers Channel Clash ComparisonRow ComplexModes ComplianceSpectrum Evidence Formula "
        "Freedom LeftOut MemberStress Mode Neglected NestedModel Problem Quantity Relation ScrewAxis "
        "SignalFile Slopes StrokePose WholeVerification "
    ),
}
"""Names that were at the top before, by the namespace that they are in now."""

_PLACES = {name: f"{place}.{name}" for place, names in _MOVED.items() for name in names.split()}

face(__name__, former={"Doubt": "Diagnostic", "Exceeded": "Diagnostic", **_PLACES})
