"""The colours of figures and of the pages that carry them, as CSS and matplotlib read them.

The first six of a series are those of Okabe and Ito, told apart by colour-blind eyes.
"""

INK, PAPER, QUIET = "#1d2327", "#ffffff", "#6b7680"
"""Text and lines; the ground; what stands back, as axes and grids."""
BLUE, ORANGE, GREEN, RED, SKY, PINK = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7"
CYCLE = (BLUE, ORANGE, GREEN, RED, SKY, PINK)
