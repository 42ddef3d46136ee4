"""Figures that use every element, for the tests of the renderers and of the page."""

import numpy as np

from tdacoustic.reporting import Axis, Band, Bars, Figure, Heatmap, Line, Markers, Rule

EVIL = "</script><img src=x onerror=alert(1)>&\u2028"

FREQUENCY = Axis("Frequency", "Hz", "log", limits=(20.0, 8000.0))
LEVEL = Axis("Sound pressure level", "dB", reference="20 uPa", note="density, per Hz")


def spectrum(name: str = "spectrum", word: str = "mic_1", n: int = 20_001) -> Figure:
    x = np.linspace(0.0, 10_000.0, n)
    y = 40.0 + 5.0 * np.sin(x / 7.0)
    y[n // 3] = np.nan
    y[n // 20] = 93.5
    peaks = [n // 20, n // 4]
    elements = (
        Line(x, y, word),
        Line(x, y - 3, "run b", style="dashed", group=word, opacity=0.5),
        Line(x[1::500], y[1::500], "bands", style="steps", color=7),
        Band(x, y - 1, y + 1, "interval"),
        Markers(x[peaks], y[peaks], "lines", labels=[word, "2×"], texts=["a\nb", word], errors=[1.0, 2.0]),
        Rule(500.0, word),
    )
    return Figure(name, f"Spectrum {word}", word, FREQUENCY, LEVEL, elements)


def bars(name: str = "bars", bar_mode: str = "group") -> Figure:
    elements = (
        Bars(["1", "2", "3"], [80.0, np.nan, 90.0], "measured", errors=[1.0, 1.0, 1.0]),
        Bars(["1", "2", "3"], [81.0, 85.0, 91.0], "predicted", hatch="/"),
        Markers([0, 1, 2], [79.0, 84.0, 88.0], "paper", symbol="diamond"),
        Line([0, 1, 2], [79.0, 84.0, 88.0], "trend", style="dotted"),
    )
    axis = Axis("Level", "dB", reference="20 uPa")
    return Figure(name, "Levels", "", Axis("Condition"), axis, elements, bar_mode=bar_mode)


def heatmap(name: str = "map", rows: int = 600, columns: int = 900) -> Figure:
    x, y = np.linspace(0.0, 60.0, columns), np.linspace(0.0, 3000.0, rows)
    z = 40.0 + 10.0 * np.sin(x[None] / 3.0) * np.cos(y[:, None] / 300.0)
    z[5, 7] = np.nan
    heat = Heatmap(x, y, z, "mic_1", Axis("Level", "dB", reference="20 uPa", limits=(20.0, 60.0)))
    return Figure(name, "Map", "", Axis("Time", "s"), Axis("Frequency", "Hz"), (heat, Rule(30.0, "coast")))


def every_figure() -> list[Figure]:
    return [spectrum(), bars(), bars("stack", "stack"), heatmap()]
