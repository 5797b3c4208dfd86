"""Environments by name: a registered id, "module:ID", or a user's own "module:Class". Begin with `open_world`.

A class is a `gymnasium.Env`, made without arguments, or a `racecraft.contract.world.World`, made with `num_worlds`; a
function in its place returns a new environment. Any of them may say in `reward_threshold` at which mean return it
counts as solved.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import sys
from collections.abc import Iterator
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from racecraft.contract.errors import SettingError, UserInputError, nearest
from racecraft.contract.loading import add_cwd_to_path, load_class
from racecraft.contract.world import World
from racecraft.formats.run_folder import CODE, RunFolder
from racecraft.players.custom_code_loader import own_code_of
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld
from racecraft.worlds.gymnasium.env.from_vector_env import VectorEnvWorld, fits, has_vector_version
from racecraft.worlds.gymnasium.env.recipe import Recipe
from racecraft.worlds.gymnasium.env.user_env import made, telling

OF_SCRIPTS = ("from_script/", "racecraft.compat.script_worlds:")
"""How environments of launcher scripts are called (`compat/rllib_training.py`, `compat/script_worlds.py`)."""
REMADE_BY = "script_environment"
"""The module in a run's `code/` that makes such an environment known elsewhere."""
AS_REGISTERED = Recipe()
WORLD_PARTS = ("spec", "reset", "step", "save_state", "load_state", "close")
"""What a `World` has."""


def open_world(environment: str, num_worlds: int, recipe: Recipe = AS_REGISTERED) -> World:
    """Return so many copies of an environment side by side.

    Args:
        environment: A registered id, "module:ID", "module:Class" or "module:function".
        num_worlds: Copies.
        recipe: How each is made.

    Raises:
        UserInputError: No such environment, a space that cannot be shown, or a class of another shape.
    """
    _require_its_script(environment)
    own = own_class(environment)
    is_world = isinstance(own, type) and not issubclass(own, gymnasium.Env)
    if recipe and not is_world:
        return GymnasiumWorld(lambda: recipe.make(environment, own), num_worlds)
    if own is None:
        return GymnasiumWorld(environment, num_worlds)
    if not is_world:
        return GymnasiumWorld(own, num_worlds)
    if recipe:
        raise SettingError(
            "{environment} is a World, which is made with num_worlds alone; expected no --env-args and no --wrapper.",
            environment=environment,
        )
    _require_num_worlds(own, environment)
    world: World = made(telling(own), num_worlds=num_worlds)
    missing = [part for part in WORLD_PARTS if not hasattr(world, part)]
    if missing:
        raise SettingError(
            "{environment} lacks {missing}; expected a subclass of gymnasium.Env, or a class as "
            "`racecraft.contract.world.World` describes it.",
            environment=environment,
            missing=", ".join(missing),
        )
    return world


def open_judging_world(environment: str, num_worlds: int, recipe: Recipe = AS_REGISTERED) -> World:
    """Return so many copies to judge in: rows of the environment's own vector version where it registers one.

    Raises:
        UserInputError: As `open_world`.
    """
    _require_its_script(environment)
    if is_judged_as_rows(environment, recipe):
        envs = made(gymnasium.make_vec, environment, num_worlds, vectorization_mode="vector_entry_point")
        if fits(envs):
            return VectorEnvWorld(environment, envs)
        envs.close()
    return open_world(environment, num_worlds, recipe)


def is_judged_as_rows(environment: str, recipe: Recipe = AS_REGISTERED) -> bool:
    """Tell whether an environment registers a vector version, in which it is judged.

    Raises:
        UserInputError: There is no such environment.
    """
    return not recipe and own_class(environment) is None and has_vector_version(_spec_of(environment))


def _require_num_worlds(own: type, environment: str) -> None:
    """Refuse a class that is not made as worlds are.

    Raises:
        SettingError: Its making takes no `num_worlds`, or wants more.
    """
    try:
        inspect.signature(own).bind(num_worlds=1)
    except TypeError as error:
        raise SettingError(
            "{environment}: {error}; expected a World that is made with num_worlds=N.",
            environment=environment,
            error=error,
        ) from error
    except ValueError:
        pass  # a compiled class hides its parameters; its making will tell


@contextlib.contextmanager
def opened_judging_world(run: RunFolder, num_worlds: int) -> Iterator[World]:
    """Open the environment that a run was trained in to judge in it, with the run's own code where it has some.

    Raises:
        UserInputError: There is no such environment here, or its script fails.
    """
    request = run.read_job()["asked"]
    environment = request["environment"]
    with own_code_of(run):
        if not _is_known(environment) and (run.path / CODE / f"{REMADE_BY}.py").is_file():
            importlib.import_module(REMADE_BY)
        world = open_judging_world(environment, num_worlds, Recipe.of_data(request))
        try:
            yield world
        finally:
            world.close()


def _is_known(environment: str) -> bool:
    """Tell whether what a launcher script made was made in this process, or is none of it."""
    module, _, name = environment.partition(":")
    is_here = hasattr(sys.modules.get(module), name) if name else environment in gymnasium.registry
    return is_here or not environment.startswith(OF_SCRIPTS)


def _require_its_script(environment: str) -> None:
    """Refuse what a launcher script made, outside that script.

    Raises:
        SettingError: It is not made here.
    """
    if not _is_known(environment):
        raise SettingError(
            "{environment}: a script made this environment (register_env), which is not in this run; expected to be "
            "opened in that script: write `import racecraft as rc; print(rc.evaluate(RUN))` behind its train_main() "
            "and begin it with `racecraft run`. The policy alone goes anywhere: `racecraft serve RUN`, "
            "rc.load_policy(RUN).",
            environment=environment,
        )


def own_class(environment: str) -> Any:
    """Return the class or function that "module:name" names; None where the name is an id that Gymnasium knows.

    Raises:
        SettingError: There is no such module, or it has no such class or function.
    """
    module, colon, name = environment.partition(":")
    if not colon:
        return None
    add_cwd_to_path()
    if not name.isidentifier():
        return None  # "module:Name-v0" is an id; Gymnasium imports the module itself
    found = load_class(environment, "gym train")
    if not callable(found):
        raise SettingError(
            "{environment} is {type_name}, no class; expected a gymnasium.Env, a World, or a function that returns a "
            "new environment.",
            environment=environment,
            type_name=type(found).__name__,
        )
    return found


def reward_threshold(environment: str) -> float | None:
    """Return the mean return at which an environment counts as solved, where it or its registration says one.

    Raises:
        UserInputError: No such environment.
    """
    own = own_class(environment)
    if own is not None:
        threshold = getattr(own, "reward_threshold", None)
        return None if threshold is None else float(threshold)
    return _spec_of(environment).reward_threshold


def _spec_of(environment: str) -> EnvSpec:
    """Return how an id is registered.

    Raises:
        UserInputError: It is not.
    """
    module, _, name = environment.rpartition(":")
    try:
        if module:
            __import__(module)
        return gymnasium.spec(name)
    except ModuleNotFoundError as error:
        raise SettingError(
            "{environment}: there is no module '{name}'; expected the package that registers the environment, "
            "installed or in this folder.",
            environment=environment,
            name=error.name,
        ) from error
    except gymnasium.error.Error as error:
        known = sorted(gymnasium.registry)
        raise UserInputError(
            "There is no Gymnasium environment '{environment}'. {hint}",
            environment=environment,
            hint=_hint(name, known),
        ) from error


def _hint(name: str, known: list[str]) -> str:
    hint = nearest(name, known)
    return hint if hint.startswith("Did") else "`import` the package that registers it, or name a built-in one."
