"""ML-Agents' trainer configuration: what is followed, what is named, what is refused."""

import pytest

from racecraft.algorithms.ppo import SCHEDULE_ENDS as PPO_ENDS
from racecraft.algorithms.registry import find_algorithm
from racecraft.settings.overrides import apply_overrides
from racecraft.worlds.unity.files.trainer_config import SCHEDULE_ENDS
from racecraft.worlds.unity.files.trainer_yaml import BehaviorConfig, Sampler, TrainerConfigError, read_trainer_yaml
from racecraft.worlds.unity.training.plan import default_settings

pytest.importorskip("yaml", reason="PyYAML is not installed")

BASIC = """
behaviors:
  Basic:
    trainer_type: ppo
    hyperparameters:
      batch_size: 32
      buffer_size: 256
      learning_rate: 3e-4
      beta: 0.005
      epsilon: 0.2
      lambd: 0.95
      num_epoch: 3
    network_settings:
      hidden_units: 20
      num_layers: 1
      vis_encode_type: simple
    reward_signals:
      extrinsic:
        gamma: 0.9
        strength: 1.0
    keep_checkpoints: 5
    max_steps: 500000
    time_horizon: 3
    summary_freq: 2000
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        path = tmp_path / "config.yaml"
        path.write_text(text)
        return read_trainer_yaml(path)

    return read_text


def test_the_basic_scenes_own_file_is_read(read):
    config = read(BASIC)
    assert config.behavior("Basic?team=0") == BehaviorConfig(
        "Basic", 32, 256, 3e-4, 0.005, 0.2, 0.95, 3, 0.9, 20, 1, "simple", 500_000, *["linear"] * 3, None, 3
    )
    assert config.notes == (
        "behaviors.Basic.time_horizon: rollouts run through episodes and bootstrap at their end",
        "behaviors.Basic.hyperparameters: learning_rate, beta, epsilon fall linearly until max_steps, as ML-Agents "
        "does where the file does not say learning_rate_schedule, beta_schedule, epsilon_schedule",
    )
    assert config.behavior("Walker") == BehaviorConfig("Walker")


def test_what_it_says_becomes_our_settings(read):
    settings = apply_overrides(
        default_settings(find_algorithm("ppo")), read(BASIC).behavior("Basic").overrides(num_agents=4)
    )
    assert settings.ppo.batch_size == 32
    assert settings.ppo.learning_rate == 3e-4
    assert settings.ppo.discount == 0.9
    assert settings.ppo.entropy_weight == 0.005
    assert settings.ppo.epochs == 3
    assert (
        settings.ppo.learning_rate_schedule == settings.ppo.entropy_schedule == settings.ppo.clip_schedule == "linear"
    )
    assert settings.rollout.horizon == 64  # 256 shared by 4
    assert settings.network.hidden_units == (20,)
    assert settings.network.conv_filters == (16, 32)
    assert settings.network.conv_kernels == (8, 4)


def test_half_a_network_is_completed_as_ml_agents_does():
    assert BehaviorConfig("A", num_layers=3).overrides() == ("network.hidden_units=128,128,128",)
    assert BehaviorConfig("A", hidden_units=64).overrides() == ("network.hidden_units=64,64",)
    assert BehaviorConfig("A").overrides() == ()


def test_default_settings_lie_beneath_every_behavior(read):
    config = read(
        "default_settings: {hyperparameters: {batch_size: 10, learning_rate: 1.0e-3}}\n"
        "behaviors: {A: {hyperparameters: {batch_size: 20}}}\n"
    )
    assert (config.behavior("A").batch_size, config.behavior("A").learning_rate) == (20, 1e-3)
    assert config.behavior("B?team=1").batch_size == 10


def test_the_environment_engine_and_parameters_are_read(read):
    config = read(
        "env_settings: {env_path: builds/Game, env_args: [--level, 2], num_envs: 3, seed: -1, timeout_wait: 30,\n"
        "  max_lifetime_restarts: 7, restarts_rate_limit_n: -1, restarts_rate_limit_period_s: 30.5, num_areas: 2,\n"
        "  base_port: 5005}\n"
        "checkpoint_settings: {inference: true}\n"
        "engine_settings: {width: 84, height: 48, time_scale: 10, no_graphics: true}\n"
        "environment_parameters:\n"
        "  mass: 2\n"
        "  wind: {sampler_type: uniform, sampler_parameters: {min_value: 0, max_value: 1.5}}\n"
        "  size: {sampler_type: gaussian, sampler_parameters: {mean: 1, st_dev: 0.1}}\n"
        "  gap: {sampler_type: multirangeuniform, sampler_parameters: {intervals: [[1, 2], [5, 6]]}}\n"
        "  wall:\n    curriculum:\n"
        "    - {name: low, value: 1, completion_criteria: {behavior: A, threshold: 0.5}}\n    - {value: 4}\n"
        "torch_settings: {device: 'cuda:0'}\n"
    )
    assert (config.env_path, config.env_args, config.num_envs, config.num_areas) == (
        "builds/Game", ("--level", "2"), 3, 2,
    )  # fmt: skip
    assert (config.seed, config.timeout_wait, config.base_port) == (None, 30.0, 5005)
    limits = (config.max_lifetime_restarts, config.restarts_rate_limit_n, config.restarts_rate_limit_period_s)
    assert limits == (7, -1, 30.5)
    assert config.inference is True
    assert config.engine == {"width": 84, "height": 48, "time_scale": 10.0}
    assert config.no_graphics is True
    assert config.parameters == {
        "mass": 2.0,
        "wind": Sampler("uniform", (0.0, 1.5)),
        "size": Sampler("gaussian", (1.0, 0.1)),
        "gap": Sampler("multirangeuniform", (1.0, 2.0, 5.0, 6.0)),
        "wall": 4.0,
    }
    assert config.device == "cuda"
    assert config.notes == ()
    low, high = config.curricula["wall"]
    assert (low.name, low.value, low.measure, low.behavior, low.threshold) == ("low", 1.0, "reward", "A", 0.5)
    assert (high.name, high.value, low.is_smoothed, low.min_episodes) == ("lesson 2", 4.0, True, 0)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("trainer_type: poca", "trainer_type"),
        ("hyperparameters: {tau: 0.005}", "hyperparameters.tau"),
        ("network_settings: {vis_encode_type: resnet}", "network_settings.vis_encode_type"),
        ("reward_signals: {gail: {demo_path: a.demo, use_vail: true}}", "reward_signals.gail.use_vail"),
        ("reward_signals: {curiosity: {gamma: 0.9}}", "reward_signals.curiosity.gamma"),
        ("reward_signals: {extrinsic: {strength: 2}}", "reward_signals.extrinsic.strength"),
        ("self_play: {window: 10}", "self_play"),
    ],
)
def test_what_is_not_followed_is_named(read, text, key):
    notes = read(f"behaviors:\n  A:\n    {text}\n").notes
    assert [note for note in notes if note.startswith(f"behaviors.A.{key}: ")]


SAC = """
behaviors:
  Ball:
    trainer_type: sac
    hyperparameters: {batch_size: 64, buffer_size: 9000, buffer_init_steps: 500, tau: 0.01, steps_per_update: 4,
      init_entcoef: 0.5, learning_rate: 1e-3, save_replay_buffer: true, learning_rate_schedule: linear}
    network_settings: {hidden_units: 32, num_layers: 2, normalize: true, memory: {}}
    reward_signals: {extrinsic: {gamma: 0.9}, rnd: {strength: 0.1}}
