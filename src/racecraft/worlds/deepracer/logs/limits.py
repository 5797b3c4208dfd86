"""Numbers that no drive has: a row with one of them is damaged, however it came to be.

Far beyond anything that a simulator tells, and low enough that what is reckoned with the others stays numbers: squares
and sums of them do not overflow, and no axis or table grows with a count.
"""

from __future__ import annotations

HIGHEST = 1e15
"""Of metres, degrees, seconds, rewards."""
HIGHEST_WHOLE = 1e7
"""Of episodes, steps, actions and waypoints; at fifteen steps a second it would be a week at the wheel."""
