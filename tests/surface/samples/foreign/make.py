"""Writes one map with the writers of other programs, for tests/surface/foreign.rs.

pip install "numpy<3" "pandas<4" "SurfaceTopography>=1.27,<2" "surfalize>=0.19,<0.20"
python make.py

The map has 7 points along x and 5 points along y, at distances of 0.5 um and 0.8 um. The heights in um are
0.3 sin(0.7 i) + 0.2 cos(1.1 j) + 0.005 i j, and point (2, 1) has no measurement. In text files without a header,
axis 0 of the array is x. The SUR files store integers. sur_heights.npy contains the heights that the writer's
reader returns for the SUR files, in um, with axis 0 as x.
"""

import numpy as np
import pandas as pd
from surfalize import Surface
from SurfaceTopography import Topography

NX, NY, DX, DY = 7, 5, 0.5, 0.8
i, j = np.indices((NX, NY))
heights = 0.3 * np.sin(0.7 * i) + 0.2 * np.cos(1.1 * j) + 0.005 * i * j
heights[2, 1] = np.nan

np.savetxt("savetxt.txt", heights)
np.savetxt("savetxt_tabs.txt", heights, delimiter="\t", header="heights in um")
frame = pd.DataFrame(heights)
frame.to_csv("to_csv_bare.csv", header=False, index=False)
frame.to_csv("to_csv_semicolon.csv", header=False, index=False, sep=";", decimal=",")
frame.to_csv("to_csv_header.csv", index=False)
frame.to_csv("to_csv_index.csv", header=False)
frame.to_csv("to_csv_both.csv")
frame.rename(columns=lambda k: f"c{k}").to_csv("to_csv_names.csv", index=False)
points = pd.DataFrame({"z": heights.ravel(), "y [um]": DY * j.ravel(), "quality": 1.0, "x [um]": DX * i.ravel()})
points = points.rename(columns={"z": "z [um]"})
points.to_csv("points.csv", index=False)
points.to_csv("points_index.csv")
np.savetxt("points_header.txt", np.c_[DY * j.ravel(), DX * i.ravel(), heights.ravel()], header="y x z")

surface = Surface(heights.T.copy(), DX, DY)
surface.save("plain.sur")
surface.save("compressed.sur", compressed=True)
surface.save("surfalize.x3p")
surface.save("surfalize.sdf")
surface.save("surfalize.al3d")
np.save("sur_heights.npy", Surface.load("plain.sur").data.T)
assert np.array_equal(Surface.load("compressed.sur").data, Surface.load("plain.sur").data, equal_nan=True)

topography = Topography(np.ma.masked_invalid(heights), (NX * DX, NY * DY), unit="um")
topography.to_matrix("to_matrix.txt")
for kind in "DFLI":
    topography.to_x3p(f"to_x3p_{kind}.x3p", dtype=kind)
