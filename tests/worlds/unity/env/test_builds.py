"""Where players come from: paths, zips, the registry's cache and manifests, SageMaker's channel."""

import functools
import hashlib
import http.server
import os
import sys
import threading
import zipfile

import pytest

from racecraft.worlds.unity.env.builds import (
    Build,
    RegistryEntry,
    cached_scenes,
    executable_in,
    find_build,
    read_manifest,
)
from racecraft.worlds.unity.env.errors import BuildError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the builds made here are Linux builds")


def make_build(folder, name="Game", suffix=".x86_64"):
    """A build as Unity lays it out, without its permission to run."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}_Data").mkdir()
    (folder / "UnityPlayer.so").write_bytes(b"")
    (folder / "UnityCrashHandler64.exe").write_bytes(b"")
    (folder / (name + suffix)).write_text("#!/bin/sh\n")
    return folder / (name + suffix)


def zipped(folder, archive):
    with zipfile.ZipFile(archive, "w") as into:
        for path in folder.rglob("*"):
            into.write(path, path.relative_to(folder.parent))
    return archive


@pytest.mark.parametrize("word", ["Game.x86_64", "Game", "Game.app", "Game.exe", "Game.x86", "."])
def test_every_way_to_name_a_build_finds_it(tmp_path, word):
    player = make_build(tmp_path)
    build = find_build(tmp_path / word)
    assert build.command == (str(player),)
    assert os.access(player, os.X_OK)


def test_a_player_without_suffix_is_known_by_its_data_folder(tmp_path):
    player = make_build(tmp_path, suffix="")
    assert find_build(tmp_path).command == (str(player),)
    assert find_build(player).command == (str(player),)


def test_a_zip_is_unpacked_once_and_whole(tmp_path):
    make_build(tmp_path / "Game")
    archive = zipped(tmp_path / "Game", tmp_path / "Game.zip")
    first = find_build(archive, cache_folder=tmp_path / "cache")
    assert os.access(first.command[0], os.X_OK)
    assert find_build(archive, cache_folder=tmp_path / "cache") == first
    assert [path.suffix for path in (tmp_path / "cache" / "binaries").iterdir()] == [""]


def test_a_broken_zip_leaves_nothing_in_the_cache(tmp_path):
    make_build(tmp_path / "Game")
    archive = zipped(tmp_path / "Game", tmp_path / "Game.zip")
    archive.write_bytes(archive.read_bytes()[:200])
    with pytest.raises(BuildError, match="not a zip"):
        find_build(archive, cache_folder=tmp_path / "cache")
    assert list((tmp_path / "cache" / "binaries").iterdir()) == []


def test_what_is_not_there_is_told_with_what_would_do(tmp_path):
    with pytest.raises(BuildError, match=r"no Unity build stands there(.|\n)*builtin:Basic"):
        find_build(tmp_path / "Nothing")
    with pytest.raises(BuildError, match="found: none"):
        find_build(tmp_path)
    with pytest.raises(BuildError, match="Known: Basic|Did you mean 'Basic'"):
        find_build("builtin:Basics")


def test_two_players_in_a_folder_must_be_told_apart(tmp_path):
    make_build(tmp_path, "A")
    make_build(tmp_path, "B")
    with pytest.raises(BuildError, match=r"A.x86_64, B.x86_64"):
        find_build(tmp_path)
    assert executable_in(make_build(tmp_path / "C", "C").parent).name == "C.x86_64"


def test_a_build_in_the_training_channel_is_found_and_made_executable(tmp_path, monkeypatch):
    player = make_build(tmp_path / "channel", "Basic")
    monkeypatch.setenv("SM_CHANNEL_TRAIN", str(tmp_path / "channel"))
    monkeypatch.chdir(tmp_path)
    assert find_build("Basic").command == (str(player),)
    assert os.access(player, os.X_OK)


def test_the_registry_looks_into_ml_agents_own_cache_first(tmp_path):
    url = "https://example.org/basic.zip"
    folder = tmp_path / "binaries" / f"Basic-{hashlib.md5(url.encode()).hexdigest()}" / "Basic"
    player = make_build(folder, "Basic")
    assert find_build("registry:Basic", cache_folder=tmp_path).command == (str(player),)


def test_a_local_manifest_leads_to_a_zip(tmp_path, monkeypatch):
    pytest.importorskip("yaml")
    make_build(tmp_path / "Game")
    archive = zipped(tmp_path / "Game", tmp_path / "game.zip")
    manifest = tmp_path / "manifest.yaml"
    manifest.write_text(
        "environments:\n"
        f"  - Game: {{expected_reward: 0.9, description: A game, linux_url: '{archive.as_uri()}', "
        "additional_args: ['--level', 2]}\n"
        "  - Mac: {darwin_url: 'https://example.org/mac.zip'}\n"
    )
    build = find_build("registry:Game", cache_folder=tmp_path / "cache", manifest=manifest)
    assert build.command[1:] == ("--level", "2")
    digest = hashlib.md5(archive.as_uri().encode()).hexdigest()
    assert (tmp_path / "cache" / "binaries" / f"Game-{digest}").is_dir()
    monkeypatch.setenv("RACECRAFT_UNITY_MANIFEST", str(manifest))
    assert read_manifest()["Game"].expected_reward == 0.9
    with pytest.raises(BuildError, match="no build for this platform"):
        find_build("registry:Mac", cache_folder=tmp_path / "cache")
    with pytest.raises(BuildError, match="Did you mean 'Game'"):
        find_build("registry:Gane", cache_folder=tmp_path / "cache")


@pytest.fixture
def web(tmp_path):
    """Serve a folder on loopback; return the folder, its address, and what was asked for."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            asked.append(self.path)

    folder, asked = tmp_path / "web", []
    folder.mkdir()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield folder, f"http://127.0.0.1:{server.server_port}", asked
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_remote_manifest_leads_to_a_remote_zip_fetched_once(tmp_path, monkeypatch, web):
    pytest.importorskip("yaml")
    folder, address, asked = web
    make_build(tmp_path / "Game")
    zipped(tmp_path / "Game", folder / "game.zip")
    (folder / "manifest.yaml").write_text(f"environments:\n  - Game: {{linux_url: '{address}/game.zip'}}\n")
    monkeypatch.setenv("RACECRAFT_UNITY_MANIFEST", f"{address}/manifest.yaml")
    build = find_build("registry:Game", cache_folder=tmp_path / "cache")
    assert os.access(build.command[0], os.X_OK)
    assert find_build("registry:Game", cache_folder=tmp_path / "cache") == build
    assert asked == ["/manifest.yaml", "/game.zip"]


