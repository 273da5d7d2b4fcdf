"""The group of commands; the module of a command is imported when it is called or its own help is asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any, NamedTuple, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from flexura._version import __version__
from flexura.cli.guard import run
from flexura.lazy import plugins


class _Command(NamedTuple):
    """Where a command is, and what the help of the group says of it: the first line of its own help."""

    module: str
    function: str
    line: str


COMMANDS = {
    "new": _Command(
        "gallery", "new_command", "Write a file of a mechanism to change into your own, or list those that there are."
    ),
    "examples": _Command(
        "gallery", "examples_command", "List the mechanisms of the gallery, or write all of their files."
    ),
    "doctor": _Command(
        "gallery",
        "doctor_command",
        "List which optional parts are installed, what they are for, and how to get the others.",
    ),
    "modes": _Command(
        "modes",
        "modes_command",
        "Natural frequencies and mode shapes, low-order and full-order side by side, with evidence.",
    ),
    "check": _Command(
        "description",
        "check_command",
        "Summary of a mechanism file, and warnings: what may not be meant, and what moves a frequency by 1 % or more.",
    ),
    "buckling": _Command(
        "modes",
        "buckling_command",
        "Axial forces, frequencies about the state under gravity and dead loads, and the load at which it buckles.",
    ),
    "published": _Command(
        "modes",
        "published_command",
        "What a mechanism has beside the numbers that papers, handbooks and closed forms give for it.",
    ),
    "compare": _Command(
        "modes",
        "compare_command",
        "Natural frequencies by every method, with their errors against the exact ones and their times.",
    ),
    "understand": _Command(
        "drawings",
        "understand_command",
        "A drawing (DXF, SVG) of a planar part as a mechanism of flexures and bodies, beside its own solid.",
    ),
    "verify": _Command(
        "verification",
        "verify_command",
        "Beam models, plain and corrected, against solid finite elements of the same mechanism, mode by mode.",
    ),
    "statics": _Command(
        "response",
        "statics_command",
        "Static response to loads, gravity and actuators: displacements, readings, forces, and what yields first.",
    ),
    "stroke": _Command(
        "response",
        "stroke_command",
        "A mechanism over its stroke, however far: equilibria, frequencies, drive forces and support stiffness.",
    ),
    "scheduled-plant": _Command(
        "response",
        "scheduled_plant_command",
        "A gain-scheduled plant (LPV): state spaces along the stroke of one displacement, with errors between poses.",
    ),
    "constraints": _Command(
        "response",
        "constraints_command",
        "Freedoms, constraints and over-constraints: who competes with whom, and what would make it exact.",
    ),
    "free": _Command(
        "response",
        "free_command",
        "Freedom and constraint spaces of bodies as screws, named, with how pure they are in energy and compliance.",
    ),
    "heat": _Command(
        "response",
        "heat_command",
        "What temperatures do: drift of points, stress, buckling and frequencies, and how soon they are reached.",
    ),
    "kinetostatics": _Command(
        "response",
        "kinetostatics_command",
        "How actuators move a platform: freedoms and their screw axes, coupling, amplification, stiffness, workspace.",
    ),
    "frequency-response": _Command(
        "response", "frequency_response_command", "Frequency response between actuators and sensors, or any DOFs."
    ),
    "nonlinear-response": _Command(
        "response",
        "nonlinear_response_command",
        "Steady response with large displacements to a sine at named inputs, over a band of frequencies, Hz.",
    ),
    "backbone": _Command(
        "response",
        "backbone_command",
        "The backbone curve of a mode: its frequency over the amplitude, with large displacements and no damping.",
    ),
    "budget": _Command(
        "response",
        "budget_command",
        "Dynamic error budget: RMS and 3 sigma of outputs under the disturbances described, by source and by mode.",
    ),
    "time-response": _Command(
        "response",
        "time_response_command",
        "Time response to signals at actuators or any DOFs, exact for signals that are linear or held between samples.",
    ),
    "sweep": _Command(
        "studies",
        "sweep_command",
        "Many designs of a mechanism: a grid or a sample of parameters, and quantities of each, as a table.",
    ),
    "correlate": _Command(
        "testing",
        "correlate_command",
        "Test against model: pairs of modes with MAC and frequency error, channels that disagree, FRFs, pictures.",
    ),
    "place-sensors": _Command(
        "testing",
        "place_sensors_command",
        "The best places for so many sensors among the candidates, by effective independence.",
    ),
    "sensitivity": _Command(
        "studies",
        "sensitivity_command",
        "What a per cent of every parameter does to every quantity.",
    ),
    "tolerance": _Command(
        "studies",
        "tolerance_command",
        "What tolerances do: spread, share of good parts, worst case, and which tolerance to tighten first.",
    ),
    "misalignment": _Command(
        "studies",
        "misalignment_command",
        "What mountings that are off by tolerances do: assembly loads, frequencies, buckling, stress and support.",
    ),
    "calibrate": _Command(
        "testing",
        "calibrate_command",
        "Parameters with which the mechanism meets a measurement, and their uncertainties.",
    ),
    "optimize": _Command(
        "studies",
        "optimize_command",
        "The best design under limits, its active limits and what relaxing them would gain, proven at full order.",
    ),
    "design": _Command(
        "studies",
        "design_command",
        "From wished freedoms to mechanisms: every topology of limbs that leaves them free, sized, best first.",
    ),
    "estimate-frf": _Command(
        "testing",
        "estimate_frf_command",
        "Frequency responses from hits: windows, averages, coherence; bad records are named and left out.",
    ),
    "couple": _Command(
        "substructuring",
        "couple_command",
        "Parts coupled to one assembly by their frequency responses, measured or computed.",
    ),
    "decouple": _Command(
        "substructuring",
        "decouple_command",
        "What is left of a whole when a part of it is taken out, by their frequency responses.",
    ),
    "virtual-points": _Command(
        "substructuring",
        "virtual_points_command",
        "Responses at virtual points in the place of the channels around them, by least squares.",
    ),
    "virtual-test": _Command(
        "testing",
        "virtual_test_command",
        "Simulate the hammer test that a file describes, identify its modes, and compare them with the truth.",
    ),
    "export": _Command(
        "handover",
        "export_command",
        "Write a state space (full-order, static gain kept), matrices, modes or responses for other tools.",
    ),
    "identify": _Command(
        "testing",
        "identify_command",
        "Modes of a test: frequencies, damping, complexity of shapes, and the confidence in each.",
    ),
    "report": _Command(
        "handover",
        "report_command",
        "One page about a mechanism: modes that move, freedoms, stroke, responses, stress, with all evidence.",
    ),
    "faces": _Command(
        "parts",
        "faces_command",
        "Faces of a part from CAD or a mesh: number, name, colour, kind and place of each, and what chooses it.",
    ),
    "model": _Command(
        "parts",
        "model_command",
        "A part from CAD or a mesh as a certified low-order model, with its modes: mechanism file, report, or export.",
    ),
    "schema": _Command(
        "description", "schema_command", "Print the JSON Schema of mechanism files, for completion in editors."
    ),
    "live": _Command(
        "handover",
        "live_command",
        "A page on this machine: a mechanism whose parameters are sliders, or a test whose modes are picked.",
    ),
    "view": _Command(
        "description",
        "view_command",
        "Draw the mechanism, undeformed or at a pose, or show it in three dimensions with its modes.",
    ),
}
"""The commands by name."""


def loaded(name: str) -> Any:
    """A command with its arguments and options."""
    own = COMMANDS.get(name)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    here = None if own is None else getattr(import_module(f"flexura.cli.{own.module}"), own.function)
    alone.command(name)(here or plugins("commands")[name])
    return typer.main.get_command(alone)


class _Group(TyperGroup):
    """Commands that are imported when they are called, and whose common options may stand anywhere."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = {name: TyperCommand(name, short_help=own.line) for name, own in COMMANDS.items()}

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *plugins("commands")]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """One of these, or else of a plug-in."""
        known = super().get_command(ctx, cmd_name)
        return loaded(cmd_name) if known is None and cmd_name in plugins("commands") else known

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command itself in place of the line that the help shows of it."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, loaded(str(name)), rest

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Move the common options to the front."""
        end = args.index("--") if "--" in args else len(args)
        front: list[str] = []
        rest: list[str] = []
        before_end = iter(args[:end])
        for text in before_end:
            if text == "--limit":
                front += [text, next(before_end, "")]
            elif text == "--traceback" or text.startswith("--limit="):
                front.append(text)
            else:
                rest.append(text)
        return super().parse_args(ctx, [*front, *rest, *args[end:]])


app: typer.Typer = typer.Typer(
    name="flexura",
    cls=_Group,
    help="Low-order dynamic models of flexure-based compliant mechanisms, with evidence for every number.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"flexura {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Let input be larger, e.g. --limit nodes=1e6. May be repeated."),
    ] = None,
    traceback: Annotated[bool, typer.Option("--traceback", help="Show where an unforeseen error comes from.")] = False,
) -> None:
    del version, traceback  # the guard around the commands looks for it
    from flexura.cli.options import stages_shown
    from flexura.sizes import parsed_limits, size_limits

    context.with_resource(size_limits(**parsed_limits(limit or [])))
    context.with_resource(stages_shown())


def main() -> NoReturn:
    """Run the command line; errors go to stderr, with the exit statuses of `flexura.cli.guard`."""
    raise SystemExit(run(lambda: app(standalone_mode=False)))
