"""Where a player comes from.

    a path           a file, a path without its suffix, a folder, an .app, an .exe, a .zip
    registry:NAME    one of ML-Agents' example scenes: from the user's cache, or fetched as a manifest says
    editor           the Unity Editor, which is started by hand and calls port 5004
    builtin:Basic    our headless stand-in of the Basic scene

Begin at `find_build`. A path that does not exist is also looked for in the folder `SM_CHANNEL_TRAIN` (where SageMaker
puts training data), and made executable where it lost that on the way. What is unpacked or fetched appears in the cache
in one move, in the user's own folder: one for temporary files is everybody's, and whoever is first to make a folder of
that name there decides which program is started (facts: unity-ml-agents, "Path resolution").
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import tempfile
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import racecraft
from racecraft.contract.errors import nearest
from racecraft.contract.user_cache import user_cache
from racecraft.formats.archive import ArchiveError, unpack
from racecraft.worlds.unity.env.errors import BuildError

DEFAULT_MANIFEST = "https://storage.googleapis.com/mlagents-test-environments/1.1.0/manifest.yaml"
BUILTIN = {"Basic": "racecraft.worlds.unity.env.basic_scene"}

_PLATFORM = {"win32": "win", "darwin": "darwin"}.get(sys.platform, "linux")
_SUFFIXES = {"linux": (".x86_64", ".x86", ""), "darwin": (".app",), "win": (".exe",)}
_ALL_SUFFIXES = (".app", ".exe", ".x86_64", ".x86")
_PROGRAMS = (b"\x7fELF", b"#!", b"MZ", b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe", b"\xca\xfe\xba\xbe")
"""How programs begin: Linux, scripts, Windows, macOS (64, 32 bits, both)."""


@dataclass(frozen=True)
class Build:
    """A player that can be started, or the Editor that somebody else starts."""

    name: str
    command: tuple[str, ...] | None
    """The program and the arguments that belong to it; None for the Editor."""
    is_unity: bool = True
    """Whether it understands Unity's own flags (`-batchmode`, `-logFile`)."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables that it needs."""

    @property
    def is_editor(self) -> bool:
        """Whether no process is started."""
        return self.command is None

    def command_line(self, port: int, *, graphics: bool = False, args: tuple[str, ...] = ()) -> list[str]:
        """Return the whole command for a player that is to call `port`.

        >>> Build("x", ("x.x86_64",)).command_line(5005, args=("--level", "2"))
        ['x.x86_64', '-nographics', '-batchmode', '--mlagents-port', '5005', '--level', '2']
        """
        if self.command is None:
            raise BuildError("the Editor is started by hand: press Play when told to.")
        headless = () if graphics or not self.is_unity else ("-nographics", "-batchmode")
        return [*self.command, *headless, "--mlagents-port", str(port), *args]


@dataclass(frozen=True)
class RegistryEntry:
    """One scene of a manifest."""

    name: str
    url: str | None
    """A zip for this platform; None where there is none."""
    description: str = ""
    expected_reward: float = 0.0
    additional_args: tuple[str, ...] = ()


def find_build(
    build: str | os.PathLike[str],
    *,
    cache_folder: str | Path | None = None,
    manifest: str | Path | None = None,
) -> Build:
    """Return the player that `build` names.

    Args:
        build: A path, `registry:NAME`, `editor` or `builtin:NAME`.
        cache_folder: Where scenes are unpacked; None for `build_cache()`.
        manifest: A manifest for `registry:`, a file or URL; None for `RACECRAFT_UNITY_MANIFEST` or ML-Agents' own.

    Raises:
        BuildError: It names nothing that can be started here.
    """
    text = os.fspath(build)
    cache = Path(cache_folder) if cache_folder is not None else build_cache()
    if text == "editor":
        return Build("editor", None)
    kind, _, name = text.partition(":")
    if kind == "builtin":
        return _builtin(name)
    if kind == "registry":
        return _from_registry(name, cache, manifest)
    return _from_path(Path(text), cache)


def build_cache() -> Path:
    """Return where builds are unpacked: in the user's own cache, since what lies there is started as a program."""
    return user_cache() / "racecraft" / "unity-builds"


def manifest_source(manifest: str | Path | None = None) -> str:
    """Return the file or address that a manifest is read from; None is `RACECRAFT_UNITY_MANIFEST` or ML-Agents' own."""
    return str(manifest or os.environ.get("RACECRAFT_UNITY_MANIFEST") or DEFAULT_MANIFEST)


def cached_scenes(cache_folder: Path | None = None) -> list[str]:
    """Return the names of the scenes that lie unpacked in the cache, `build_cache()` unless another is named."""
    cache = cache_folder or build_cache()
    folders = [path.name for path in sorted((cache / "binaries").glob("*")) if path.is_dir()]
    return [name for name, dash, _ in (folder.rpartition("-") for folder in folders) if dash]