"""


def test_a_section_for_sac_sets_sac_and_its_memory(read):
    config = read(SAC)
    settings = apply_overrides(
        default_settings(find_algorithm("sac")), config.behavior("Ball").overrides(num_agents=4, algorithm="sac")
    )
    assert (settings.sac.batch_size, settings.sac.learning_rate, settings.sac.discount) == (64, 1e-3, 0.9)
    assert (settings.sac.target_rate, settings.sac.initial_temperature) == (0.01, 0.5)
    assert settings.sac.gradient_steps_per_step == 0.25, "a gradient step for every four steps"
    assert (settings.replay.capacity, settings.replay.learning_starts) == (9000, 500)
    assert settings.network.hidden_units == (32, 32)
    assert [note.split(": ")[0].removeprefix("behaviors.Ball.") for note in config.notes] == [
        "hyperparameters.save_replay_buffer", "hyperparameters.learning_rate_schedule", "reward_signals.rnd",
        "max_steps",
    ]  # fmt: skip


def test_behavioral_cloning_becomes_imitation_beside_ppo(read):
    text = (
        "behaviors: {A: {hyperparameters: {learning_rate: 2e-3}, behavioral_cloning: {demo_path: Demos/a.demo, "
        "strength: 0.5, steps: 10000, num_epoch: 2, batch_size: 32, samples_per_update: 64}}}"
    )
    settings = apply_overrides(default_settings(find_algorithm("ppo")), read(text).behavior("A").overrides())
    told = settings.imitation
    assert (told.strength, told.learning_rate, told.demonstrations) == (0.5, 2e-3, "Demos/a.demo")
    assert (told.steps, told.epochs, told.batch_size, told.samples_per_update) == (10_000, 2, 32, 64)
    assert not [note for note in read(text).notes if "cloning" in note]


def test_a_section_for_sac_lends_ppo_what_both_know(read):
    behavior = read(SAC).behavior("Ball")
    told = behavior.overrides(num_agents=4)
    assert {"ppo.batch_size=64", "ppo.learning_rate=0.001", "ppo.discount=0.9", "network.normalise=true"} <= set(told)
    assert not [name for name in told if name.startswith(("sac.", "replay.", "rollout."))], "its buffer is a memory"
    assert read(BASIC).behavior("Basic").overrides(4, "sac") == (
        "sac.batch_size=32", "sac.learning_rate=0.0003", "sac.discount=0.9", "network.hidden_units=20",
        "network.conv_filters=16,32", "network.conv_kernels=8,4", "network.conv_strides=4,2",
    )  # fmt: skip


def besides_schedules(behavior):
    return tuple(told for told in behavior.overrides() if "_schedule=" not in told)


def test_a_memory_becomes_an_lstm_of_half_its_size(read):
    text = "behaviors: {A: {network_settings: {memory: {memory_size: 256, sequence_length: 32}}}}"
    behavior = read(text).behavior("A")
    assert besides_schedules(behavior) == (
        "network.memory=lstm",
        "network.memory_units=128",
        "ppo.sequence_length=32",
    )
    silent = read("behaviors: {A: {network_settings: {memory: {}}}}").behavior("A")
    assert (silent.memory_size, silent.sequence_length) == (128, 64)


def test_gail_becomes_settings(read):
    behavior = read(
        "behaviors: {A: {reward_signals: {gail: {demo_path: demos/a.demo, strength: 0.5, use_actions: true, "
        "encoding_size: 32}}}}"
    ).behavior("A")
    assert besides_schedules(behavior) == (
        "gail.strength=0.5", "gail.units=32", "gail.demonstrations=demos/a.demo", "gail.use_actions=true",
    )  # fmt: skip


def test_curiosity_and_rnd_become_settings(read):
    behavior = read(
        "behaviors: {A: {reward_signals: {extrinsic: {gamma: 0.9}, rnd: {}, "
        "curiosity: {strength: 0.02, learning_rate: 1e-3, network_settings: {hidden_units: 64}}}}}"
    ).behavior("A")
    assert besides_schedules(behavior) == (
        "ppo.discount=0.9", "curiosity.strength=0.02", "curiosity.learning_rate=0.001", "curiosity.units=64",
        "rnd.strength=1.0",
    )  # fmt: skip


def test_what_ml_agents_does_where_the_file_is_silent_is_said(read):
    """With the values of its documents and `settings.py`."""
    config = read("behaviors: {A: {hyperparameters: {beta_schedule: constant}}}")
    assert config.behavior("A").max_steps == 500_000
    assert config.notes == (
        "behaviors.A.hyperparameters: learning_rate, epsilon fall linearly until max_steps, as ML-Agents does where "
        "the file does not say learning_rate_schedule, epsilon_schedule",
        "behaviors.A.max_steps: 500000, as ML-Agents does where the file does not say it",
        "behaviors.A: not said and left to settings of our own (ML-Agents' in brackets): batch_size (1024), "
        "buffer_size (10240), learning_rate (0.0003), beta (0.005), epsilon (0.2), lambd (0.95), num_epoch (3), "
        "gamma (0.99), hidden_units (128), num_layers (2)",
    )


@pytest.mark.parametrize(
    ("rates", "schedules"),
    [
        ("{}", ("linear", "linear", "linear")),
        ("{learning_rate_schedule: constant}", ("constant", "constant", "constant")),
        ("{learning_rate_schedule: constant, beta_schedule: linear}", ("constant", "linear", "constant")),
        ("{epsilon_schedule: constant}", ("linear", "linear", "constant")),
    ],
)
def test_schedules_have_ml_agents_defaults(read, rates, schedules):
    """Those of beta and epsilon follow the learning rate's; all are linear where nothing is said."""
    told = read(f"behaviors: {{A: {{hyperparameters: {rates}}}}}").behavior("A")
    assert (told.learning_rate_schedule, told.beta_schedule, told.epsilon_schedule) == schedules
    sac = read(f"behaviors: {{A: {{trainer_type: sac, hyperparameters: {rates}}}}}").behavior("A")
    assert sac.learning_rate_schedule == (schedules[0] if "learning_rate" in rates else "constant")


