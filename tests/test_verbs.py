"""One way to say things: signatures and words of all public verbs, in Python and in the shell."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from typing import get_args, get_type_hints

import flexura
from flexura.cli.app import COMMANDS, loaded
from helpers.over import over
from helpers.public_names import public_names

FUNCTIONS = {name: own for name, own in public_names().items() if inspect.isfunction(own)}
SIGNATURES = {name: inspect.signature(function) for name, function in FUNCTIONS.items()}
VERBS = [name for name, signature in SIGNATURES.items() if "parameters" in signature.parameters]
"""What is asked of a mechanism at values of its parameters."""

LIMITS_BY_NAME = "size_limits"
"""It takes every limit of a table by its name."""

OTHER_WORDS = {
    *("count", "n_modes", "how_many", "below_hz", "announce", "pick", "mechanism_or_plan", "params"),
    *("what", "options", "how", "kwargs", "tol"),
}
"""Words for which there is another one."""

PLAIN = {"help", "as_json", "strict", "set", "at", "plot", "out", "animate", "magnify", "scale", "names", "dpi"}
"""Options of many commands that say where a result goes and how it is drawn (`flexura.view.save_modes`), at which
parameters, or at which pose (`flexura.at`)."""

SHELL = {
    "modes": ((flexura.modes,), set()),
    "check": ((flexura.check, flexura.requirements), {"every"}),  # assumptions that move little are printed, too
    "buckling": ((flexura.preload,), {"n"}),  # so many frequencies and buckling factors are printed
    "compare": ((flexura.compare,), set()),
    "verify": ((flexura.verify,), set()),
    "understand": ((flexura.understand,), set()),
    "statics": ((flexura.statics,), {"node"}),  # whose displacements are printed
    "stroke": ((flexura.stroke,), {"node"}),  # whose displacements are told
    "scheduled-plant": ((flexura.scheduled_plant, flexura.export), set()),
    "constraints": ((flexura.constraints,), set()),
    "free": ((flexura.free,), set()),
    "heat": ((flexura.heat,), set()),
    "kinetostatics": ((flexura.kinetostatics,), set()),
    "frequency-response": ((flexura.frequency_response,), set()),
    "nonlinear-response": ((flexura.nonlinear_response,), set()),
    "backbone": ((flexura.backbone,), set()),
    "budget": ((flexura.budget,), set()),
    "time-response": ((flexura.time_response,), {"step", "hammer", "sweep", "noise", "signals"}),  # as inputs
    "sweep": ((flexura.sweep,), set()),
    "correlate": ((flexura.correlate, flexura.identify, flexura.read_measurement), {"data"}),
    "place-sensors": ((flexura.place_sensors,), set()),
    "sensitivity": ((flexura.sensitivity,), set()),
    "faces": ((flexura.faces,), set()),
    "model": ((flexura.part_model, flexura.modes), set()),
    "published": ((flexura.published,), set()),
    "new": ((), {"name", "schema"}),
    "examples": ((), set()),
    "doctor": ((), set()),
    "tolerance": ((flexura.tolerance,), set()),
    "misalignment": ((flexura.misalignment,), set()),
    "calibrate": ((flexura.calibrate,), {"on", "draws"}),  # which of the data; the draws that are printed
    "optimize": ((flexura.optimize,), set()),
    "design": ((flexura.design,), set()),
    "estimate-frf": (
        (flexura.testing.estimate_frf, flexura.read_measurement),
        {"data", "reciprocity"},  # and whether the outcome of the verb of this name is printed
    ),
    "virtual-test": ((flexura.virtual_test, flexura.view.save_virtual_test), set()),
    "export": (
        (
            flexura.export,
            *(flexura.state_space, flexura.system, flexura.StateSpace.discretised, flexura.observer, flexura.shaper),
            flexura.models.controller_model,
            flexura.budget,
        ),
        {"what"},  # of the things that are exported
    ),
    "identify": ((flexura.identify, flexura.read_measurement), {"data", "reciprocity"}),
    "couple": (
        (flexura.couple, flexura.virtual_points, flexura.frequency_response),
        {"parts"},  # as NAME=FILE
    ),
    "decouple": ((flexura.decouple, flexura.virtual_points, flexura.frequency_response), {"whole", "part"}),
    "virtual-points": ((flexura.virtual_points, flexura.read_measurement), {"data"}),
    "report": ((flexura.report,), set()),
    "schema": ((flexura.schema,), set()),
    "live": ((flexura.live,), set()),
    "view": ((flexura.view.draw_mechanism, flexura.show, flexura.modes), set()),
}
"""By command: the functions whose words its options are, and the options that only a command has."""


@over("name", VERBS)
def test_a_verb_takes_a_model_its_parameters_and_all_else_by_name(name):
    first, second, *others = SIGNATURES[name].parameters.values()
    assert (first.name, second.name) == ("model", "parameters")
    assert first.kind is second.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD
    assert first.default is inspect.Parameter.empty and second.default is None
    assert all(own.kind is inspect.Parameter.KEYWORD_ONLY for own in others)


@over("name", SIGNATURES)
def test_nothing_takes_more_than_two_arguments_by_place_or_arguments_without_a_name(name):
    kinds = [own.kind for own in SIGNATURES[name].parameters.values()]
    assert inspect.Parameter.VAR_POSITIONAL not in kinds
    assert (inspect.Parameter.VAR_KEYWORD in kinds) == (name == LIMITS_BY_NAME)
    assert kinds.count(inspect.Parameter.POSITIONAL_OR_KEYWORD) <= 2


@over("name", SIGNATURES)
def test_words(name):
    parameters = SIGNATURES[name].parameters
    assert not OTHER_WORDS & parameters.keys()
    types = {key: str(own.annotation) for key, own in parameters.items()}
    for key, kind in {
        "n": "int",
        "tolerance": "float",
        "up_to": "float",
        "seed": "int",
        "progress": "Listener",
    }.items():
        assert types.get(key, kind).split(" | ")[0] == kind


@over("name", VERBS)
def test_a_verb_says_what_it_raises(name):
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    assert "Raises" in text and "Error" in text


def test_every_command_is_in_the_table():
    assert SHELL.keys() == COMMANDS.keys()


@over("command", COMMANDS)
def test_the_shell_has_the_words_of_python(command):
    """An option that may be repeated is the singular of the argument."""
    functions, own = SHELL[command]
    known = {word for function in functions for word in inspect.signature(function).parameters}
    for option in loaded(command).params:
        word = str(option.name)
        if word in PLAIN | own | {"file"}:
            continue
        assert word in known or f"{word}s" in known, word
        long = max(option.opts, key=len)
        assert long.lstrip("-").replace("-", "_") in (word, word.removesuffix("s")), long


@over("command", COMMANDS)
def test_no_option_takes_a_quantity_as_a_bare_number(command):
    """Numbers of an option are ratios, relative errors and counts; its text says so."""
    about = {option.name: f"{option.metavar} {getattr(option, 'help', '')}" for option in loaded(command).params}
    own = COMMANDS[command]
    hints = get_type_hints(getattr(import_module(f"flexura.cli.{own.module}"), own.function))
    for name in (name for name, hint in hints.items() if float in (hint, *get_args(hint))):
        assert re.search(r"REL|RATIO|FACTOR|relative|confidence|its value at the end", about[name]), about[name]
