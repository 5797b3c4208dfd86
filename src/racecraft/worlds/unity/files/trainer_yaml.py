"""ML-Agents' trainer configuration, the YAML that `mlagents-learn` takes.

Begin with `read_trainer_yaml`. What the file gives is kept as it stands; what stands in for the rest is the caller's
choice. `BehaviorConfig.overrides` says it in the names of our settings. What is read and not followed is named in
`notes`, each with its key; so is what is done as ML-Agents does it where the file is silent (schedules that fall,
500,000 steps). What asks for another way of learning altogether (POCA, self-play) is in `unfollowed`, too. A key that
ML-Agents itself would not know is refused with the nearest known one.

Source: facts: unity-ml-agents, "What others offer" (the file's groups), ML-Agents' trainer configuration reference.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn

from racecraft.contract.errors import InputFileError, nearest
from racecraft.contract.message import Message
from racecraft.formats.user_file import read_regular
from racecraft.worlds.unity.files.trainer_config import (
    DEFAULT_MAX_STEPS,
    DEFAULT_MEMORY_SIZE,
    DEFAULT_SEQUENCE_LENGTH,
    ENCODERS,
    PPO,
    SAC,
    SILENT_DEFAULTS,
    BehaviorConfig,
    Lesson,
    Sampler,
    TrainerConfig,
)

__all__ = ["BehaviorConfig", "Sampler", "TrainerConfig", "TrainerConfigError", "read_trainer_yaml"]


MAX_CHARACTERS = 1 << 17
"""Of a file that a person wrote; PyYAML takes seconds for more."""


class TrainerConfigError(InputFileError):
    """An ML-Agents trainer configuration cannot be used."""


_TOP = (
    "behaviors", "default_settings", "env_settings", "engine_settings", "environment_parameters",
    "checkpoint_settings", "torch_settings", "debug",
)  # fmt: skip
_BEHAVIOR = (
    "trainer_type", "hyperparameters", "network_settings", "reward_signals", "init_path", "keep_checkpoints",
    "even_checkpoints", "checkpoint_interval", "max_steps", "time_horizon", "summary_freq", "threaded", "self_play",
    "behavioral_cloning",
)  # fmt: skip
_HYPERPARAMETERS = (
    "batch_size", "buffer_size", "learning_rate", "learning_rate_schedule", "beta", "beta_schedule", "epsilon",
    "epsilon_schedule", "lambd", "num_epoch", "shared_critic", "buffer_init_steps", "init_entcoef", "tau",
    "steps_per_update", "save_replay_buffer", "reward_signal_steps_per_update",
)  # fmt: skip
_NETWORK = (
    "hidden_units", "num_layers", "normalize", "vis_encode_type", "memory", "goal_conditioning_type", "deterministic",
    "conditioning_type", "max_num_agents",
)  # fmt: skip
_EXTRINSIC = ("strength", "gamma", "network_settings")
_SIGNAL = (*_EXTRINSIC, "learning_rate", "encoding_size")
_CLONING = ("demo_path", "strength", "steps", "samples_per_update", "num_epoch", "batch_size")
_IMITATION = ("demo_path", "use_actions", "use_vail")
_ENV = (
    "env_path", "env_args", "base_port", "num_envs", "num_areas", "timeout_wait", "seed", "max_lifetime_restarts",
    "restarts_rate_limit_n", "restarts_rate_limit_period_s",
)  # fmt: skip
_ENGINE = ("width", "height", "quality_level", "time_scale", "target_frame_rate", "capture_frame_rate")
_CHECKPOINTS = (
    "run_id", "initialize_from", "load_model", "resume", "force", "train_model", "inference", "results_dir",
)  # fmt: skip
_SAMPLERS = {
    "uniform": ("min_value", "max_value"),
    "gaussian": ("mean", "st_dev"),
    "multirangeuniform": ("intervals",),
}
_CRITERIA = (
    "measure", "behavior", "signal_smoothing", "min_lesson_length", "threshold", "require_reset",
)  # fmt: skip


def read_trainer_yaml(path: str | Path) -> TrainerConfig:
    """Read an ML-Agents trainer configuration.

    Raises:
        TrainerConfigError: It cannot be read, holds a key nobody knows, or a value of the wrong kind.
    """
    return _Reader(Path(path)).read()


class _Reader:
    """Reads one file, remembering on which line each key stands."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self.lines: dict[tuple[str, ...], int] = {}

    def read(self) -> TrainerConfig:
        top = self._load()
        self._refuse_old(top)
        self._know(top, _TOP, ())
        defaults = self._group(top, "default_settings", ())
        named = self._group(top, "behaviors", ())
        behaviors = {}
        for name in named:
            behaviors[name] = self._behavior(name, defaults, self._group(named, name, ("behaviors",)))
        if "default_settings" in top:
            behaviors["*"] = self._behavior("*", {}, defaults)
        checkpoints = self._group(top, "checkpoint_settings", ())
        self._know(checkpoints, _CHECKPOINTS, ("checkpoint_settings",))
        inference = self._switch(checkpoints, "inference", ("checkpoint_settings",)) or False
        if set(checkpoints) - {"inference"}:
            self._note(("checkpoint_settings",), "run folders of our own are used")
        return TrainerConfig(
            behaviors=behaviors,
            **self._environment(self._group(top, "env_settings", ())),
            **self._engine(self._group(top, "engine_settings", ())),
            **self._parameters(self._group(top, "environment_parameters", ()), inference),
            inference=inference,
            device=self._device(self._group(top, "torch_settings", ())),
            notes=tuple(dict.fromkeys(self.notes)),
        )

    def _refuse_old(self, top: dict[str, Any]) -> None:
        """Refuse the form of ML-Agents 0.18 and older, of 2020: behaviors at the top, each with its `trainer`."""
        for at, group in (((), top), (("behaviors",), self._group(top, "behaviors", ()))):
            for name, section in group.items():
                if isinstance(section, dict) and "trainer" in section:
                    self._refuse(
                        (*at, name, "trainer"), "a section of ML-Agents 0.18 or older, of 2020",
                        "sections under `behaviors:` with `trainer_type`, `hyperparameters` and `network_settings`",
                        "ML-Agents' own converter rewrites it: python -m mlagents.trainers.upgrade_config",
                    )  # fmt: skip

    def _load(self) -> dict[str, Any]:
        import yaml  # type: ignore[import-untyped,unused-ignore]

        try:
            text = read_regular(self.path).decode("utf-8-sig")
        except (OSError, UnicodeDecodeError) as cause:
            raise TrainerConfigError(
                self.path, Message("cannot be read ({cause})", cause=cause), "a YAML file"
            ) from cause
        if len(text) > MAX_CHARACTERS:
            raise TrainerConfigError(
                self.path, Message("{count:,} characters", count=len(text)), "a trainer configuration"
            )
        try:
            tree = yaml.compose(text, Loader=yaml.SafeLoader)
            self._remember_lines(tree, ())
            value = yaml.safe_load(text)
        except (yaml.YAMLError, ValueError, RecursionError) as cause:
            line = getattr(getattr(cause, "problem_mark", None), "line", None)
            raise TrainerConfigError(
                self.path,
                Message("not YAML: {problem}", problem=getattr(cause, "problem", None) or cause),
                "a trainer configuration",
                line=None if line is None else line + 1,
            ) from cause
        if not isinstance(value, dict):
            raise TrainerConfigError(
                self.path, Message("holds {kind}", kind=_kind(value)), "`behaviors:` and other groups"
            )
        return {str(key): part for key, part in value.items()}

    def _remember_lines(self, node: Any, at: tuple[str, ...]) -> None:
        if node is None or node.id != "mapping" or len(at) > 6:
            return
        for key, part in node.value:
            here = (*at, str(key.value))
            self.lines[here] = key.start_mark.line + 1
            self._remember_lines(part, here)

    def _behavior(self, name: str, defaults: dict[str, Any], given: dict[str, Any]) -> BehaviorConfig:
        at = ("behaviors", name) if name != "*" else ("default_settings",)
        section = _merged(defaults, given)
        self._know(section, _BEHAVIOR, at)
        kind = section.get("trainer_type", PPO)
        if kind not in (PPO, SAC):
            self._note((*at, "trainer_type"), f"'{kind}' is not followed; PPO learns instead")
        unfollowed = [f"trainer_type: {kind}"] if kind not in (PPO, SAC) else []
        unfollowed += ["self_play"] if section.get("self_play") is not None else []
        rates = self._group(section, "hyperparameters", at)
        network = self._group(section, "network_settings", at)
        self._know(rates, _HYPERPARAMETERS, (*at, "hyperparameters"))
        self._know(network, _NETWORK, (*at, "network_settings"))
        self._note_what_is_left(at, section, rates, network)
        inside, of_network = (*at, "hyperparameters"), (*at, "network_settings")
        schedules: dict[str, Any] = {**self._schedules(rates, inside, kind)}
        memory_size, sequence_length = self._memory(network, of_network)
        found = BehaviorConfig(
            name=name,
            batch_size=self._integer(rates, "batch_size", inside, 1),
            buffer_size=self._integer(rates, "buffer_size", inside, 1),
            learning_rate=self._number(rates, "learning_rate", inside, 0.0),
            beta=self._number(rates, "beta", inside, 0.0),
            epsilon=self._number(rates, "epsilon", inside, 0.0, 1.0),
            lambd=self._number(rates, "lambd", inside, 0.0, 1.0),
            num_epoch=self._integer(rates, "num_epoch", inside, 1),
            gamma=self._gamma(self._group(section, "reward_signals", at), (*at, "reward_signals")),
            hidden_units=self._integer(network, "hidden_units", of_network, 1),
            num_layers=self._integer(network, "num_layers", of_network, 1),
            vis_encode_type=self._encoder(network, of_network),
            max_steps=self._integer(section, "max_steps", at, 1) or DEFAULT_MAX_STEPS,
            **schedules,
            normalize=self._switch(network, "normalize", of_network),
            time_horizon=self._integer(section, "time_horizon", at, 1),
            memory_size=memory_size,
            sequence_length=sequence_length,
            signals=self._signals(self._group(section, "reward_signals", at), (*at, "reward_signals")),
            cloning=self._cloning(section, at),
            trainer=str(kind),
            tau=self._number(rates, "tau", inside, 0.0, 1.0),
            steps_per_update=self._number(rates, "steps_per_update", inside, 1.0),
            buffer_init_steps=self._integer(rates, "buffer_init_steps", inside, 0),
            init_entcoef=self._number(rates, "init_entcoef", inside, 1e-6, 1e3),
            unfollowed=tuple(unfollowed),
        )
        self._note_silence(found, section, at, kind)
        return found

    def _schedules(self, rates: dict[str, Any], at: tuple[str, ...], kind: str) -> dict[str, str | None]:
        """Return what falls while learning goes on, and say what does so silently."""
        on_policy = kind != SAC
        first = self._schedule(rates, "learning_rate_schedule", at) or ("linear" if on_policy else "constant")
        schedules: dict[str, str | None] = {"learning_rate_schedule": first}
        for name in ("beta_schedule", "epsilon_schedule"):
            schedules[name] = (self._schedule(rates, name, at) or first) if on_policy else None
        silent = [name for name, schedule in schedules.items() if name not in rates and schedule == "linear"]
        if silent:
            values = ", ".join(name.removesuffix("_schedule") for name in silent)
            self._note(
                at, f"{values} {'fall' if len(silent) > 1 else 'falls'} linearly until max_steps, as ML-Agents does "
                f"where the file does not say {', '.join(silent)}"
            )  # fmt: skip
        return schedules

    def _schedule(self, rates: dict[str, Any], key: str, at: tuple[str, ...]) -> str | None:
        schedule = rates.get(key)
        if schedule not in (None, "linear", "constant"):
            self._refuse((*at, key), repr(schedule), "linear or constant")
        return None if schedule is None else str(schedule)

    def _note_silence(self, found: BehaviorConfig, section: dict[str, Any], at: tuple[str, ...], kind: str) -> None:
        """Say what ML-Agents does where the section is silent."""
        if section.get("max_steps") is None:
            self._note((*at, "max_steps"), f"{DEFAULT_MAX_STEPS}, as ML-Agents does where the file does not say it")
        if kind == PPO:
            silent = [f"{key} ({value:g})" for key, value in SILENT_DEFAULTS.items() if getattr(found, key) is None]
            if silent:
                self._note(
                    at, f"not said and left to settings of our own (ML-Agents' in brackets): {', '.join(silent)}"
                )

    def _note_what_is_left(
        self, at: tuple[str, ...], section: dict[str, Any], rates: dict[str, Any], network: dict[str, Any]
    ) -> None:
        for key, why in (
            ("self_play", "teams learn together, from one policy"),
            ("init_path", "name the model to begin from on the command line"),
            ("time_horizon", "rollouts run through episodes and bootstrap at their end"),
        ):
            if section.get(key) is not None:
                self._note((*at, key), why)
        is_sac = section.get("trainer_type") == SAC
        for key in _HYPERPARAMETERS[11:]:
            if key in rates and not is_sac:
                self._note((*at, "hyperparameters", key), "belongs to SAC")
        for key, why in (
            ("save_replay_buffer", "a replay of at most replay.keep_mib is kept in every checkpoint"),
            ("reward_signal_steps_per_update", "SAC here has no reward signals beside the world's own"),
        ):
            if is_sac and key in rates:
                self._note((*at, "hyperparameters", key), why)
        if is_sac and rates.get("learning_rate_schedule") == "linear":
            self._note((*at, "hyperparameters", "learning_rate_schedule"), "SAC's step size stays what it is")

    def _gamma(self, signals: dict[str, Any], at: tuple[str, ...]) -> float | None:
        self._know(signals, ("extrinsic", "curiosity", "gail", "rnd"), at)
        extrinsic = self._group(signals, "extrinsic", at)
        self._know(extrinsic, _EXTRINSIC, (*at, "extrinsic"))
        if self._number(extrinsic, "strength", (*at, "extrinsic")) not in (None, 1.0):
            self._note((*at, "extrinsic", "strength"), "rewards keep their size")
        return self._number(extrinsic, "gamma", (*at, "extrinsic"), 0.0, 1.0)

    def _signals(self, signals: dict[str, Any], at: tuple[str, ...]) -> dict[str, dict[str, Any]]:
        """Return what is asked of curiosity, RND and GAIL."""
        found: dict[str, dict[str, Any]] = {}
        for name in ("curiosity", "rnd", "gail"):
            if name not in signals:
                continue
            here = (*at, name)
            signal = self._group(signals, name, at)
            self._know(signal, (*_SIGNAL, *(_IMITATION if name == "gail" else ())), here)
            inner = (*here, "network_settings")
            network = self._group(signal, "network_settings", here)
            self._know(network, _NETWORK, inner)
            strength = self._number(signal, "strength", here, 0.0)
            values = {
                "strength": 1.0 if strength is None else strength,
                "learning_rate": self._number(signal, "learning_rate", here, 1e-8, 1.0),
                "units": self._integer(network, "hidden_units", inner, 1)
                or self._integer(signal, "encoding_size", here, 1),
            }
            if name == "gail":
                values |= self._imitation(signal, here)
            else:
                why = "the bonus is measured in its own deviations, then times its strength added to the reward"
                self._note(here, why)
            found[name] = {key: value for key, value in values.items() if value is not None}
            if "gamma" in signal:
                self._number(signal, "gamma", here, 0.0, 1.0)
                self._note((*here, "gamma"), "the bonus meets the discount of the extrinsic reward")
        return found

    def _imitation(self, imitation: dict[str, Any], here: tuple[str, ...]) -> dict[str, Any]:
        """Return what GAIL has beyond the other signals."""
        if not isinstance(imitation.get("demo_path"), str):
            self._refuse((*here, "demo_path"), repr(imitation.get("demo_path")), "a .demo file, or a folder of them")
        if imitation.get("use_vail"):
            self._note((*here, "use_vail"), "the discriminator has no bottleneck")
        return {
            "demonstrations": imitation["demo_path"],
            "use_actions": "true" if imitation.get("use_actions") else None,
        }

    def _cloning(self, section: dict[str, Any], at: tuple[str, ...]) -> dict[str, Any]:
        """Return what is imitated beside what is learned from reward, by the names of our settings."""
        if section.get("behavioral_cloning") is None:
            return {}
        here, cloning = (*at, "behavioral_cloning"), self._group(section, "behavioral_cloning", at)
        self._know(cloning, _CLONING, here)
        if not isinstance(cloning.get("demo_path"), str):
            self._refuse((*here, "demo_path"), repr(cloning.get("demo_path")), "a .demo file, or a folder of them")
        strength = self._number(cloning, "strength", here, 0.0)
        values = {
            "strength": 1.0 if strength is None else strength,
            "demonstrations": cloning["demo_path"],
            "steps": self._integer(cloning, "steps", here, 0),
            "batch_size": self._integer(cloning, "batch_size", here, 1),
            "epochs": self._integer(cloning, "num_epoch", here, 1),
            "samples_per_update": self._integer(cloning, "samples_per_update", here, 0),
        }
        return {key: value for key, value in values.items() if value is not None}

    def _memory(self, network: dict[str, Any], at: tuple[str, ...]) -> tuple[int | None, int | None]:
        """Return what an LSTM carries, and how far back it is taught."""
        if network.get("memory") is None:
            return None, None
        here, memory = (*at, "memory"), self._group(network, "memory", at)
        self._know(memory, ("memory_size", "sequence_length"), here)
        size = self._integer(memory, "memory_size", here, 2) or DEFAULT_MEMORY_SIZE
        if size % 2:
            self._refuse((*here, "memory_size"), str(size), "an even number: h and c of an LSTM")
        return size, self._integer(memory, "sequence_length", here, 1) or DEFAULT_SEQUENCE_LENGTH

    def _encoder(self, network: dict[str, Any], at: tuple[str, ...]) -> str | None:
        kind = network.get("vis_encode_type")
        if kind is None or kind in ENCODERS:
            return kind
        if kind not in ("resnet", "match3", "fully_connected"):
            self._refuse((*at, "vis_encode_type"), repr(kind), "simple, nature_cnn, resnet, match3 or fully_connected")
        self._note((*at, "vis_encode_type"), f"'{kind}' is not followed; the convolutions of our settings are used")
        return None

    def _environment(self, group: dict[str, Any]) -> dict[str, Any]:
        at = ("env_settings",)
        self._know(group, _ENV, at)
        arguments = group.get("env_args") or []
        if not isinstance(arguments, list):
            self._refuse((*at, "env_args"), _kind(arguments), "a list of words")
        seed = self._integer(group, "seed", at)
        return {
            "env_path": None if group.get("env_path") is None else str(group["env_path"]),
            "env_args": tuple(str(word) for word in arguments),
            "num_envs": self._integer(group, "num_envs", at, 1),
            "num_areas": self._integer(group, "num_areas", at, 1),
            "timeout_wait": self._number(group, "timeout_wait", at, 0.0),
            "seed": None if seed is None or seed < 0 else seed,
            "base_port": self._integer(group, "base_port", at, 1),
            "max_lifetime_restarts": self._integer(group, "max_lifetime_restarts", at, -1),
            "restarts_rate_limit_n": self._integer(group, "restarts_rate_limit_n", at, -1),
            "restarts_rate_limit_period_s": self._number(group, "restarts_rate_limit_period_s", at, 0.0),
        }

    def _engine(self, group: dict[str, Any]) -> dict[str, Any]:
        at = ("engine_settings",)
        self._know(group, (*_ENGINE, "no_graphics", "no_graphics_monitor"), at)
        engine = {}
        for key in _ENGINE:
            value = (self._number if key == "time_scale" else self._integer)(group, key, at)
            if value is not None:
                engine[key] = value
        if ("width" in engine) != ("height" in engine):
            self._refuse(at, "only one of width and height", "both, or neither")
        return {"engine": engine, "no_graphics": self._switch(group, "no_graphics", at)}

    def _parameters(self, group: dict[str, Any], inference: bool) -> dict[str, Any]:
        """Return the parameters' values, and the lessons of those that have several."""
        values: dict[str, float | Sampler] = {}
        curricula: dict[str, tuple[Lesson, ...]] = {}
        for name, value in group.items():
            at = ("environment_parameters", name)
            if isinstance(value, dict) and "curriculum" in value:
                lessons = self._lessons(value["curriculum"], (*at, "curriculum"))
                values[name] = lessons[-1 if inference else 0].value
                if len(lessons) > 1:
                    curricula[name] = lessons
            else:
                values[name] = self._parameter_or_sampler(value, at)
        return {"parameters": values, "curricula": curricula}

    def _lessons(self, lessons: Any, at: tuple[str, ...]) -> tuple[Lesson, ...]:
        if not isinstance(lessons, list) or not lessons or not all(isinstance(lesson, dict) for lesson in lessons):
            self._refuse(at, _kind(lessons), "a list of lessons")
        return tuple(
            self._lesson(lesson, number, number + 1 == len(lessons), at) for number, lesson in enumerate(lessons)
        )

    def _lesson(self, lesson: dict[str, Any], number: int, is_last: bool, at: tuple[str, ...]) -> Lesson:
        self._know(lesson, ("name", "value", "completion_criteria"), at)
        name = str(lesson.get("name", f"lesson {number + 1}"))
        value = self._parameter_or_sampler(lesson.get("value"), (*at, "value"))
        if is_last:
            return Lesson(name, value)
        here, criteria = (*at, "completion_criteria"), self._group(lesson, "completion_criteria", at)
        self._know(criteria, _CRITERIA, here)
        measure, threshold = str(criteria.get("measure", "reward")), self._number(criteria, "threshold", here)
        if measure not in ("reward", "progress"):
            self._refuse((*here, "measure"), repr(measure), "reward or progress")
        if threshold is None or not isinstance(criteria.get("behavior"), str):
            self._refuse(
                here, f"lesson '{name}' without a behavior and a threshold", "both, in each lesson but the last"
            )
        if criteria.get("require_reset"):
            self._note((*here, "require_reset"), "episodes under way end first; each next one is of the new lesson")
        is_smoothed = self._switch(criteria, "signal_smoothing", here)
        return Lesson(
            name, value, measure, criteria["behavior"], threshold,
            self._integer(criteria, "min_lesson_length", here, 0) or 0, True if is_smoothed is None else is_smoothed,
        )  # fmt: skip

    def _parameter_or_sampler(self, value: Any, at: tuple[str, ...]) -> float | Sampler:
        return self._sampler(value, at) if isinstance(value, dict) else self._parameter(value, at)

    def _parameter(self, value: Any, at: tuple[str, ...]) -> float:
        number = _as_number(value)
        if number is None:
            self._refuse(at, _kind(value), "a number, a sampler or a curriculum")
        return number

    def _sampler(self, value: dict[str, Any], at: tuple[str, ...]) -> Sampler:
        kind = str(value.get("sampler_type"))
        if kind not in _SAMPLERS:
            self._refuse((*at, "sampler_type"), repr(kind), "uniform, gaussian or multirangeuniform")
        parameters = value.get("sampler_parameters")
        if not isinstance(parameters, dict):
            self._refuse(
                (*at, "sampler_parameters"),
                _kind(parameters),
                Message("{samplers}", samplers=", ".join(_SAMPLERS[kind])),
            )
        numbers: list[float] = []
        for key in _SAMPLERS[kind]:
            parts: Any = parameters.get(key)
            flat = [edge for pair in parts for edge in pair] if _is_pairs(parts) else [parts]
            for part in flat:
                number = _as_number(part)
                if number is None:
                    self._refuse((*at, "sampler_parameters", key), _kind(part), "a number")
                numbers.append(number)
        return Sampler(kind, tuple(numbers))

    def _device(self, group: dict[str, Any]) -> str | None:
        self._know(group, ("device",), ("torch_settings",))
        device = group.get("device")
        if device is None:
            return None
        if str(device).split(":")[0] not in ("cpu", "cuda"):
            self._refuse(("torch_settings", "device"), repr(device), "cpu or cuda")
        return str(device).split(":")[0]

    def _group(self, of: Mapping[str, Any], key: str, at: tuple[str, ...]) -> dict[str, Any]:
        value = of.get(key)
        if value is None:
            return {}
        if not isinstance(value, dict):
            self._refuse((*at, key), _kind(value), "a group of keys")
        return {str(name): part for name, part in value.items()}

    def _know(self, group: Mapping[str, Any], known: Iterable[str], at: tuple[str, ...]) -> None:
        for key in group:
            if key not in known:
                self._refuse((*at, key), "an unknown key", "a key of ML-Agents", nearest(key, known))

    def _number(
        self, group: Mapping[str, Any], key: str, at: tuple[str, ...], low: float = -math.inf, high: float = math.inf
    ) -> float | None:
        if group.get(key) is None:
            return None
        number = _as_number(group[key])
        if number is None or not low <= number <= high:
            bounds = "" if math.isinf(low) else f" from {low:g}" + ("" if math.isinf(high) else f" to {high:g}")
            self._refuse((*at, key), repr(group[key]), Message("a number{bounds}", bounds=bounds))
        return number

    def _integer(self, group: Mapping[str, Any], key: str, at: tuple[str, ...], low: float = -math.inf) -> int | None:
        number = self._number(group, key, at, low)
        if number is not None and number != int(number):
            self._refuse((*at, key), repr(group[key]), "a whole number")
        return None if number is None else int(number)

    def _switch(self, group: Mapping[str, Any], key: str, at: tuple[str, ...]) -> bool | None:
        value = group.get(key)
        if value is not None and not isinstance(value, bool):
            self._refuse((*at, key), _kind(value), "true or false")
        return value

    def _note(self, at: tuple[str, ...], why: str) -> None:
        self.notes.append(f"{'.'.join(at)}: {why}")

    def _refuse(
        self, at: tuple[str, ...], found: str | Message, expected: str | Message, hint: str | Message = ""
    ) -> NoReturn:
        raise TrainerConfigError(self.path, found, expected, hint, line=self.lines.get(at), key=".".join(at))


def _merged(defaults: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Lay a behavior's section over the defaults, group by group."""
    merged = dict(defaults)
    for key, value in given.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def _as_number(value: Any) -> float | None:
    """Return a finite number; YAML reads `3e-4` as a word, and ML-Agents as a number."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _is_pairs(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value) and bool(value)


def _kind(value: Any) -> str:
    names = {dict: "a group", list: "a list", str: f"the word {value!r}", type(None): "nothing", bool: "true or false"}
    return names.get(type(value), repr(value))