def test_schedules_end_where_ml_agents_ends_them():
    ours = {"learning_rate": "learning_rate", "beta": "entropy_weight", "epsilon": "clip"}
    assert {name: PPO_ENDS[ours[name]] for name in SCHEDULE_ENDS} == SCHEDULE_ENDS


COMPLETE = BASIC.replace("    time_horizon: 3\n", "").replace("num_epoch: 3\n", "num_epoch: 3\n      %s\n") % (
    "learning_rate_schedule: constant"
)
PACED = "trainer_type: sac, max_steps: 1, hyperparameters: {learning_rate_schedule: constant}"


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        (COMPLETE, []),
        (f"behaviors: {{A: {{{PACED}}}}}", []),
        ("checkpoint_settings: {inference: true}", []),
        (
            "checkpoint_settings: {run_id: a, inference: false}",
            ["checkpoint_settings: run folders of our own are used"],
        ),
        (
            f"behaviors: {{A: {{init_path: a.pt, {PACED}}}}}",
            ["behaviors.A.init_path: name the model to begin from on the command line"],
        ),
    ],
)
def test_nothing_is_noted_but_what_is_not_followed(read, text, notes):
    assert list(read(text).notes) == notes


EVERYTHING = """
default_settings: {network_settings: {hidden_units: 5, normalize: true}, self_play: {window: 2}}
behaviors:
  A:
    trainer_type: sac
    hyperparameters: {batch_size: 11, buffer_size: 12, learning_rate: 0.13, learning_rate_schedule: linear, beta: 0.14,
      epsilon: 0.15, lambd: 0.16, num_epoch: 17, tau: 0.18, steps_per_update: 1.9, buffer_init_steps: 20,
      init_entcoef: 0.21}
    network_settings: {hidden_units: 22, num_layers: 23, vis_encode_type: nature_cnn,
      memory: {memory_size: 24, sequence_length: 25}}
    reward_signals: {extrinsic: {gamma: 0.26, strength: 1.0}, gail: {demo_path: g.demo, strength: 0,
      learning_rate: 0.27, gamma: 0.9, network_settings: {hidden_units: 28}, encoding_size: 29}}
    behavioral_cloning: {demo_path: c.demo, strength: 0}
    max_steps: 30
    time_horizon: 31
"""


