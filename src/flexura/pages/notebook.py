"""Sliders of a mechanism in a notebook, in Jupyter, VS Code or marimo by anywidget: what they ask and are told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from flexura.arguments import verb
from flexura.errors import OptionError, need
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism
from flexura.pages.live import MOST_MODES, Ask, Described, Designs, FollowedModes, Shown, Slider, notes_of, told
from flexura.pages.viewer import bundle
from flexura.records import Kept
from flexura.structure import Plan
from flexura.tables import counted

Reply = str | bytes

MOST_VIEWS = 4
"""Views of a widget that are answered without beginning anew."""


class _View:
    """One of the places where the widget is shown, with what it asked for last."""

    def __init__(self, designs: Designs) -> None:
        self.designs = designs
        self.asked = Ask(type="design", serial=0, values={})
        self._shown: Shown | None = None

    def picture(self, scene: bytes) -> Iterator[Reply]:
        """The design that is asked for; before the first one the scene."""
        before = () if self._shown else (scene,)
        numbers, self._shown = self.designs.numbers(self.asked)
        yield from (*before, numbers)
        yield from self.designs.picture(self._shown)

    def details(self, hold: Callable[[dict[str, float], dict[str, float]], None]) -> Iterator[Reply]:
        """What moves in the design that is shown, if it holds, of which `hold` is told, and how far the part may be
        from it."""
        if (shown := self._shown) is not None and shown.ask is self.asked:
            kinds = ("holds", "facts", "motions", "model errors")
            yield from (step() for kind, step in self.designs.details(shown) if kind in kinds)
            hold(shown.ask.values, shown.parameters)
        yield told("settled", serial=self.asked.serial)


class Session:
    """The designs of one mechanism that all views of its sliders look at.

    `parameters` are those, SI, that differ from the description in the design that was last found to hold, and `values`
    the numbers of their sliders.
    """

    def __init__(self, own: Described, free: Sequence[str] | None) -> None:
        self._own = own
        self.free: tuple[str, ...] = _free(own.sliders, free)
        self.parameters: dict[str, float] = {}
        self.values: dict[str, float] = {}
        self._views = Kept(MOST_VIEWS)

    def described(self) -> dict[str, Any]:
        """What a view begins with: name, sliders and notes; plain data."""
        sliders = self._own.sliders.items()
        shown = [slider.to_dict() for name, slider in sliders if name in self.free or slider.expression]
        return {"name": self._own.plan.name, "sliders": shown, "notes": list(self._own.notes)}

    def go(self, parameters: Mapping[str, float]) -> None:
        """Go on from a design by its parameters in SI. Raises FlexuraError for one that cannot be."""
        unknown = sorted(set(parameters) - set(self.free))
        if unknown:
            raise OptionError(f"there is no slider {unknown[0]!r}; known: {', '.join(self.free) or 'none'}")
        plan = self._own.plan
        plan.verify(parameters)
        described = plan.parameter_values()
        changed = {name: float(value) for name, value in parameters.items() if value != described[name]}
        self.parameters = changed
        self.values = {name: self._own.sliders[name].shown(value) for name, value in changed.items()}

    def replies(self, content: Mapping[str, Any]) -> Iterator[Reply]:
        """Answers to what a view asks, the last of which ends it: JSON, or bytes with arrays."""
        view = self._views.once(content["view"], lambda: _View(Designs(self._own, FollowedModes())))
        ask = view.asked if content["type"] == "details" else self._ask(content)
        view.asked = ask
        try:
            yield from view.details(self._hold) if content["type"] == "details" else view.picture(self._own.scene)
        except Exception as error:  # whatever it is, the view is told and goes on
            yield told("refused", serial=ask.serial, problems=view.designs.problems(ask, error, self.values))

    def _ask(self, content: Mapping[str, Any]) -> Ask:
        values = {str(name): float(value) for name, value in content["values"].items()}
        own = {"serial": int(content["serial"]), "values": values, "shown": content["shown"]}
        return Ask(type="design", modes=self._own.modes, **own)

    def _hold(self, values: dict[str, float], parameters: dict[str, float]) -> None:
        """A design of a view holds."""
        if values != self.values:
            self.values, self.parameters = values, parameters


def _free(sliders: Mapping[str, Slider], free: Sequence[str] | None) -> tuple[str, ...]:
    """Parameters with a slider: all that follow from no other, or those named. Raises OptionError for others."""
    own = [name for name, slider in sliders.items() if not slider.expression]
    wrong = [name for name in free or () if name not in own]
    if wrong:
        raise OptionError(f"free: {wrong[0]!r} is no parameter with a value of its own; known: {', '.join(own)}")
    return tuple(own if free is None else dict.fromkeys(free))


@verb
def sliders(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    free: Sequence[str] | None = None,
    n: int = 6,
) -> Any:
    """A widget with the mechanism in 3-D, a slider for each parameter, and `n` proven frequencies that follow them.

    parameters: values to begin with, SI; free: names of the parameters that have a slider, by default all that follow
    from no others. Each goes over the bounds that the description gives it, on a logarithmic scale where they span more
    than a decade and a half, in the unit that suits it; ends that are not given are assumed, and say so. What breaks
    the description is said at its slider.

    The widget's `parameters` are those of the last design that holds and that differ from the description, SI, as verbs
    take them; set, they move the sliders, and `observe(function, "parameters")` tells of every change. Raises
    OptionError without anywidget, and for names and values that cannot be; ModelError for designs that cannot be.
    """
    if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MOST_MODES:
        raise OptionError(f"the number of modes is a whole number from 1 to {MOST_MODES}, not {n!r}")
    kind = _widget()
    plan = plan_of(model, None)
    mechanism = model if isinstance(model, Mechanism) else model.mechanism
    widget = kind(Session(Described(plan, n, notes_of(mechanism, plan), 0), free))
    widget.parameters = dict(parameters or {})
    return widget


@cache
def _widget() -> Any:
    """The class of the widget. Raises OptionError without anywidget."""
    anywidget, traitlets = need("anywidget", "notebook"), need("traitlets", "notebook")

    class Sliders(anywidget.AnyWidget):
        """The sliders of a mechanism, with `parameters`, SI, that can be read, set and observed."""

        _esm = bundle()
        described = traitlets.Dict().tag(sync=True)
        values = traitlets.Dict().tag(sync=True)
        parameters = traitlets.Dict()

        def __init__(self, session: Session) -> None:
            self._session = session
            super().__init__(described=session.described())
            self.on_msg(self._answer)

        @traitlets.validate("parameters")
        def _verified(self, proposal: Any) -> dict[str, float]:
            if proposal["value"] != self._session.parameters:
                self._session.go(proposal["value"])
            self.values = self._session.values
            return dict(self._session.parameters)

        def _answer(self, _: Any, content: Any, __: Any) -> None:
            for reply in self._session.replies(content):
                own = {"view": content["view"]}
                if isinstance(reply, bytes):
                    self.send(own, [reply])
                else:
                    self.send({**own, "message": reply})
            self.parameters = self._session.parameters

        def __repr__(self) -> str:
            return f"Sliders({self.described['name']!r}, {counted(len(self._session.free), 'parameter')})"

    return Sliders
