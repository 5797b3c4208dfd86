"""Train what a script asks of Stable-Baselines' PPO1. Begin with `train_ppo1`; `baselines_config.py` translates."""

from __future__ import annotations

import copy
import csv
import itertools
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from racecraft.analysis.video import encode_film
from racecraft.compat.baselines_config import WORLDS, translated
from racecraft.compat.episode_listener import Watched
from racecraft.compat.names.gym import Wrapper, make
from racecraft.compat.old_gym import FromOldGym
from racecraft.compat.rllib_training import register_env, registered
from racecraft.compat.stored_environments import exit_if_restarted, script_code
from racecraft.contract.errors import RacecraftError, SettingError, UserInputError
from racecraft.contract.world import Array
from racecraft.formats.atomic import OutputFileError, output_error
from racecraft.formats.run_folder import JOB
from racecraft.players.trained import load_policy
from racecraft.training import worlds
from racecraft.training.callbacks import IterationReport, NullCallback
from racecraft.training.trained import Trained
from racecraft.worlds.gymnasium.evaluation import reward_threshold
from racecraft.worlds.gymnasium.training.trainer import GymRequest

REMEMBERED = 100
"""Episodes that PPO1's means look back on."""
LONGEST_EPISODE = 1000
"""Steps after which an episode of an environment without a limit of its own is cut."""
FILM, FILM_STEPS, FILM_RATE = "rl_out.mp4", 1000, 30
MONITOR = "0.monitor.csv"
"""Every training episode, as Stable-Baselines' `Monitor` writes them: r, l, t."""
CONTAINER_ROOM, OWN_ROOM = "/opt/ml/output/intermediate", "SM_OUTPUT_INTERMEDIATE_DIR"
TAGGED = "[1,0]<stdout>:"
"""What `mpirun --tag-output` lays before each line; the notebook's metric definitions look for it."""


class MadeEnv(Wrapper):
    """What `create_env` made; it can be made again."""

    def __init__(self, name: str, seed: int) -> None:
        try:
            reward_threshold(name)
        except UserInputError as error:
            raise SettingError(_unknown(name, str(error))) from error
        super().__init__(make(name))
        self.name = name
        self.seed(seed)


class Episodes:
    """Training episodes as they end: what PPO1's table and the monitor's file say of them.

    Args:
        folder: Where the file goes; None: nowhere yet.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder, self.count = folder, 0
        self._latest: deque[tuple[float, int]] = deque(maxlen=REMEMBERED)
        self._begun = time.time()

    def ended(self, reward: float, steps: int) -> None:
        """Take an episode in."""
        self.count += 1
        self._latest.append((reward, steps))
        if self.folder is not None:
            self._write(self.folder / MONITOR, reward, steps)

    def means(self) -> tuple[float, float] | None:
        """Return mean reward and mean steps of the latest; None before the first."""
        if not self._latest:
            return None
        reward, steps = np.mean(np.array(self._latest), axis=0)
        return float(reward), float(steps)

    def _write(self, path: Path, reward: float, steps: int) -> None:
        try:
            is_new = not path.exists()
            with path.open("a", newline="", encoding="utf-8") as file:
                if is_new:
                    file.write(f'#{{"t_start": {self._begun:.3f}}}\n')
                rows = csv.writer(file)
                rows.writerows([["r", "l", "t"]] * is_new)
                rows.writerow([f"{reward:.6g}", steps, f"{time.time() - self._begun:.3f}"])
        except OSError as error:
            raise OutputFileError(output_error(path, error)) from error


class Ppo1Lines(NullCallback):
    """Says after each iteration what PPO1 said, so that metric definitions go on finding it.

    Args:
        episodes: What its table is about.
        tag: Laid before every line.
    """

    def __init__(self, episodes: Episodes, tag: str) -> None:
        self._episodes, self._tag, self._told = episodes, tag, 0

    def run_made(self, path: Path) -> None:
        """A script that names a container's folder outside a job finds its files in the run."""
        if self._episodes.folder is None:
            self._episodes.folder = path

    def iteration(self, report: IterationReport) -> None:
        """Print an iteration once."""
        if report.iteration == self._told:
            return
        self._told = report.iteration
        rows = {"EpisodesSoFar": self._episodes.count, "TimestepsSoFar": report.steps, "TimeElapsed": report.seconds}
        means = self._episodes.means()
        if means is not None:
            rows = {"EpLenMean": means[1], "EpRewMean": means[0], **rows}
        for name, value in rows.items():
            print(f"{self._tag}| {name:<15} | {value:<12.8g} |")
        print(end="", flush=True)