def read_manifest(manifest: str | Path | None = None) -> dict[str, RegistryEntry]:
    """Return the scenes of a manifest, a YAML file or a URL of one, by name.

    Raises:
        BuildError: It cannot be fetched or read.
    """
    source = manifest_source(manifest)
    import yaml  # type: ignore[import-untyped,unused-ignore]

    try:
        listed = yaml.safe_load(_fetch(source).decode())["environments"]
        pairs = [pair for item in listed for pair in item.items()]
        return {name: _entry(name, facts or {}) for name, facts in pairs}
    except (yaml.YAMLError, KeyError, TypeError, AttributeError, ValueError) as cause:
        raise BuildError(
            "{source}: not a manifest of scenes ({cause!r}); expected `environments:`, a list of "
            "`NAME: {{linux_url: …, darwin_url: …, win_url: …}}`.",
            source=source,
            cause=cause,
        ) from cause


def fetch_entry(entry: RegistryEntry, cache_folder: Path) -> Path:
    """Return the folder of a manifest's scene, fetched and unpacked unless it is there."""
    if entry.url is None:
        raise BuildError(
            "registry:{name} has no build for this platform ({platform}).", name=entry.name, platform=_PLATFORM
        )
    digest = hashlib.md5(entry.url.encode(), usedforsecurity=False).hexdigest()
    folder = cache_folder / "binaries" / f"{entry.name}-{digest}"
    if not folder.is_dir():
        with tempfile.TemporaryDirectory() as scratch:
            archive = Path(scratch) / "build.zip"
            archive.write_bytes(_fetch(entry.url))
            _unpack(archive, folder)
    return folder


def executable_in(folder: Path) -> Path:
    """Return the one player in a folder, made executable.

    Raises:
        BuildError: There is none for this platform, or more than one.
    """
    found = _players_in(folder) or [player for sub in sorted(folder.iterdir()) if sub.is_dir() and sub.suffix != ".app"
                                    for player in _players_in(sub)]  # fmt: skip
    if len(found) != 1:
        listed = ", ".join(path.name for path in found) or "none"
        raise BuildError(
            "{folder}: players found: {listed}; expected exactly one for {platform}. Name the file itself.",
            folder=folder,
            listed=listed,
            platform=_PLATFORM,
        )
    return _made_executable(found[0])


def _builtin(name: str) -> Build:
    if name not in BUILTIN:
        raise BuildError("builtin:{name} is no built-in scene. {hint}", name=name, hint=nearest(name, BUILTIN))
    home = str(Path(racecraft.__file__).parent.parent)
    others = os.environ.get("PYTHONPATH")
    environment = {"PYTHONPATH": f"{home}{os.pathsep}{others}" if others else home}
    return Build(f"builtin:{name}", (sys.executable, "-P", "-m", BUILTIN[name]), False, environment)


def _from_registry(name: str, cache: Path, manifest: str | Path | None) -> Build:
    """Look in the cache first: a scene that is there needs no manifest and no network."""
    cached = [path for path in sorted((cache / "binaries").glob(f"{name}-*")) if _is_cached(path.name, name)]
    if cached and manifest is None:
        return Build(f"registry:{name}", (str(executable_in(cached[-1])),))
    try:
        entries = read_manifest(manifest)
    except BuildError as cause:
        ours = f" `builtin:{name}` is a stand-in that needs no download." if name in BUILTIN else ""
        raise BuildError(
            "registry:{name} is not in the cache {cache} and no manifest can be read: {cause} "
            "Give a local manifest (RACECRAFT_UNITY_MANIFEST), or the path of a build.{ours}",
            name=name,
            cache=cache / "binaries",
            cause=cause,
            ours=ours,
        ) from cause
    if name not in entries:
        raise BuildError("registry:{name} is not in the manifest. {hint}", name=name, hint=nearest(name, entries))
    entry = entries[name]
    return Build(f"registry:{name}", (str(executable_in(fetch_entry(entry, cache))), *entry.additional_args))


def _from_path(path: Path, cache: Path) -> Build:
    for place in _places(path):
        found = _at(place, cache)
        if found is not None:
            return Build(path.name, (str(found),))
    tried = " and ".join(str(place) for place in _places(path))
    raise BuildError(
        "{path}: no Unity build stands there (looked at {tried}); expected a player for {platform} "
        "({suffixes}), its folder, or a .zip. "
        "`builtin:Basic` needs no build, `editor` waits for the Unity Editor.",
        path=path,
        tried=tried,
        platform=_PLATFORM,
        suffixes=", ".join(suffix or "a plain file" for suffix in _SUFFIXES[_PLATFORM]),
    )


