"""flexura: low-order dynamic models of flexure-based compliant mechanisms, with evidence for every number.

    import flexura

    mechanism = flexura.load("examples/rpr/rpr.yaml")
    result = flexura.modes(mechanism, n=6)
    print(result.frequency_hz, result.evidence.complete)

Verbs and results are here, what a mechanism is described with is in `flexura.describe`, pictures are in `flexura.view`.
Names are imported on first use, so that `import flexura` stays quick.
"""

from flexura.lazy import face

face(__name__, former={"Doubt": "Diagnostic", "Exceeded": "Diagnostic"})
