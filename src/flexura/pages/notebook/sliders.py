"""Sliders of a mechanism in a notebook: in Jupyter, VS Code and marimo, by anywidget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.extras import need
from flexura.mechanism import Mechanism
from flexura.pages.live import MOST_MODES, Described, notes_of
from flexura.pages.notebook.session import Session
from flexura.pages.viewer import bundle
from flexura.structure import Plan, plan_of
from flexura.tables import counted


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