def test_everything_a_section_says_stands_under_its_own_name(read):
    """Over the default settings, group by group."""
    config = read(EVERYTHING)
    assert config.behavior("A") == BehaviorConfig(
        unfollowed=("self_play",),
        name="A", trainer="sac", batch_size=11, buffer_size=12, learning_rate=0.13, learning_rate_schedule="linear",
        beta=0.14, epsilon=0.15, lambd=0.16, num_epoch=17, tau=0.18, steps_per_update=1.9, buffer_init_steps=20,
        init_entcoef=0.21, normalize=True, hidden_units=22, num_layers=23, vis_encode_type="nature_cnn",
        memory_size=24, sequence_length=25, gamma=0.26, max_steps=30, time_horizon=31,
        signals={"gail": {"strength": 0.0, "learning_rate": 0.27, "units": 28, "demonstrations": "g.demo"}},
        cloning={"strength": 0.0, "demonstrations": "c.demo"},
    )  # fmt: skip
    assert config.behavior("B").hidden_units == 5
    assert [note.split(": ")[0] for note in config.notes] == [
        "behaviors.A.self_play", "behaviors.A.time_horizon", "behaviors.A.hyperparameters.learning_rate_schedule",
        "behaviors.A.reward_signals.gail.gamma", "default_settings.self_play", "default_settings.hyperparameters",
        "default_settings.max_steps", "default_settings",
    ]  # fmt: skip


