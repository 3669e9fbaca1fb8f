"""The colours of the report, common to pictures, charts and 3D view."""

import numpy as np

# +x -x +y -y +z -z: a hue per axis, dark for the positive side, pale for the negative one
AXIS_COLOURS = ("#c8443c", "#eda49c", "#3f8f4f", "#a5d3a2", "#2f6db3", "#9cc3e8")
SURFACE = "#a9b7c4"
EDGE = "#1f2a36"
WORST = "#d6206a"
PRESERVED, LOST_FACE = "#2c7a56", "#f0b3c9"  # of a CAD model: its curves, its faces
HELD, LOADED = "#2f6db3", "#e07b1f"  # faces with supports, with loads
LOST = "#d91a1a"  # on a hex mesh, as in the 3D view

# of holes, and of other CAD faces that are not ends: dark, and pale
HOLES = (
    "#7b4fb0", "#d9822b", "#14807f", "#b8487f", "#8a6d1f",
    "#4a5a9a", "#e0559b", "#5fa83a", "#a05a3c", "#35a3c9",
)  # fmt: skip
FACES = ("#d9c9a3", "#b9d8cf", "#dcc3d0", "#c9c3e3", "#d8dba6", "#bcd3e6", "#e6c7b5")

# scaled Jacobian 0 .. 1: red is bad, blue is good, equal steps between the colours
QUALITY_COLOURS = ("#a3152b", "#e8743b", "#f5d67b", "#63b8b4", "#3d78bd")
# displacement 0 .. largest
DISPLACEMENT_COLOURS = ("#26365c", "#3b7ea1", "#6cc3a0", "#f0e27a", "#e2703a")
# stress, temperature: smallest .. largest
FIELD_COLOURS = ("#2b4f9e", "#3fa3c4", "#8fd19e", "#f4e07a", "#ee8a3c", "#b3202e")
# distance from the input 0 .. largest: one hue, dark for large values
DEVIATION_COLOURS = ("#e9eef2", "#f3d9a4", "#ea9a52", "#c8443c", "#7a1f3d")
# position of a point along the polycube, from end to end
PLACES = ("#c0322f", "#ee7d3c", "#ecc044", "#45a86f", "#2f7fc4", "#7b4fb0")

# of the grid cells, in sequence
CELLS = ("#4c8fd0", "#e9a13b", "#5bb08a", "#c96a8b", "#8d7cc3", "#a8a24a", "#4fb3bf")


def rgb(colours: tuple[str, ...]) -> np.ndarray:
    """(K, 3) uint8 of K colours written as #rrggbb."""
    return np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in colours], np.uint8)


def ramp(values: np.ndarray, colours: tuple[str, ...]) -> np.ndarray:
    """(N, 3) uint8 colour of each value in [0, 1], linear between the given colours; clipped."""
    stops = np.linspace(0, 1, len(colours))
    channels = [np.interp(values, stops, channel) for channel in rgb(colours).T]
    return np.stack(channels, -1).round().astype(np.uint8)