def _places(path: Path) -> list[Path]:
    channel = os.environ.get("SM_CHANNEL_TRAIN")
    return [path, Path(channel) / path] if channel and not path.is_absolute() else [path]


def _at(path: Path, cache: Path) -> Path | None:
    """The player at one place, or None."""
    if path.suffix == ".zip" and path.is_file():
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:32]
        folder = cache / "binaries" / f"{path.stem}-{digest}"
        if not folder.is_dir():
            _unpack(path, folder)
        return executable_in(folder)
    if path.suffix == ".app" and path.is_dir():
        return _inside_app(path)
    stem = path.with_suffix("") if path.suffix in _ALL_SUFFIXES else path
    for suffix in _SUFFIXES[_PLATFORM]:
        candidate = stem.with_name(stem.name + suffix)
        if candidate.is_file():
            return _made_executable(candidate)
        if suffix == ".app" and candidate.is_dir():
            return _inside_app(candidate)
    if path.is_file() and path.suffix not in _ALL_SUFFIXES:
        return _made_executable(path)
    return executable_in(path) if path.is_dir() else None


def _players_in(folder: Path) -> list[Path]:
    """Players directly in a folder; those with their `_Data` folder beside them before all others."""
    files = [path for path in sorted(folder.iterdir()) if not path.name.startswith("UnityCrashHandler")]
    if _PLATFORM == "darwin":
        return [_inside_app(path) for path in files if path.suffix == ".app"]
    if _PLATFORM == "win":
        return [path for path in files if path.suffix == ".exe"]
    named = [path for path in files if path.suffix in (".x86_64", ".x86") and path.is_file()]
    plain = [path for path in files if path.is_file() and (folder / f"{path.stem}_Data").is_dir()]
    with_data = [path for path in named if (folder / f"{path.stem}_Data").is_dir()]
    return with_data or named or plain


def _inside_app(app: Path) -> Path:
    inside = sorted((app / "Contents" / "MacOS").glob("*"))
    if len(inside) != 1:
        raise BuildError("{app}: {count} programs in Contents/MacOS; expected one.", app=app, count=len(inside))
    return _made_executable(inside[0])


def _made_executable(path: Path) -> Path:
    """Give a program its permission to run back: in a zip or a training channel it was lost."""
    path = path.absolute()
    if not os.access(path, os.X_OK):
        if not _is_program(path):
            raise BuildError(
                "{path}: is no program for this machine; expected a Unity player. Name the player itself.", path=path
            )
        try:
            path.chmod(0o755)
        except OSError as cause:
            raise BuildError(
                "{path}: not executable, and that cannot be changed ({cause}). chmod 755 it.", path=path, cause=cause
            ) from cause
    return path


def _is_program(path: Path) -> bool:
    """Tell by its first bytes whether a file is a program or a script."""
    try:
        with open(path, "rb") as file:
            return file.read(4).startswith(_PROGRAMS)
    except OSError:
        return True  # whoever may not read it may still be allowed to run it


def _unpack(archive: Path, folder: Path) -> None:
    """Unpack a zip so that the folder appears whole, executable, or not at all."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=folder.name, suffix=".part", dir=folder.parent))
    try:
        unpack(archive, part, "a zip of a build")
        for path in part.rglob("*"):
            path.chmod(0o755)
        part.chmod(0o755)
        if not folder.is_dir():  # another process may have been faster
            os.replace(part, folder)
    except ArchiveError as cause:
        raise BuildError(str(cause)) from cause
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _is_cached(folder_name: str, name: str) -> bool:
    return re.fullmatch(re.escape(name) + "-[0-9a-f]{32}", folder_name) is not None


def _entry(name: str, facts: Mapping[str, Any]) -> RegistryEntry:
    return RegistryEntry(
        name,
        facts.get(f"{_PLATFORM}_url"),
        str(facts.get("description", "")),
        float(facts.get("expected_reward", 0.0)),
        tuple(str(argument) for argument in facts.get("additional_args") or ()),
    )


def _fetch(source: str) -> bytes:
    """Return the bytes of a file, a file:// or an http(s):// address."""
    try:
        if urllib.parse.urlparse(source).scheme in ("http", "https", "file"):
            with urllib.request.urlopen(source, timeout=60) as reply:
                return bytes(reply.read())
        return Path(source).read_bytes()
    except (OSError, urllib.error.URLError, ValueError) as cause:
        if isinstance(cause, urllib.error.HTTPError):
            cause.close()  # the answer that says no
        raise BuildError("{source}: cannot be fetched ({cause}).", source=source, cause=cause) from cause
