"""Lessons of environment parameters, one after the other, as in ML-Agents' curriculum. Begin with `Curriculum`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from racecraft.contract.world import EpisodeRecord
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.unity.env.trainer_options import sampler_of
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.files.trainer_config import Lesson

LESSONS_FILE = "lessons.json"
"""At which lesson each parameter of a run is, by the lesson's number from 0."""
SMOOTHING = 0.25
"""Weight of the measure before in a smoothed one, as in ML-Agents."""


class Curriculum:
    """Moves each parameter to its next lesson when the one before is learned.

    A lesson is learned when its measure exceeds its threshold: the mean return of the latest `min_episodes` training
    episodes of its behavior, or the share of max_steps that lies behind. Both are looked at once an iteration.

    Args:
        lessons: Of each parameter, in order.
        worlds: Where the parameters are set: the players that teach, and the one that judges.
        rows_of: Which rows belong to which behavior, by its name without the team.
        max_steps: Of each behavior, for lessons that go by progress.
        on_message: Called when a lesson begins.
    """

    def __init__(
        self,
        lessons: Mapping[str, Sequence[Lesson]],
        worlds: Iterable[UnityWorld],
        rows_of: Mapping[str, slice],
        max_steps: Mapping[str, int],
        on_message: Callable[[str], None],
    ) -> None:
        self._lessons, self._worlds, self._on_message = lessons, tuple(worlds), on_message
        self._rows_of, self._max_steps = rows_of, max_steps
        self._at = dict.fromkeys(lessons, 0)
        self._returns: dict[str, list[float]] = {name: [] for name in lessons}
        self._smoothed: dict[str, float] = {}
        self._steps = dict.fromkeys(rows_of, 0)
        self._file: Path | None = None

    def keep_in(self, run: Path) -> None:
        """Keep in a run folder where the lessons are; go on from what is kept there."""
        self._file = run / LESSONS_FILE
        if self._file.exists():
            kept = json.loads(self._file.read_text(encoding="utf-8"))
            self._at |= {name: min(int(kept.get(name, 0)), len(self._lessons[name]) - 1) for name in self._lessons}
        for name in self._lessons:
            self._teach(name)

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Look at an iteration's training episodes."""
        for base, rows in self._rows_of.items():
            self._steps[base] += sum(one.steps for one in episodes if rows.start <= one.world < rows.stop)
        for name, lessons in self._lessons.items():
            lesson = lessons[self._at[name]]
            taught = self._rows_of.get(lesson.behavior.split("?")[0])
            if taught is not None:
                self._returns[name] += [one.reward for one in episodes if taught.start <= one.world < taught.stop]
            if self._at[name] + 1 < len(lessons) and self._is_learned(name, lesson):
                self._begin_next(name)

    def _is_learned(self, name: str, lesson: Lesson) -> bool:
        latest = self._returns[name][-max(1, lesson.min_episodes) :]
        if len(latest) < max(1, lesson.min_episodes):
            return False
        base = lesson.behavior.split("?")[0]
        measure = sum(latest) / len(latest)
        if lesson.measure == "progress":
            measure = self._steps.get(base, 0) / self._max_steps.get(base, 1)
        if lesson.is_smoothed:
            measure = SMOOTHING * self._smoothed.get(name, measure) + (1.0 - SMOOTHING) * measure
            self._smoothed[name] = measure
        return measure > lesson.threshold

    def _begin_next(self, name: str) -> None:
        self._at[name] += 1
        self._returns[name].clear()
        self._smoothed.pop(name, None)
        self._teach(name)
        number, lessons = self._at[name] + 1, self._lessons[name]
        self._on_message(f"{name}: lesson {number} of {len(lessons)}, '{lessons[number - 1].name}', begins")
        if self._file is not None:
            write_atomic(self._file, json.dumps(self._at))

    def _teach(self, name: str) -> None:
        for world in self._worlds:
            world.set_parameter(name, sampler_of(self._lessons[name][self._at[name]].value))
