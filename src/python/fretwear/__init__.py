"""The module runs the program `fretwear` and reads its runs.

::

    import fretwear

    run = fretwear.run("joint.toml", set={"contact.normal_load": "20 kN"})
    print(run.history(library="pandas")[["cycles", "wear_volume"]])
    pressure = run.field("pressure")  # [i, j], Pa

Results are in SI units (m, N, Pa, J). `Run.units` returns the unit of each column. A scene and the argument `set` take a quantity as a
text with its unit, such as "20 kN".
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fretwear._folder import Run
    from fretwear._program import Error, Stopped, Value, campaign, explain, plan, run, when

    __version__: str

__all__ = ["Error", "Run", "Stopped", "Value", "campaign", "explain", "plan", "run", "when"]


def __getattr__(name: str) -> Any:
    """Imports a name at its first use, because only `Run` needs pyarrow."""
    if name == "__version__":
        return importlib.import_module("fretwear._program").version()
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module("fretwear._folder" if name == "Run" else "fretwear._program"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