def test_a_scene_that_the_web_lost_is_a_letter(tmp_path, web):
    pytest.importorskip("yaml")
    folder, address, _ = web
    (folder / "manifest.yaml").write_text(f"environments:\n  - Game: {{linux_url: '{address}/gone.zip'}}\n")
    with pytest.raises(BuildError, match=r"gone.zip: cannot be fetched \(HTTP Error 404"):
        find_build("registry:Game", cache_folder=tmp_path / "cache", manifest=f"{address}/manifest.yaml")
    with pytest.raises(BuildError, match="builtin:Basic"):
        find_build("registry:Basic", cache_folder=tmp_path / "cache", manifest=f"{address}/absent.yaml")


@pytest.mark.parametrize("text", ["environments: 3", "[", "nothing: here", "- a\n- b"])
def test_a_broken_manifest_is_a_letter(tmp_path, text):
    pytest.importorskip("yaml")
    (tmp_path / "manifest.yaml").write_text(text)
    with pytest.raises(BuildError, match=r"(?s)not a manifest|cannot be read"):
        find_build("registry:Basic", cache_folder=tmp_path, manifest=tmp_path / "manifest.yaml")


def test_without_cache_and_network_the_stand_in_is_named(tmp_path):
    pytest.importorskip("yaml")
    with pytest.raises(BuildError, match="builtin:Basic"):
        find_build("registry:Basic", cache_folder=tmp_path, manifest=tmp_path / "absent.yaml")


