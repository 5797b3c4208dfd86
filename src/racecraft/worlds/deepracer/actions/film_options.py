"""How a drive is filmed: options that could do nothing are refused before it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar

FILM = "Film and picture"
"""Where --help shows what leaves pictures."""
DASHBOARD, FILM_SIZE, FILM_FPS = "dashboard", "720p", 30
"""Defaults."""


@dataclass(frozen=True, kw_only=True)
class FilmOptions(Request):
    """How the drive is filmed, as it was typed; None where nothing was."""

    PANEL: ClassVar[str] = FILM
    video: Path | None = option(None, "Film the drive into this MP4 file.")
    view: str | None = option(
        None,
        "Camera of the film: dashboard (the car's own view and a panel of figures; where nobody says), car, "
        "chase, top, or pip (chase with top in its corner).",
    )
    size: str | None = option(
        None, "Of the film, in any view but dashboard: 480p, 540p, 720p (where nobody says) or 1080p."
    )
    fps: int | None = option(None, "Its pictures a second, in any view but dashboard: 15 to 60, 30 where nobody says.")
    save_mp4: bool = option(False, "Film it with the original's three cameras into the run's mp4/ (DR_EVAL_SAVE_MP4).")

    @property
    def from_outside(self) -> bool:
        """Whether a view other than the dashboard is asked for."""
        return self.view not in (None, DASHBOARD)

    def check(self) -> None:
        """Refuse, before the drive and not after it, what no film can be or has a say in none.

        Raises:
            VideoError: The file is no MP4.
            SettingError: An option that could do nothing.
        """
        from racecraft.analysis.video import film_path
        from racecraft.contract.errors import SettingError

        if self.video is not None:
            film_path(self.video)
        elif self.view is not None:
            raise SettingError("--view {view} films nothing; expected --video FILE.mp4 with it.", view=self.view)
        if self.video is None and not self.save_mp4:
            idle = "films nothing; expected --video FILE.mp4 or --save-mp4 with it."
        elif not self.from_outside and not self.save_mp4:
            idle = "has no say in the view dashboard; expected --view car, chase, top or pip with it."
        else:
            return
        for flag, value in (("--size", self.size), ("--fps", self.fps)):
            if value is not None:
                raise SettingError("{option} {value} {idle}", option=flag, value=value, idle=idle)

    def style(self, car: TrainedCar) -> FilmStyle | None:
        """Return the style of a film from outside the dashboard; None where there is none."""
        from racecraft.worlds.deepracer.analysis.judged_drive import style_of

        if not self.from_outside and not self.save_mp4:
            return None
        return style_of(car, self.view or DASHBOARD, self.size or FILM_SIZE, self.fps or FILM_FPS)
