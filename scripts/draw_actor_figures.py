"""Draw who acts and who learns in a spread training: docs/pictures/actors-*.svg.

    python scripts/draw_actor_figures.py

Three figures after AWS's post of April 2020 on distributed training, drawn anew: one collector with many actors, a
cluster of equal machines, and one whose learner has another machine than its actors. Colours follow the reader's light
or dark setting.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "pictures"
WIDTH, HEIGHT = 640, 300
STYLE = """text{font:14px system-ui,sans-serif;fill:#1f2933;text-anchor:middle}
.small{font-size:12px;fill:#52606d}.machine{fill:none;stroke:#9aa5b1;stroke-dasharray:5 4}
.actor{fill:#d6e8fa;stroke:#2b6cb0}.learner{fill:#fde3cf;stroke:#b7521c}.replay{fill:#dcf0e0;stroke:#2f7d4f}
.flow{fill:none;stroke:#52606d;stroke-width:1.5;marker-end:url(#head)}
.weights{stroke-dasharray:2 3}#head path{fill:#52606d}
.paper{fill:#ffffff}
@media(prefers-color-scheme:dark){text{fill:#e4e7eb}.small{fill:#b8c2cc}.machine{stroke:#7b8794}
.actor{fill:#1d3a57;stroke:#7fb4e6}.learner{fill:#5a2f16;stroke:#f0a875}.replay{fill:#1e4630;stroke:#7fcf9b}
.flow{stroke:#b8c2cc}#head path{fill:#b8c2cc}.paper{fill:#1b1f24}}"""
HEAD = (
    '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
    '<path d="M0 0L8 4L0 8z"/></marker></defs>'
)


@dataclass(frozen=True)
class Box:
    """Something that works, in pixels of the figure."""

    look: str
    """actor, learner, replay or machine."""
    x: float
    y: float
    width: float
    height: float
    words: str

    def drawn(self) -> str:
        """Return it as SVG; a machine's words stand at its top, others' in the middle."""
        is_machine = self.look == "machine"
        baseline = self.y + (18 if is_machine else self.height / 2 + 5)
        label = ' class="small"' if is_machine else ""
        return (
            f'<rect class="{self.look}" x="{self.x:g}" y="{self.y:g}" width="{self.width:g}" '
            f'height="{self.height:g}" rx="8"/>'
            f'<text{label} x="{self.x + self.width / 2:g}" y="{baseline:g}">{self.words}</text>'
        )


def main() -> None:
    """Write the three figures."""
    for name, title, parts in (one_collector(), homogeneous(), heterogeneous()):
        (PICTURES / f"actors-{name}.svg").write_text(figure(title, parts), encoding="utf-8")


def figure(title: str, parts: Iterable[str]) -> str:
    """Return a whole figure as SVG."""
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img"'
    paper = f'<rect class="paper" width="{WIDTH}" height="{HEIGHT}"/>'
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n<title>{title}</title>\n<style>{STYLE}</style>\n'
        f"{HEAD}{paper}\n{body}\n</svg>\n"
    )


def one_collector() -> tuple[str, str, list[str]]:
    """Return the figure of one process: its worlds are stepped together, one learner learns from them."""
    worlds = [Box("actor", 40, 50 + 55 * k, 130, 40, f"world {k + 1}") for k in range(4)]
    parts = [
        Box("machine", 15, 15, 610, 270, "one machine"),
        *worlds,
        Box("replay", 270, 115, 130, 60, "collector"),
        Box("learner", 465, 115, 130, 60, "learner"),
    ]
    flows = [
        *(flow(170, box.y + 20, 268, 145) for box in worlds),
        flow(400, 135, 463, 135),
        weights(465, 158, 402, 158),
    ]
    return (
        "one-collector",
        "One collector with many actors",
        [box.drawn() for box in parts] + [*flows, legend(330, 262)],
    )


def homogeneous() -> tuple[str, str, list[str]]:
    """Return the figure of equal machines: the learner stands on one of them, actors on all."""
    first = [
        Box("machine", 385, 15, 240, 240, "machine 1, with CPUs"),
        Box("learner", 405, 50, 200, 50, "learner and replay"),
        Box("actor", 405, 165, 90, 60, "actor"),
        Box("actor", 515, 165, 90, 60, "actor"),
    ]
    others = [
        box
        for k in range(2)
        for box in (
            Box("machine", 15, 15 + 125 * k, 280, 115, f"machine {k + 2}, with the same CPUs"),
            *(Box("actor", 30 + 85 * n, 50 + 125 * k, 75, 60, "actor") for n in range(3)),
        )
    ]
    flows = [
        flow(295, 62, 403, 68), weights(405, 86, 297, 92), flow(295, 190, 403, 98), weights(405, 92, 297, 166),
        flow(450, 165, 450, 102), weights(560, 102, 560, 163),
    ]  # fmt: skip
    return (
        "homogeneous",
        "A cluster of equal machines",
        [box.drawn() for box in (*first, *others)] + [*flows, legend(320, 285)],
    )


def heterogeneous() -> tuple[str, str, list[str]]:
    """Return the figure of unlike machines: the learner has a GPU of its own, actors have the cores."""
    boxes = [
        Box("machine", 405, 15, 220, 240, "machine 1, with a GPU"),
        Box("learner", 430, 60, 170, 60, "learner"),
        Box("replay", 430, 170, 170, 60, "replay"),
    ]
    for k in range(2):
        boxes += [
            Box("machine", 15, 15 + 125 * k, 300, 115, f"machine {k + 2}, with many CPUs"),
            *(Box("actor", 27 + 71 * n, 50 + 125 * k, 63, 60, "actor") for n in range(4)),
        ]
    flows = [
        flow(315, 100, 428, 190), flow(315, 205, 428, 208), weights(430, 80, 317, 60), weights(430, 105, 317, 160),
        flow(515, 170, 515, 122),
    ]  # fmt: skip
    return (
        "heterogeneous",
        "A learner with a GPU, actors with the cores",
        [box.drawn() for box in boxes] + [*flows, legend(320, 285)],
    )


def flow(x: float, y: float, to_x: float, to_y: float) -> str:
    """Return an arrow that experience takes."""
    return f'<path class="flow" d="M{x:g} {y:g}L{to_x:g} {to_y:g}"/>'


def weights(x: float, y: float, to_x: float, to_y: float) -> str:
    """Return an arrow that new weights take."""
    return f'<path class="flow weights" d="M{x:g} {y:g}L{to_x:g} {to_y:g}"/>'


def legend(x: float, y: float) -> str:
    """Return what the arrows mean."""
    return f'<text class="small" x="{x:g}" y="{y:g}">solid: experience · dotted: new weights</text>'


if __name__ == "__main__":
    main()