@pytest.mark.parametrize("word", ["Game", "Game.app", "."])
def test_an_app_is_known_by_the_program_inside(tmp_path, monkeypatch, word):
    """As on a Mac, where a build is a folder."""
    monkeypatch.setattr("racecraft.worlds.unity.env.builds._PLATFORM", "darwin")
    program = tmp_path / "Game.app" / "Contents" / "MacOS" / "Game Title"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    assert find_build(tmp_path / word).command == (str(program),)
    assert os.access(program, os.X_OK)
    (program.parent / "Another").write_text("#!/bin/sh\n")
    with pytest.raises(BuildError, match="2 programs in Contents/MacOS"):
        find_build(tmp_path / word)


def test_on_windows_the_crash_handler_is_not_the_player(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.unity.env.builds._PLATFORM", "win")
    player = make_build(tmp_path, suffix=".exe")
    for word in (".", "Game", "Game.exe"):
        assert find_build(tmp_path / word).command == (str(player),)


def test_a_file_that_is_no_program_is_refused_and_left_as_it_is(tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("buy milk")
    before = notes.stat().st_mode
    with pytest.raises(BuildError, match="is no program"):
        find_build(notes)
    assert notes.stat().st_mode == before


def test_the_editor_is_no_process():
    build = find_build("editor")
    assert build.is_editor
    with pytest.raises(BuildError, match="press Play"):
        build.command_line(5004)


def test_unitys_own_flags_go_to_unitys_players_alone():
    assert Build("x", ("x",), is_unity=False).command_line(5) == ["x", "--mlagents-port", "5"]
    assert Build("x", ("x",)).command_line(5)[1:3] == ["-nographics", "-batchmode"]
    assert Build("x", ("x",)).command_line(5, graphics=True) == ["x", "--mlagents-port", "5"]


def test_what_is_unpacked_from_a_zip_may_be_run_and_is_found_by_its_name_too(tmp_path):
    """Laid out as ML-Agents' own: its cache knows scenes by a digest of 32 letters."""
    make_build(tmp_path / "Game")
    archive = zipped(tmp_path / "Game", tmp_path / "Game.zip")
    build = find_build(archive, cache_folder=tmp_path / "cache")
    (folder,) = (tmp_path / "cache" / "binaries").iterdir()
    modes = {path.stat().st_mode & 0o777 for path in [folder, *folder.rglob("*")]}
    assert modes == {0o755}
    assert find_build("registry:Game", cache_folder=tmp_path / "cache").command == build.command
    assert cached_scenes(tmp_path / "cache") == ["Game"]


def test_the_cache_is_the_users_own_unless_another_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("RACECRAFT_CACHE", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "everybodys"))
    make_build(tmp_path / "everybodys" / "ml-agents-binaries" / "binaries" / f"Game-{'f' * 32}" / "theirs", "Game")
    place = tmp_path / "racecraft" / "unity-builds" / "binaries"
    first, last = (make_build(place / f"Game-{letter * 32}" / "inside", "Game") for letter in "0f")
    (place / "notes").mkdir()
    (place / f"Other-{'0' * 32}").write_text("no folder")
    (last.parent.parent / "readme.txt").write_text("beside it")
    assert find_build("registry:Game").command == (str(last),)
    assert cached_scenes() == ["Game", "Game"]
    assert cached_scenes(tmp_path / "elsewhere") == []
    assert first.exists()


def test_a_manifest_that_is_named_is_asked_though_the_cache_holds_the_scene(tmp_path):
    pytest.importorskip("yaml")
    make_build(tmp_path / "binaries" / f"Game-{'0' * 32}", "Game")
    (tmp_path / "manifest.yaml").write_text("environments:\n  - Other:\n  - Mac: {darwin_url: 'https://example.org'}\n")
    with pytest.raises(BuildError, match="registry:Game is not in the manifest"):
        find_build("registry:Game", cache_folder=tmp_path, manifest=tmp_path / "manifest.yaml")
    assert read_manifest(tmp_path / "manifest.yaml")["Other"] == RegistryEntry("Other", None)


def test_a_player_is_told_from_what_lies_beside_it(tmp_path):
    """Without its data folder too; what is no folder holds no player."""
    player = tmp_path / "Game.x86_64"
    player.write_text("#!/bin/sh\n")
    (tmp_path / "readme.txt").write_text("play")
    (tmp_path / "old.x86_64").mkdir()
    assert find_build(tmp_path).command == (str(player),)
    assert player.stat().st_mode & 0o777 == 0o755