ZERO_TO_ONE = ((0, 1), ("-1e-9", 1.001), "a number from 0 to 1")
NOT_NEGATIVE = ((0,), ("-1e-9",), "a number from 0")
COUNT = ((1,), (0,), "a number from 1")
COUNT_OR_NONE = ((0,), (-1,), "a number from 0")
EDGES = [
    ("hyperparameters: {batch_size: %s}", *COUNT),
    ("hyperparameters: {epsilon: %s}", *ZERO_TO_ONE),
    ("hyperparameters: {init_entcoef: %s}", ("1e-6", 1000), ("9e-7", 1000.5), "a number from 1e-06 to 1000"),
    ("network_settings: {memory: {memory_size: %s}}", (2,), (1,), "a number from 2"),
    ("reward_signals: {rnd: {strength: %s}}", *NOT_NEGATIVE),
    ("behavioral_cloning: {demo_path: a.demo, steps: %s}", *COUNT_OR_NONE),
]


@pytest.mark.parametrize(("text", "taken", "refused", "expected"), EDGES, ids=[text for text, *_ in EDGES])
def test_numbers_are_taken_up_to_their_limit_and_no_further(read, text, taken, refused, expected):
    for value in taken:
        assert float(value) in numbers_in(read(f"behaviors: {{A: {{{text % value}}}}}").behavior("A")) or "rnd" in text
    for value in refused:
        with pytest.raises(TrainerConfigError, match=f"; expected {expected}\\."):
            read(f"behaviors: {{A: {{{text % value}}}}}")


def numbers_in(behavior):
    values = [*vars(behavior).values(), *behavior.cloning.values()]
    return [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]


@pytest.mark.parametrize(
    ("key", "taken", "refused"),
    [
        ("num_envs", 1, 0),
        ("timeout_wait", 0, "-1e-9"),
        ("max_lifetime_restarts", -1, -2),
        ("seed", 0, "many"),
    ],
)
def test_numbers_of_players_are_taken_up_to_their_limit_too(read, key, taken, refused):
    config = read(f"env_settings: {{{key}: {taken}}}")
    assert getattr(config, key) == taken
    assert (config.inference, config.env_path, config.no_graphics) == (False, None, None), "of which nothing was said"
    with pytest.raises(TrainerConfigError, match=f"env_settings.{key}"):
        read(f"env_settings: {{{key}: {refused}}}")


