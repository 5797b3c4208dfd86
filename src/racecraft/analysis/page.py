"""Figures, films and pictures on a page that is one file. Begin with `figure_part`; all other parts: `pages.parts`."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, BinaryIO

from markupsafe import Markup

from racecraft.analysis.interactive import charts_of
from racecraft.pages import parts

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figure_part(figure: Figure, words: str, dpi: int = 110) -> Markup:
    """Return a figure as charts that the reader can zoom into; maps and camera pictures stay pictures.

    Args:
        figure: matplotlib's.
        words: What it shows, for those who cannot see it.
        dpi: Points per inch where it stays a picture.
    """
    charts = charts_of(figure, words)
    if charts is None:
        return photograph(figure, words, dpi)
    if len(charts) == 1:
        return parts.chart(charts[0])
    return parts.grid(*(parts.card(parts.chart(one)) for one in charts))


def photograph(figure: Figure, words: str, dpi: int = 110) -> Markup:
    """Return a figure as a picture that stands in the page."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi)
    return parts.picture(_inline("image/png", out.getvalue()), words)


def film(data: bytes, words: str) -> Markup:
    """Return an MP4 that stands in the page, its first picture before it is played; `words` say what it shows."""
    return parts.film(_inline("video/mp4", data), words, _inline("image/jpeg", first_picture(io.BytesIO(data))))


def first_picture(film: BinaryIO) -> bytes:
    """Return the first picture of an MP4 as JPEG."""
    import av

    out = io.BytesIO()
    with av.open(film, "r") as container:
        next(container.decode(video=0)).to_image().save(out, "JPEG", quality=75)
    return out.getvalue()


def _inline(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
