"""An action table drawn over what the lines of tracks ask for. See `draw_actions`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.atomic import atomic_file
from racecraft.pages.colours import BLUE, INK
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace


def draw_actions(actions: ActionSpace, demand: Array, path: Path, title: str) -> None:
    """Draw angles (degrees, left positive, drawn to the left) against speeds (m/s) into a picture.

    Args:
        actions: The table, as circles, or ranges, as a frame.
        demand: (P, 2) wheel angle (rad) and speed command (m/s) along the lines.
        path: Ends in .png, .svg or .pdf.
        title: Headline.

    Raises:
        OutputFileError: The file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.scatter(np.degrees(demand[:, 0]), demand[:, 1], s=9, color=BLUE, alpha=0.35, label="asked for along the line")
    if isinstance(actions, ActionBox):
        (right, left), (slow, fast) = np.degrees(actions.steering), actions.speed
        axes.add_patch(Rectangle((right, slow), left - right, fast - slow, fill=False, ec=INK, lw=1.8, label="ranges"))
    else:
        axes.scatter(
            np.degrees(actions.steering),
            actions.speed,
            s=150,
            facecolors="none",
            edgecolors=INK,
            lw=1.8,
            label="action",
        )
    axes.set_xlim(33, -33)
    axes.set_ylim(0, 1.1 * max(*actions.speed, float(demand[:, 1].max())))
    axes.set_xlabel("steering angle (degrees, left positive)")
    axes.set_ylabel("speed command (m/s)")
    axes.set_title(title, loc="left")
    axes.grid(alpha=0.25)
    axes.legend(loc="lower center", ncols=2, frameon=False)
    with atomic_file(path) as part:
        figure.savefig(part, format=path.suffix.lstrip(".") or "png", dpi=130)
