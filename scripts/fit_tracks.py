"""Build the track catalogue from surveyed route files: a builder's tool, never needed to run racecraft.

    python scripts/fit_tracks.py ../shared/data/tracks src/racecraft/tracks/catalogue

Reads every `.npy` and `tracks-look.json` of the first folder; writes `shapes/*.json` (one per distinct shape) and
`index.json` (one line per name) into the second. Exits with an error if any track cannot be fitted within tolerance.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.worlds.deepracer.tracks.fit import fit_shape, misses
from racecraft.worlds.deepracer.tracks.importer import import_track
from racecraft.worlds.deepracer.tracks.look import TrackLook
from racecraft.worlds.deepracer.tracks.shape_file import rows_from_record, shape_text
from racecraft.worlds.deepracer.tracks.track import Track

SOURCE = "AWS DeepRacer simulation application, route file of the same name"
LICENCE = "Apache-2.0"
STRIP_M = 0.0762  # 3 in, measured on the strips that lie square to the axes

TITLES = {
    "2022_april_open": "Ace Speedway", "2022_april_pro": "Ace Super Speedway",
    "2022_august_open": "Jochem Turnpike", "2022_august_pro": "Jochem Highway",
    "2022_july_open": "DBro Raceway", "2022_july_pro": "DBro Super Raceway",
    "2022_june_open": "BreadCentric Loop", "2022_june_pro": "BreadCentric Speedway",
    "2022_march_open": "Rogue Circuit", "2022_march_pro": "Rogue Raceway",
    "2022_may_open": "Ross Raceway", "2022_may_pro": "Ross Super Speedway",
    "2022_october_open": "Jennens Family Speedway", "2022_october_pro": "Jennens Super Speedway",
    "2022_september_open": "Roger Ring", "2022_september_pro": "Roger Super Raceway",
    "2022_reinvent_champ": "re:Invent 2022 Championship", "2022_summit_speedway": "RL Speedway",
    "2024_reinvent_champ": "Forever Raceway", "AWS_track": "AWS Track", "Albert": "Yun Speedway",
    "AmericasGeneratedInclStart": "Baadal Track", "Aragon": "Stratus Loop", "Austin": "American Hills Speedway",
    "Belille": "Cumulo Turnpike", "Bowtie_track": "Bowtie Track", "Canada_Training": "Toronto Turnpike Training",
    "China_track": "Shanghai Sudu Training", "FS_June2020": "Fumiaki Loop", "July_2020": "Roger Raceway",
    "LGSWide": "SOLA Speedway", "Mexico_track": "Cumulo Carrera Training", "Monaco": "European Seaside Circuit",
    "New_York_Track": "Empire City Training", "Oval_track": "Oval Track", "Singapore": "Asia Pacific Bay Loop",
    "Spain_track": "Circuit de Barcelona-Catalunya", "Straight_track": "Straight Track",
    "Tokyo_Training_track": "Kumo Torakku Training", "Vegas_track": "AWS Summit Raceway",
    "Virtual_May19_Train_track": "London Loop Training", "arctic_open": "Hot Rod Speedway",
    "arctic_pro": "Hot Rod Super Speedway", "caecer_gp": "Vivalas Speedway", "caecer_loop": "Vivalas Loop",
    "dubai_open": "Baja Turnpike", "dubai_pro": "Baja Highway", "hamption_open": "Kuei Raceway",
    "hamption_pro": "Kuei Super Raceway", "jyllandsringen_open": "Cosmic Loop", "jyllandsringen_pro": "Cosmic Circuit",
    "morgan_open": "Playa Raceway", "morgan_pro": "Playa Super Raceway", "penbay_open": "Po-Chun Speedway",
    "penbay_pro": "Po-Chun Super Speedway", "reInvent2019_track": "Smile Speedway",
    "reInvent2019_wide": "A to Z Speedway", "red_star_open": "Expedition Loop", "red_star_pro": "Expedition Super Loop",
    "reinvent_base": "re:Invent 2018", "thunder_hill_open": "Lars Loop", "thunder_hill_pro": "Lars Circuit",
}  # fmt: skip

VARIANTS = {
    "_ccw": "counter-clockwise", "_cw": "clockwise", "_mirrored": "mirrored", "_mini": "mini",
    "_building": "with buildings", "_f1": "F1", "_carpet": "carpet", "_concrete": "concrete", "_wood": "wood",
}  # fmt: skip


def main(source: Path, target: Path) -> None:
    """Fit every track of the source folder and write the catalogue."""
    looks = json.loads((source / "tracks-look.json").read_text())
    (target / "shapes").mkdir(parents=True, exist_ok=True)
    for old in (target / "shapes").glob("*.json"):
        old.unlink()
    index: dict[str, dict[str, Any]] = {}
    shape_names: dict[bytes, str] = {}
    for path in sorted(source.glob("*.npy"), key=lambda path: (path.stem.casefold(), path.stem)):
        surveyed = import_track(path)
        name, key = path.stem, surveyed.rows.tobytes()
        if key not in shape_names:
            shape_names[key] = name
            record = fit_shape(surveyed, SOURCE, LICENCE)
            (target / "shapes" / f"{name}.json").write_text(shape_text(record), encoding="utf-8")
            missed = misses(record, surveyed)
            print(f"{name:30s} {len(missed):4d} rows, farthest {missed.max() * 1e3:.2f} mm, {missed.mean() * 1e3:.2f}")
        shape = json.loads((target / "shapes" / f"{shape_names[key]}.json").read_text())
        fitted = Track.from_rows(name, rows_from_record(shape), look=look_of(name, looks[name], surveyed))
        index[name] = {"shape": shape_names[key], **summary_of(fitted, surveyed.repeated_rows)}
    lines = [f" {json.dumps(name)}: {json.dumps(entry, ensure_ascii=False)}" for name, entry in index.items()]
    (target / "index.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    print(f"{len(index)} names, {len(shape_names)} shapes")


def summary_of(track: Track, repeated_rows: tuple[int, ...] = ()) -> dict[str, Any]:
    """Return what `racecraft tracks list` tells about a track."""
    base, title, tags = track.name, "", []
    for suffix, word in VARIANTS.items():
        if base not in TITLES and base.endswith(suffix):
            base, tags = base.removesuffix(suffix), [word]
    base = "reinvent_base" if base == "reinvent" else base
    title = TITLES[base] + "".join(f" ({word})" for word in tags)
    kinds = ["open track"] if not track.closed else ["short" if track.length < 26 else "long"]
    kinds += ["narrow"] if track.width_mean < 0.9 else []
    return {
        "title": title, "length": round(track.length, 3), "width": round(track.width_mean, 3),
        "rows": len(track.centre), **({"repeated_rows": list(repeated_rows)} if repeated_rows else {}),
        "direction": track.direction, "tags": kinds + tags, "look": track.look.to_record(),
    }  # fmt: skip


def look_of(name: str, entry: dict[str, Any], track: Track) -> TrackLook:
    """Return a track's look from the figures measured on its textures and meshes; the common theme where none."""
    colours = {part: tuple(value["mean"]) for part, value in entry.get("colors", {}).items()}
    look = TrackLook()
    for ours, theirs in {"road": "road", "line": "ol", "dash": "cl", "field": "field", "wall": "wall"}.items():
        if theirs in colours:
            look = replace(look, **{ours: colours[theirs]})
    if "start" in colours:
        look = replace(look, start=colours["start"])
    if "line_side" in entry:
        look = replace(look, line_side=entry["line_side"], line_width=entry["line_w"])
    if "dash" in entry:
        measured = {f"dash_{part}": float(entry["dash"][part]) for part in ("length", "gap", "width")}
        look = replace(look, **measured)
    if "field_bbox" in entry:
        look = replace(look, field_bounds=_field(entry["field_bbox"], track))
    if "wall_bbox" in entry:
        look = replace(look, wall_height=round(entry["wall_bbox"][1][2] - entry["wall_bbox"][0][2], 2))
    if "start_bbox" in entry:
        middle = np.mean(entry["start_bbox"], axis=0)[:2]
        at = float(track.locate(middle[None]).arc[0])
        at = at - track.length if at > track.length / 2 else at
        look = replace(look, start_strip=STRIP_M, start_strip_at=round(at, 2))
    if name.startswith("reinvent_") and "road" not in colours:  # tape on the floor of a hall: no road texture
        look = replace(look, road=look.field, dash=colours["il"])
    return look


def _field(box: list[list[float]], track: Track) -> tuple[float, float, float, float] | None:
    """Return the field's rectangle, or None where the measured one does not hold the road (a mesh without height)."""
    (x0, y0, _), (x1, y1, _) = box
    bx0, by0, bx1, by1 = track.bounds
    holds = x0 <= bx0 and y0 <= by0 and x1 >= bx1 and y1 >= by1
    return (x0, y0, x1, y1) if holds and all(map(math.isfinite, (x0, y0, x1, y1))) else None


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