FOLLOWED = ["buffer_init_steps", "init_entcoef", "tau", "steps_per_update"]
"""What belongs to SAC and is followed there."""


@pytest.mark.parametrize("key", [*FOLLOWED, "save_replay_buffer", "reward_signal_steps_per_update"])
def test_what_belongs_to_sac_is_said_in_a_section_for_ppo(read, key):
    rates = f"{key}: 1, shared_critic: true, learning_rate_schedule: linear"
    text = f"behaviors: {{A: {{%s hyperparameters: {{{rates}}}}}}}"
    said = "behaviors.A.hyperparameters."
    told = [note for note in read(text % "").notes if note.startswith(said)]
    assert told == [f"{said}{key}: belongs to SAC"]
    told = [note.split(": ") for note in read(text % "trainer_type: sac,").notes if note.startswith(said)]
    assert [name.removeprefix(said) for name, _ in told] == [key] * (key not in FOLLOWED) + ["learning_rate_schedule"]
    assert "belongs to SAC" not in dict(told).values()


@pytest.mark.parametrize("encoder", ["resnet", "match3", "fully_connected"])
def test_encoders_that_are_not_followed_leave_ours(read, encoder):
    config = read(f"behaviors: {{A: {{network_settings: {{vis_encode_type: {encoder}, max_num_agents: 4}}}}}}")
    assert config.behavior("A").vis_encode_type is None
    assert [note for note in config.notes if f"'{encoder}' is not followed" in note]


LEFT_BY = "completion_criteria: {behavior: A, measure: progress, threshold: 0.5, min_lesson_length: 9}"


def test_of_a_curriculum_the_first_lesson_is_taken_and_the_last_to_play(read):
    text = f"environment_parameters: {{x: {{curriculum: [{{value: 1, {LEFT_BY}}}, {{value: 5}}]}}}}\n"
    assert read(text).parameters == {"x": 1.0}
    assert read(text + "checkpoint_settings: {inference: true}").parameters == {"x": 5.0}
    (only,) = (read("environment_parameters: {x: {curriculum: [{value: 3}]}}").parameters,)
    assert only == {"x": 3.0}


@pytest.mark.parametrize(
    ("criteria", "words"),
    [
        ("", "lesson 'lesson 1' without a behavior and a threshold"),
        ("completion_criteria: {behavior: A}", "without a behavior and a threshold"),
        (
            "completion_criteria: {behavior: A, threshold: 1, measure: Elo}",
            "measure: 'Elo'; expected reward or progress",
        ),
        ("completion_criteria: {behavior: A, treshold: 1}", "threshold"),
    ],
)
def test_a_lesson_that_can_never_be_left_is_refused(read, criteria, words):
    with pytest.raises(TrainerConfigError, match=words):
        read(f"environment_parameters: {{x: {{curriculum: [{{value: 1, {criteria}}}, {{value: 5}}]}}}}")


@pytest.mark.parametrize(
    "text", ["default: {trainer: ppo, batch_size: 10}\nBall: {max_steps: 5}\n", "behaviors: {Ball: {trainer: sac}}\n"]
)
def test_files_of_2020_are_named_as_such(read, text):
    with pytest.raises(TrainerConfigError, match="ML-Agents 0.18 or older, of 2020.*upgrade_config"):
        read(text)


def test_other_ways_of_learning_are_named_by_section(read):
    config = read("behaviors: {A: {trainer_type: poca, self_play: {window: 1}}, B: {trainer_type: ppo}}")
    assert config.behaviors["A"].unfollowed == ("trainer_type: poca", "self_play")
    assert config.behaviors["B"].unfollowed == ()


