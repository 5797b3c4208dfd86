"""Draw the picture in README.md from a run: what the car's camera sees, beside the lap it drove.

python scripts/make_readme_picture.py RUN [PNG]

RUN is a run folder; the one shown is of `racecraft train` without files. Everything in the picture is
rendered by racecraft: the views from the poses of the lap, the map by `draw_track`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track
from racecraft.worlds.deepracer.tracks.track import Track

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "lap.png"
VIEWS_AT = (0.10, 0.40, 0.66)
"""Shares of the lap at which the car's view is shown."""
VIEW_WIDTH, VIEW_HEIGHT, GAP, HEIGHT = 320, 240, 8, 736
PAPER = (255, 255, 255)


def main(arguments: list[str]) -> int:
    """Drive two laps, render, put the picture together."""
    if not 1 <= len(arguments) <= 2:
        print("usage: make_readme_picture.py RUN [PNG]", file=sys.stderr)
        return 2
    car = load_trained_car(arguments[0])
    track = car.trained_on
    keeper = DriveKeeper()
    report = judge_laps(car.policy, car.world(track, num_cars=1, laps=2), 2, [keeper])
    best = report.best_lap_seconds
    lap = flying_lap(keeper.drive)
    title = f"{track.title}: {best:.2f} s" if best is not None else track.title
    place = Path(arguments[1]) if len(arguments) > 1 else PICTURE
    compose(views(track, lap), map_of(track, lap, title)).quantize(128, dither=Image.Dither.NONE).save(
        place, optimize=True
    )
    print(f"wrote {place}: {place.stat().st_size // 1024} kB; laps {[one.seconds for one in report.laps]}")
    return 0


def flying_lap(drive: Array) -> Array:
    """Return the ticks of the second lap, TICK_REPORT (T,); all of them where there was none."""
    ends = np.flatnonzero(drive["status"] == race.LAP_COMPLETE)
    return drive[ends[0] + 1 : ends[1] + 1] if len(ends) > 1 else drive


def views(track: Track, lap: Array) -> list[tuple[Image.Image, tuple[float, float]]]:
    """Return what the car saw at some moments, each with where that was, (x, y) m."""
    camera = Camera(build_scene(track, for_people=True), VIEW_WIDTH, VIEW_HEIGHT)
    ticks = [round(share * (len(lap) - 1)) for share in VIEWS_AT]
    poses = np.column_stack([lap["x"], lap["y"], lap["yaw"]])[ticks].astype(float)
    places = [(float(lap["front_x"][tick]), float(lap["front_y"][tick])) for tick in ticks]
    return [(Image.fromarray(frame), place) for frame, place in zip(camera.render_rgb(poses), places, strict=True)]


def map_of(track: Track, lap: Array, title: str) -> tuple[Image.Image, object]:
    """Return the circuit with the lap on it, and the function that puts metres onto its pixels."""
    speed = lap["driven_speed"]
    limits = (float(speed.min()), max(float(speed.max()), float(speed.min()) + 0.1))
    xy = np.column_stack([lap["front_x"], lap["front_y"]])
    path = PaintedPath(xy, speed, "driven speed (m/s)", limits)
    figure = draw_track(track, paths=[path], number_every=0, title=title)
    figure.set_dpi(HEIGHT / figure.get_size_inches()[1])
    figure.canvas.draw()
    image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())

    def on_pixels(place: tuple[float, float]) -> tuple[float, float]:
        x, y = figure.axes[0].transData.transform(place)
        return float(x), image.height - float(y)

    return image, on_pixels


def compose(seen, drawn) -> Image.Image:
    """Return the views in a column, the map beside it, numbers tying them together."""
    image, on_pixels = drawn
    sheet = Image.new("RGB", (VIEW_WIDTH + 2 * GAP + image.width, HEIGHT), PAPER)
    sheet.paste(image, (VIEW_WIDTH + 2 * GAP, 0))
    pen = ImageDraw.Draw(sheet)
    for number, (view, place) in enumerate(seen, 1):
        top = (number - 1) * (VIEW_HEIGHT + GAP)
        sheet.paste(view, (0, top))
        badge(pen, 20, top + 20, number)
        x, y = on_pixels(place)
        badge(pen, x + VIEW_WIDTH + 2 * GAP, y, number)
    return sheet


def badge(pen: ImageDraw.ImageDraw, x: float, y: float, number: int) -> None:
    """Draw a number in a disc."""
    pen.ellipse((x - 13, y - 13, x + 13, y + 13), fill=(255, 255, 255), outline=(29, 35, 39), width=2)
    pen.text((x, y), str(number), fill=(29, 35, 39), anchor="mm", font_size=17)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
