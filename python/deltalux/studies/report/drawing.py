# SPDX-License-Identifier: Apache-2.0
"""Draws figures as SVG and PNG; the only file that uses matplotlib."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

from deltalux.errors import OptionError
from deltalux.studies.experiment import Curve, Figure

# Okabe and Ito's palette: distinguishable with every kind of colour vision. Yellow is too pale on white.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
MARKERS = "os^Dv<>"
THEORY_DASHES = ((0, (5, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)), (0, (3, 1)))
SIZE = (7.2, 4.4)  # inches
DOTS_PER_INCH = 150
LEGEND_COLUMNS = 2  # below the axes
# an axis whose ends differ by less than this factor counts as short
SHORT_AXIS = 150.0
CROWDED = 5  # from this number of curves on, the legend is below the axes
# degrees; slope of several texts, which would otherwise overlap
MARK_SLOPE = 30
STYLE: Any = {
    "font.size": 10.5,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "errorbar.capsize": 2.5,
    "legend.framealpha": 0.85,
    "legend.fontsize": 9.5,
    "svg.hashsalt": "deltalux",  # makes equal figures equal files
}


@dataclass(frozen=True)
class Drawing:
    """A drawn figure: SVG text and PNG bytes."""

    svg: str
    png: bytes


def check_drawing() -> None:
    """Raise OptionError if matplotlib is missing."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise OptionError(
            "study: found no matplotlib, expected it for the figures; install it with: "
            "pip install 'deltalux[study]'"
        ) from None


def draw(figure: Figure) -> Drawing:
    """Draw a figure.

    Parameters
    ----------
    figure : Figure

    Raises
    ------
    OptionError
        If matplotlib is missing.
    """
    check_drawing()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    with matplotlib.rc_context(STYLE):
        canvas = Canvas(figsize=SIZE, layout="constrained")
        FigureCanvasAgg(canvas)  # without a window on any machine
        _fill(canvas.subplots(), canvas, figure)
        vectors, pixels = io.StringIO(), io.BytesIO()
        canvas.savefig(vectors, format="svg", metadata={"Date": None})
        canvas.savefig(pixels, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return Drawing(vectors.getvalue(), pixels.getvalue())


def _fill(axes: Any, canvas: Any, figure: Figure) -> None:
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    if figure.log_x:
        axes.set_xscale("log")
    if figure.log_y:
        axes.set_yscale("log")
    bars = [curve for curve in figure.curves if curve.style == "bars"]
    theories = [curve for curve in figure.curves if curve.style == "theory"]
    for index, curve in enumerate(figure.curves):
        colour = PALETTE[index % len(PALETTE)]
        if curve.style == "bars":
            _bars(axes, curve, colour, bars.index(curve), len(bars))
        elif curve.style == "theory":
            dashes = THEORY_DASHES[theories.index(curve) % len(THEORY_DASHES)]
            axes.plot(curve.x, curve.y, color=colour, linestyle=dashes, label=curve.label)
        else:
            marker = MARKERS[index % len(MARKERS)]
            axes.errorbar(
                curve.x, curve.y, curve.error, color=colour, marker=marker, elinewidth=1.0, label=curve.label
            )
    if all(float(x).is_integer() for curve in figure.curves for x in curve.x) and not figure.log_x:
        axes.xaxis.get_major_locator().set_params(integer=True)
    for axis, logarithmic in ((axes.xaxis, figure.log_x), (axes.yaxis, figure.log_y)):
        if logarithmic:
            _short_axis(axis)
    _marks(axes, figure)
    handles, labels = axes.get_legend_handles_labels()
    order = [labels.index(curve.label) for curve in figure.curves]  # matplotlib lists plain lines first
    entries = [handles[place] for place in order], [labels[place] for place in order]
    if len(figure.curves) >= CROWDED:
        canvas.legend(*entries, loc="outside lower center", ncols=LEGEND_COLUMNS)
    else:
        axes.legend(*entries)


def _short_axis(axis: Any) -> None:
    """Plain numbers on a logarithmic axis of few decades, where powers of ten would be too few labels."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    if high < SHORT_AXIS * low:
        axis.set_major_locator(LogLocator(subs=(1, 2, 3, 4, 6, 8) if high < 10 * low else (1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
        axis.set_minor_formatter(NullFormatter())


def _bars(axes: Any, curve: Curve, colour: str, place: int, count: int) -> None:
    """Bars of several curves are drawn side by side."""
    steps = [b - a for a, b in zip(curve.x, curve.x[1:], strict=False)]
    width = 0.8 * min(steps, default=1.0) / count
    places = [x + (place - (count - 1) / 2) * width for x in curve.x]
    axes.bar(places, curve.y, width, yerr=curve.error, color=colour, label=curve.label)


def _marks(axes: Any, figure: Figure) -> None:
    """Vertical lines, each with its text above the axes, where there are no curves."""
    slope = MARK_SLOPE if len(figure.marks) > 1 else 0
    for mark in figure.marks:
        axes.axvline(mark.x, color="0.35", linestyle=":", linewidth=1.1)
        axes.annotate(
            mark.text,
            (mark.x, 1),
            xycoords=("data", "axes fraction"),
            xytext=(-2, 3),
            textcoords="offset points",
            rotation=slope,
            rotation_mode="anchor",
            fontsize=8.5,
            color="0.25",
        )
