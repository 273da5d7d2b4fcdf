"""Checks of names: every reference leads somewhere, and no name means two things."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from fnmatch import translate

from flexura.errors import Path, Problem
from flexura.mechanism.body import RigidBody
from flexura.mechanism.channels import ForceActuator, ForceSensor, MotionSensor, PiezoStack, StrainActuator
from flexura.mechanism.checks.controllers import check_controllers
from flexura.mechanism.checks.disturbances import check_disturbances
from flexura.mechanism.checks.survey import Survey, Use, number_of_copies, prefix, suggestion
from flexura.mechanism.description import Mechanism, Substructure
from flexura.mechanism.instances import origin_of
from flexura.mechanism.layout import TOP, is_pattern
from flexura.mechanism.loads import COMMANDS, DISPLACEMENTS, Moved, Prescribed, command_of
from flexura.mechanism.material import CATALOGUE
from flexura.mechanism.member import Link
from flexura.mechanism.section import Layered


def check_references(survey: Survey) -> None:
    """Report unknown and ambiguous names, and note which nodes every part uses."""
    for name, material in survey.layout.mechanism.materials.items():
        if isinstance(material, str) and material not in CATALOGUE:
            hint = suggestion(material, CATALOGUE, "materials of the catalogue")
            survey.report(("materials", name), material, "the catalogue has no such material", hint)
    _materials_and_sections(survey)
    for name in survey.layout.prototypes:
        _names_used_twice(survey, name)
        nodes = _Nodes(survey, name)
        survey.uses[name] = [*_between_nodes(survey, name, nodes), *_bodies(survey, name, nodes)]
        _interface(survey, name, nodes)
    nodes = _Nodes(survey, TOP)
    for what in (_ground, _loads, _pose_and_motion, _test):
        survey.uses[TOP] += what(survey, nodes)
    check_disturbances(survey, nodes.exposed)
    check_controllers(survey, nodes.exposed)


class _Nodes:
    """Resolves the node references of one prototype, reporting those that lead nowhere."""

    def __init__(self, survey: Survey, prototype: str) -> None:
        self.survey, self.prototype = survey, prototype
        self.exposed = dict.fromkeys(survey.layout.exposed(prototype))
        self.children = {child.name: child.prototype for child in survey.layout.children[prototype]}
        self.lost = survey.lost[origin_of(prototype)]

    def find(self, path: Path, text: str, wild: bool = False) -> list[str]:
        """Nodes that a reference stands for; none when there are none, or none that can be known."""
        if text in self.exposed:
            return [text]
        if wild and is_pattern(text):
            found = self.matches(text)
            if not found and not self.survey.partial and not self.lost:
                self.survey.report(path, text, "no node matches this pattern", self._hint(text))
            return found
        if not self._excused(text):
            self.survey.report(path, text, "there is no such node here", self._hint(text))
        return []

    def matches(self, text: str) -> list[str]:
        """Nodes that a reference or pattern stands for, unknown ones without a word."""
        if not is_pattern(text):
            return [text] if text in self.exposed else []
        matches = re.compile(translate(text)).match
        return [name for name in self.exposed if matches(name)]

    def _excused(self, text: str) -> bool:
        """True when the node is missing because of something that was reported before."""
        head, _, rest = text.partition(".")
        lost, ignored = self.lost, self.survey.ignored
        heads = {head, head.rstrip("0123456789")}
        below = {rest, *rest.split(".")} if rest else set()
        return bool(heads & lost or text in ignored or any(name in ignored for name in heads | below))

    def _hint(self, text: str) -> str:
        head, _, node = text.partition(".")
        if is_pattern(text):
            return suggestion(text.replace("*", ""), self.exposed, "nodes")
        prototypes = self.survey.layout.prototypes
        if node and head in self.children and node in self.survey.layout.exposed(self.children[head]):
            return f"add {node} to the interface of substructure {self.children[head]}"
        instance = prototypes[self.prototype].instances.get(head)
        if instance is not None and instance.pattern:
            return f"the copies of {head} are {head}1, {head}2, ...: write {head}1.{node or 'NODE'}"
        if instance is not None and not node:
            inside = prototypes[self.children[head]].interface[:12]
            return f"{head} is an instance; its nodes: {', '.join(f'{head}.{n}' for n in inside)}"
        return suggestion(text, self.exposed, "nodes")


def _materials_and_sections(survey: Survey) -> None:
    """Report every material and section that is missing once, where it is first used."""
    mechanism = survey.layout.mechanism
    materials, sections = _Uses(), _Uses()
    for name, prototype in survey.layout.prototypes.items():
        for kind, key, member in prototype.members():
            path = (*prefix(name), kind, key)
            materials.add(member.material, path, "material")
            for k, layer in enumerate(getattr(getattr(member, "profile", None), "layers", ())):
                materials.add(layer.material or member.material, path, "profile", "layers", k, "material")
            if isinstance(member, Link) and isinstance(member.section, str):
                sections.add(member.section, path, "section")
        for kind in ("diaphragms", "flat_springs"):
            for key, sheet in getattr(prototype, kind).items():
                materials.add(sheet.material, (*prefix(name), kind, key), "material")
        for key, body in prototype.bodies.items():
            if body.solid is not None:
                materials.add(body.solid.material, (*prefix(name), "bodies", key), "solid", "material")
    for uses, known, what in (
        (materials, [*mechanism.materials, *CATALOGUE], "material"),
        (sections, list(mechanism.sections), "section"),
    ):
        defined = set(known)
        for missing in uses.of:
            if missing not in defined and missing not in survey.ignored:
                hint = suggestion(missing, known, f"{what}s")
                survey.report(uses.first[missing], missing, f"there is no such {what}{uses.elsewhere(missing)}", hint)


MOST_NAMED = 3
"""Places that are named beside the first one at which something is missing."""


class _Uses:
    """Where each of some names is used: the parts that do, and the path of the first use."""

    def __init__(self) -> None:
        self.of: dict[str, list[Path]] = {}
        self.first: dict[str, Path] = {}

    def add(self, name: str, part: Path, *keys: str | int) -> None:
        """Note that the part at a path names it, at some keys of its own."""
        if part not in self.of.setdefault(name, []):
            self.of[name].append(part)
        self.first.setdefault(name, (*part, *keys))

    def elsewhere(self, name: str) -> str:
        """The uses of a name after the first, in words."""
        others = [".".join(map(str, part)) for part in self.of[name][1:]]
        if not others:
            return ""
        more = len(others) - MOST_NAMED
        return f"; also used in {', '.join(others[:MOST_NAMED])}" + (f" and {more} more" if more > 0 else "")


def check_parts(mechanism: Mechanism, ignored: Collection[str]) -> list[Problem]:
    """Parts whose names instances have, or whose materials there are not."""
    found = []
    known = [*mechanism.materials, *CATALOGUE]
    for name, holder in (("", mechanism), *mechanism.substructures.items()):
        for key, part in holder.parts.items():
            path = (*prefix(name), "parts", key)
            if key in holder.instances:  # what else has the name is found where instances are
                found.append(Problem(path, "", f"the name {key} is taken by an instance", "choose another name"))
            materials = [(("material",), part.material)]
            materials += [(("solids", solid), material) for solid, material in part.solids.items()]
            for place, material in materials:
                if material not in known and material not in ignored:
                    hint = suggestion(material, known, "materials")
                    found.append(Problem((*path, *place), material, "there is no such material", hint))
    return found


def _names_used_twice(survey: Survey, name: str) -> None:
    prototype = survey.layout.prototypes[name]
    owners: dict[str, str] = dict.fromkeys(prototype.nodes, "a node")
    for body in prototype.bodies:
        if body in owners:
            rule = f"the name {body} is taken by {owners[body]}"
            survey.report((*prefix(name), "bodies", body), "", rule, "a body is a node too: choose another name")
        owners[body] = "a body"
    for key, instance in prototype.instances.items():
        copies = [f"{key}{k + 1}" for k in range(number_of_copies(instance))] if instance.pattern else [key]
        taken = [copy for copy in copies if copy in owners]
        if taken:
            what = f"the name of its copy {taken[0]}" if instance.pattern else f"the name {key}"
            path = (*prefix(name), "instances", key)
            survey.report(path, "", f"{what} is taken by {owners[taken[0]]}", "choose another name")
        owners |= dict.fromkeys(copies, "an instance")


def _between_nodes(survey: Survey, name: str, nodes: _Nodes) -> Iterator[Use]:
    """Members, diaphragms, springs, superelements, masses and joints."""
    prototype = survey.layout.prototypes[name]
    for kind in ("links", "flexures", "diaphragms", "flat_springs", "springs", "superelements"):
        for key, part in getattr(prototype, kind).items():
            path = (*prefix(name), kind, key)
            keys = [("pads", text) if kind == "flat_springs" else ("nodes", i) for i, text in enumerate(part.nodes)]
            found = [n for place, text in zip(keys, part.nodes, strict=True) for n in nodes.find((*path, *place), text)]
            if len(set(part.nodes)) < len(part.nodes):
                twice = next(n for n in part.nodes if part.nodes.count(n) > 1)
                survey.report((*path, "nodes"), ", ".join(part.nodes), f"the node {twice} is named twice")
            yield Use(path, found, joins=True)
    yield from _channels(survey, name, nodes)
    for key, mass in prototype.masses.items():
        path = (*prefix(name), "masses", key)
        yield Use(path, nodes.find((*path, "node"), mass.node), joins=False)
    for i, pair in enumerate(prototype.joints):
        path = (*prefix(name), "joints", i)
        if pair[0] == pair[1]:
            survey.report(path, ", ".join(pair), "a joint ties two different nodes together")
        yield Use(path, [n for k, text in enumerate(pair) for n in nodes.find((*path, k), text)], joins=True)


def _channels(survey: Survey, name: str, nodes: _Nodes) -> Iterator[Use]:
    """Dashpots, stops, actuators and sensors."""
    prototype = survey.layout.prototypes[name]
    for kind in ("dashpots", "stops", "actuators", "sensors"):
        for key, part in getattr(prototype, kind).items():
            path = (*prefix(name), kind, key)
            if isinstance(part, ForceSensor):
                _sensed_actuator(survey, name, path, part)
            if isinstance(part, StrainActuator):
                _driven_member(survey, name, path, part)
            names = getattr(part, "nodes", ())
            found = [n for i, text in enumerate(names) for n in nodes.find((*path, "nodes", i), text)]
            if len(names) == 2 and names[0] == names[1]:
                survey.report((*path, "nodes"), ", ".join(names), f"the node {names[0]} is named twice")
            yield Use(path, found, joins=isinstance(part, PiezoStack))


def _sensed_actuator(survey: Survey, name: str, path: Path, sensor: ForceSensor) -> None:
    actuators = survey.layout.prototypes[name].actuators
    actuator = actuators.get(sensor.actuator)
    if actuator is None and sensor.actuator not in survey.ignored:
        known = [*actuators, *survey.ignored] if survey.partial else actuators
        hint = suggestion(sensor.actuator, known, "actuators")
        survey.report((*path, "actuator"), sensor.actuator, "there is no such actuator here", hint)
    elif actuator is not None and not isinstance(actuator, PiezoStack | ForceActuator):
        rule = f"the actuator {sensor.actuator} of type {actuator.type} exerts no force that could be read"
        survey.report((*path, "actuator"), sensor.actuator, rule, "name a piezo stack or a force")


def _driven_member(survey: Survey, name: str, path: Path, actuator: StrainActuator) -> None:
    """Report a member that is not there, or that has no layers of free strain."""
    flexures, mechanism = survey.layout.prototypes[name].flexures, survey.layout.mechanism
    member = flexures.get(actuator.member)
    layers = member.profile.layers if member is not None and isinstance(member.profile, Layered) else ()
    if member is None:
        if actuator.member not in survey.ignored:
            hint = suggestion(actuator.member, flexures, "flexures")
            survey.report((*path, "member"), actuator.member, "there is no such flexure here", hint)
    elif not layers:
        hint = "its profile has the type layered"
        survey.report((*path, "member"), actuator.member, "only layers have a free strain", hint)
    elif actuator.by == "voltage" and not any(layer.free_strain for layer in layers):
        hint = "give one of them free_strain, in 1/V"
        survey.report((*path, "member"), actuator.member, "none of its layers has a free strain", hint)
    elif actuator.by == "temperature" and not any(
        mechanism.material(own).expansion
        for layer in layers
        if (own := layer.material or member.material) in mechanism.materials
    ):
        hint = "give their materials an expansion, in 1/K"
        survey.report((*path, "member"), actuator.member, "none of its layers is known to expand", hint)


def _bodies(survey: Survey, name: str, nodes: _Nodes) -> Iterator[Use]:
    carrier: dict[str, str] = {}
    shared: set[str] = set()
    described = survey.layout.prototypes[name].bodies
    for key, body in survey.layout.prototypes[name].bodies.items():
        path = (*prefix(name), "bodies", key)
        carried: list[str] = []
        for i, text in enumerate(body.carries):
            for node in nodes.find((*path, "carries", i), text, wild=True):
                if node == key:
                    hint = "the node at its centre belongs to the body anyway; name the others"
                    survey.report((*path, "carries", i), text, f"the body carries its own node {key}", hint)
                elif node in carrier and carrier[node] != key and _share(described, node, key, carrier[node], shared):
                    carried.append(node)
                elif node in carrier:
                    again = "this body" if carrier[node] == key else f"body {carrier[node]}"
                    survey.report((*path, "carries", i), text, f"the node {node} is already carried by {again}")
                else:
                    carrier[node] = key
                    carried.append(node)
        yield Use(path, [key, *carried], joins=True)
    _carried_in_a_circle(survey, name, carrier, survey.layout.prototypes[name].bodies)


def _share(bodies: dict[str, RigidBody], node: str, one: str, other: str, shared: set[str]) -> bool:
    """Whether two bodies may carry a node, which is on a face of both: both bend, and no third one carries it."""
    may = node not in shared and node not in bodies and bodies[one].may_bend and bodies[other].may_bend
    shared.add(node)
    return may


def _carried_in_a_circle(survey: Survey, name: str, carrier: dict[str, str], bodies: dict[str, RigidBody]) -> None:
    done: set[str] = set()
    for start in bodies:
        chain = [start]
        while chain[-1] in carrier and chain[-1] not in done:
            done.add(chain[-1])
            chain.append(carrier[chain[-1]])
            if chain[-1] == start:
                text = " -> ".join(chain)
                survey.report((*prefix(name), "bodies", start, "carries"), text, "bodies carry each other in a circle")
                break


def _interface(survey: Survey, name: str, nodes: _Nodes) -> None:
    interface = survey.layout.prototypes[name].interface
    for i, text in enumerate(interface):
        path = (*prefix(name), "interface", i)
        nodes.find(path, text)
        if text in interface[:i]:
            survey.report(path, text, "this node is already in the interface")


def _ground(survey: Survey, nodes: _Nodes) -> Iterator[Use]:
    holder: dict[str, str] = {}
    for text in survey.layout.mechanism.ground:
        path = ("ground", text)
        found = nodes.find(path, text, wild=True)
        for node in found:
            if node in holder:
                hint = "give one support with all the DOFs it holds"
                survey.report(path, text, f"the node {node} is already held by {holder[node]}", hint)
            holder.setdefault(node, text)
        yield Use(path, found, joins=False)
    _still_channels(survey, holder)


def _loads(survey: Survey, nodes: _Nodes) -> Iterator[Use]:
    mechanism = survey.layout.mechanism
    clamped = {n for text, support in mechanism.ground.items() if all(support.held) for n in nodes.matches(text)}
    loaded: dict[str, str] = {}
    for text in mechanism.loads:
        path = ("loads", text)
        found = nodes.find(path, text, wild=True)
        for node in found:
            if node in loaded:
                hint = "give one load with all its forces and moments"
                survey.report(path, text, f"the node {node} is already loaded by {loaded[node]}", hint)
            loaded.setdefault(node, text)
        idle = [node for node in found if node in clamped]
        if idle and len(idle) == len(found):
            survey.report(path, text, f"nothing can move here: {idle[0]} is clamped", "load a node that is free")
        yield Use(path, found, joins=False)


def _pose_and_motion(survey: Survey, nodes: _Nodes) -> Iterator[Use]:
    mechanism, motion = survey.layout.mechanism, survey.layout.mechanism.motion
    for name in mechanism.temperatures.keys() & survey.layout.actuators().keys():
        survey.report(
            ("temperatures", name), name, "an actuator has this name", "a state of temperature is a command too"
        )
    yield from _prescribed(survey, nodes, ("at",), mechanism.at)
    if motion is None:
        return
    yield from _prescribed(survey, nodes, ("motion", "move"), motion.move)
    places: list[tuple[Path, str]] = [(("motion", "loads", text), text) for text in motion.loads]
    places += [(("motion", "follower", text), text) for text in motion.follower]
    places += [(("motion", "nodes", k), text) for k, text in enumerate(motion.nodes)]
    for path, text in places:
        yield Use(path, nodes.find(path, text), joins=False)


def _prescribed(survey: Survey, nodes: _Nodes, at: Path, entries: Mapping[str, Prescribed | Moved]) -> Iterator[Use]:
    """Nodes that are moved, and actuators with a command."""
    mechanism, actuators = survey.layout.mechanism, survey.layout.actuators()
    held = {n: s.held for text, s in mechanism.ground.items() for n in nodes.matches(text)}
    for text, entry in entries.items():
        path, given = (*at, text), entry.given
        if given[0] in COMMANDS:
            driven = survey.layout.commanded(text)
            if not driven:
                survey.report(path, text, "there is no such actuator", suggestion(text, actuators, "actuators"))
            for name, own in driven.items():
                command = command_of(own)
                if command != given[0]:
                    hint = f"its command is {command}" if command else "the base is at rest at a pose"
                    survey.report((*path, given[0]), text, f"{name} has no command of this kind", hint)
            continue
        found = nodes.find(path, text)
        for axis, is_held in zip(DISPLACEMENTS, held.get(text, ()), strict=False):
            if is_held and axis in given:
                survey.report((*path, axis), text, "it cannot move here: it is held", "move what is free")
        yield Use(path, found, joins=False)


def _still_channels(survey: Survey, holder: dict[str, str]) -> None:
    """Report actuators and sensors of the mechanism itself at nodes that are held in their direction."""
    mechanism = survey.layout.mechanism
    for kind in ("actuators", "sensors"):
        for key, part in getattr(mechanism, kind).items():
            direction = getattr(part, "direction", None)
            still = {text for text in getattr(part, "nodes", ()) if text in holder}
            if not still or len(still) < len(part.nodes):
                continue
            turns = 3 * part.type.startswith(("moment", "rotation", "angular"))
            axes = [turns + k for k in range(3) if direction is None or direction[k] != 0]
            if all(mechanism.ground[holder[n]].held[k] for n in still for k in axes):
                rule = f"nothing can move here: {' and '.join(sorted(still))} held in this direction"
                survey.report((kind, key), "", rule, "name a node that is free in this direction")


def check_not_empty(survey: Survey) -> None:
    """Report a mechanism in which nothing has stiffness or inertia."""
    kinds = ("links", "flexures", "diaphragms", "flat_springs", "springs", "superelements", "bodies")
    used = {TOP} if _has(survey.layout.prototypes[TOP], kinds) else {n for _, n in survey.layout.instances()}
    if not any(_has(survey.layout.prototypes[name], kinds) for name in used):
        hint = "describe at least one link, flexure, diaphragm, flat spring, spring, superelement, body or piezo stack"
        survey.report((), "", "there is nothing here that can move", hint)


def _has(prototype: Substructure, kinds: tuple[str, ...]) -> bool:
    stacks = any(isinstance(actuator, PiezoStack) for actuator in prototype.actuators.values())
    return stacks or any(getattr(prototype, kind) for kind in kinds)


_TYPES = ("force", "acceleration")


def _test(survey: Survey, nodes: _Nodes) -> Iterator[Use]:
    """Nodes of a modal test; reports actuators, sensors and accelerometers of it that are not there."""
    test = survey.layout.mechanism.test
    if test is None:
        return
    for group, points, kind in (
        ("hammer", test.hammer, "actuators"),
        ("accelerometers", test.accelerometers, "sensors"),
    ):
        for key, point in points.items():
            path: Path = ("test", group, key)
            if isinstance(point, str):
                _test_channel(survey, path, point, kind)
            else:
                yield Use(path, nodes.find((*path, "node"), point.node), joins=False)
    for key, members in test.placements.items():
        for i, member in enumerate(members):
            if member not in test.accelerometers:
                hint = suggestion(member, test.accelerometers, "accelerometers")
                survey.report(("test", "placements", key, i), member, "the test has no such accelerometer", hint)


def _test_channel(survey: Survey, path: Path, name: str, kind: str) -> None:
    """Report a name that is no force, or no sensor of acceleration at one node, of the mechanism or an instance."""
    what = "a force at one node" if kind == "actuators" else "a sensor of acceleration at one node"
    *inside, key = name.split(".")
    known: dict[str, object] = {}
    for place, prototype in survey.layout.instances() if inside else [((), "")]:
        channels = getattr(survey.layout.prototypes[prototype], kind)
        known |= {".".join((*place, k)): part for k, part in channels.items()}
    found = known.get(name)
    if found is None:
        if key not in survey.ignored and not (set(inside) & survey.lost[""]):
            survey.report(path, name, f"this is the name of none of the {kind}", suggestion(name, known, kind))
    elif (
        not isinstance(found, ForceActuator | MotionSensor)
        or len(found.nodes) > 1
        or found.type not in ("force", "acceleration")
    ):
        survey.report(path, name, f"{what} is expected here", "or a mapping with node and direction")