def test_a_section_may_name_its_team(read):
    config = read("behaviors: {A: {max_steps: 1}, 'A?team=1': {max_steps: 2}}")
    assert [config.behavior(name).max_steps for name in ("A", "A?team=0", "A?team=1")] == [1, 1, 2]


SAMPLER = "environment_parameters: {x: {sampler_type: multirangeuniform, sampler_parameters: {intervals: EDGES}}}"


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ("behaviours: {}", r"config.yaml:1: behaviours: an unknown key.*Did you mean 'behaviors'"),
        (
            "behaviors:\n  A:\n    hyperparameters:\n      batchsize: 3",
            r":4: behaviors.A.hyperparameters.batchsize: .*batch_size",
        ),
        (
            "behaviors: {A: {behavioral_cloning: {demo_path: a.demo, strenght: 1}}}",
            r":1: behaviors.A.behavioral_cloning.strenght: .*strength",
        ),
        ("behaviors:\n  A:\n    max_steps: many", r":3: behaviors.A.max_steps: 'many'; expected a number"),
        ("behaviors: {A: {hyperparameters: {beta_schedule: cosine}}}", "'cosine'; expected linear or constant"),
        ("behaviors: {A: {network_settings: {normalize: 3}}}", "true or false"),
        ("behaviors: {A: {network_settings: {memory: {memory_size: 3}}}}", "an even number"),
        ("behaviors: {A: {reward_signals: {gail: {strength: 1}}}}", r"behaviors\.A\.reward_signals\.gail\.demo_path"),
        ("behaviors: {A: {hyperparameters: {num_epoch: 2.5}}}", "expected a whole number"),
        ("behaviors: {A: {hyperparameters: {batch_size: true}}}", "expected a number"),
        ("behaviors: {A: {hyperparameters: {beta: .nan}}}", "expected a number"),
        ("behaviors: [A]", "a list; expected a group"),
        ("- a", "holds a list"),
        ("", "holds nothing"),
        ("behaviors: {A", "not YAML"),
        ("a: !!python/object/apply:os.system ['true']", "not YAML"),
        ("engine_settings: {width: 84}", "both, or neither"),
        ("environment_parameters: {x: {sampler_type: dice}}", "uniform, gaussian"),
        ("environment_parameters: {x: [1]}", "x: a list; expected a number, a sampler or a curriculum"),
        ("environment_parameters: {x: {sampler_type: gaussian}}", "sampler_parameters: nothing; expected mean, st_dev"),
        ("environment_parameters: {x: {curriculum: []}}", "curriculum: a list; expected a list of lessons"),
        ("environment_parameters: {x: {curriculum: [3]}}", "curriculum: a list; expected a list of lessons"),
        ("env_settings: {env_args: --level}", "env_args: the word '--level'; expected a list of words"),
        ("default_settings: {max_stebs: 1}", "yaml:1: default_settings.max_stebs: an unknown key"),
        ("behaviors: {A: {reward_signals: {extrinsik: {}}}}", "Did you mean 'extrinsic'"),
        ("env_settings: {num_env: 1}", "Did you mean 'num_envs'"),
        ("behaviors: &a {A: *a}", "behaviors.A.A: an unknown key"),
        (SAMPLER.replace("EDGES", "[[1, 2, 3]]"), "intervals: .*a list.*expected a number"),
        ("environment_parameters: {x: {sampler_type: uniform, sampler_parameters: {min_value: 0}}}", "max_value"),
        ("torch_settings: {device: tpu}", "cpu or cuda"),
        ("behaviors: {A: {network_settings: {vis_encode_type: eyes}}}", "nature_cnn"),
    ],
)
def test_what_cannot_be_used_is_a_letter_with_its_place(read, text, letter):
    with pytest.raises(TrainerConfigError, match=letter):
        read(text)


def test_an_absent_file_is_a_letter(tmp_path):
    with pytest.raises(TrainerConfigError, match="cannot be read"):
        read_trainer_yaml(tmp_path / "absent.yaml")