def train_ppo1(env: Any, output_path: str, words: Mapping[str, Any], tag: str = "") -> Trained:
    """Train, and film what was trained; inside a job the run folder stands in its model.

    Args:
        env: The script's environment, of the old gym or the new.
        output_path: Where the film and the monitor's file go.
        words: PPO1's arguments.
        tag: Laid before every line of its table.

    Raises:
        SettingError: Something is not understood, or the environment cannot be copied.
    """
    translation = translated(words)
    episodes = Episodes(_output_folder(output_path))
    register_env("environment", _watched(_copies_of(env), episodes))
    environment = registered("environment", {}, _longest(env))
    exit_if_restarted()
    lines, model = Ppo1Lines(episodes, tag), os.environ.get("SM_MODEL_DIR")
    run = Path(model, "run") if model else None
    if run is not None and (run / JOB).exists():
        trained = worlds.resume(run, (translation.stop,), lines, print, "gymnasium")
    else:
        code = script_code(environment)
        request = GymRequest(
            environment, stops=(translation.stop,), run=run, overrides=translation.settings, environment_code=code
        )
        trained = worlds.train(request, lines)
    _film(env, trained, episodes.folder or trained.run.path)
    return trained


def _output_folder(output_path: str) -> Path | None:
    """Return the folder of what a script leaves; None: it names a container's, and there is no job."""
    own = os.environ.get(OWN_ROOM)
    if Path(output_path).is_relative_to(CONTAINER_ROOM):
        return Path(own) / Path(output_path).relative_to(CONTAINER_ROOM) if own else None
    folder = Path(output_path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFileError(output_error(folder, error)) from error
    return folder


def _watched(made: Callable[[], Any], episodes: Episodes) -> Callable[[Any], Any]:
    """Return how a world's environment is made: those that are learned in come first, and are told of."""
    number = itertools.count()

    def creator(_: Any) -> Any:
        env = FromOldGym(made())
        return Watched(env, episodes.ended) if next(number) < WORLDS else env

    return creator


def _copies_of(env: Any) -> Callable[[], Any]:
    if type(env) is MadeEnv:
        return lambda: make(env.name)
    try:
        copy.deepcopy(env)
    except Exception as error:
        raise SettingError(
            "env is {type_name}, which cannot be copied ({type_name_2}: {error}); {worlds} worlds "
            "stand side by side. Expected one that create_env made, or that copy.deepcopy takes.",
            type_name=type(env).__name__,
            type_name_2=type(error).__name__,
            error=error,
            worlds=WORLDS,
        ) from error
    return lambda: copy.deepcopy(env)


def _longest(env: Any) -> int:
    spec = getattr(env, "spec", None)
    return getattr(spec, "max_episode_steps", None) or LONGEST_EPISODE


def _unknown(name: str, message: str) -> str:
    if name.startswith("Roboschool"):
        bare = name.removeprefix("Roboschool").rpartition("-v")[0]
        return (
            f"environment {name}: Roboschool was given up in 2019 and installs on no Python of today. Gymnasium's own "
            f'robots are nearest: create_env(env_id="{bare}-v5") where it has one, after '
            "`pip install 'gymnasium[mujoco]'`."
        )
    return f"environment {name}: {message}"


def _film(env: Any, trained: Trained, folder: Path) -> None:
    """Film the trained policy, or say why there is no film; a training is not lost for want of one."""
    if type(env) is not MadeEnv:
        print(f"- {FILM}: no film, for the script's own environment is shown by nobody else")
        return
    try:
        environment = gymnasium.make(env.name, render_mode="rgb_array")
    except Exception as error:  # an environment's own affair: what it draws with may be missing
        print(f"- {FILM}: no film ({error})")
        return
    rate = float(environment.metadata.get("render_fps", FILM_RATE))
    try:
        encode_film(folder / FILM, _pictures(environment, trained), rate, env.name)
        print(f"- {folder / FILM}")
    except (RacecraftError, gymnasium.error.Error) as error:
        print(f"- {FILM}: no film ({error})")
    finally:
        environment.close()


def _pictures(environment: gymnasium.Env[Any, Any], trained: Trained) -> Iterator[Array]:
    """Yield what the greedy policy does, (H, W, 3) uint8 with even sides."""
    policy = load_policy(trained.run)
    name = next(iter(policy.spec.visible))
    part = policy.spec.visible[name]
    seen, _ = environment.reset(seed=0)
    for _ in range(FILM_STEPS):
        (action,) = policy.act({name: np.asarray(seen, part.dtype).reshape(1, *part.shape)})
        seen, _, terminated, truncated, _ = environment.step(action)
        if terminated or truncated:
            seen, _ = environment.reset()
        picture: Any = environment.render()
        yield np.ascontiguousarray(picture[: len(picture) // 2 * 2, : picture.shape[1] // 2 * 2])
