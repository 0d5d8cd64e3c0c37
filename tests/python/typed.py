"""User script that calls each function of the module. `mypy --strict` checks the types, and this command runs the script:

    python tests/python/typed.py SCENE CAMPAIGN
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import fretwear
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
from matplotlib.figure import Figure

SCENE: Mapping[str, fretwear.Value] = {"joint": {"size": ["4 mm", "3 mm"], "grid": [24, 16]}, "title": "typed"}

version: str = fretwear.__version__
meaning: str = fretwear.explain("joint.grid")["meaning"]
warnings: list[str] = fretwear.plan(sys.argv[1], set={"wear.cycles": 10_000}, rehearsal=False)["warnings"]
try:
    fretwear.run(SCENE, run=Path("typed"), threads=1, max_wall="1 min")
except fretwear.Stopped as stopped:
    print(stopped.run.latest)
except fretwear.Error as error:
    print(error.code, error)
run: fretwear.Run = fretwear.run(sys.argv[1], quiet=False)
arrow: pa.Table = run.table("summary", "all")
frame: pd.DataFrame = run.table("summary", library="pandas")
polars: pl.DataFrame = run.history("polars")
lazy: pl.LazyFrame = run.scan("contact_field").filter(pl.col("pressure") > 0)
x, y = run.centres()
force: float = float(np.nansum(run.field("pressure")) * (x[1] - x[0]) * (y[1] - y[0]))
unit: str = run.field("wear_depth", 0, as_xarray=True).attrs["units"]
picture: Figure = run.plot("wear_volume")
page: Path = run.report()
run.verify()
print(version, meaning, warnings, run.iterations, run.latest, run.scene["contact"]["normal_load"], run.units("history")["kn"], unit, page, force)
print(arrow.num_rows, len(frame), polars.height, lazy.collect().height, picture.get_axes(), run.folder, run._repr_html_())
print(fretwear.when(run, depth=["10 nm", "1 um"], volume="1e-4 mm3")["milestones"])
print(fretwear.campaign(sys.argv[2], jobs=2, retry=True)["done"])
