"""One idea, four names: the console's words, the JSON files', DeepRacer for Cloud's variables, ours.

`GLOSSARY` is the one table: the page of the docs is printed from it and `racecraft explain WORD` searches it. Every
variable of `run_env_variables.py` is found there as well, with what it does here.

Sources: facts: deepracer-systems.md A1 (console), A2 (variables), D0 (which console name is which JSON name).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

from racecraft.worlds.deepracer.files.run_env_variables import ENV_VARIABLES


@dataclass(frozen=True)
class Term:
    """One idea under all its names; a name is empty where that world has none."""

    meaning: str
    console: str = ""
    json: str = ""
    """Key of hyperparameters.json, model_metadata.json or of the dictionary a reward function is given."""
    variable: str = ""
    ours: str = ""
    """Setting, option or command of racecraft."""

    @property
    def names(self) -> tuple[str, ...]:
        """Every name it goes by; several of one world stand with commas between."""
        spellings = (self.console, self.json, self.variable, self.ours)
        return tuple(name.strip() for names in spellings for name in names.split(",") if name.strip())


def _rows(table: str) -> tuple[Term, ...]:
    """Read lines "console | JSON | variable | ours | meaning"."""
    rows = ([cell.strip() for cell in line.split("|")] for line in table.strip().splitlines())
    return tuple(Term(meaning, console, json, variable, ours) for console, json, variable, ours, meaning in rows)


GLOSSARY = _rows(
    """
Gradient descent batch size | batch_size | | ppo.batch_size | How many steps one step of the optimiser looks at.
Number of epochs | num_epochs | | ppo.epochs | How often each step of an iteration is looked at again.
Learning rate | lr | | ppo.learning_rate | How far one step of the optimiser goes.
Entropy | beta_entropy | | ppo.entropy_weight | \
How much it is paid for staying undecided, so that it goes on exploring.
Discount factor | discount_factor | | ppo.discount | How much the next step's reward counts against this one's.
Loss type | loss_type | | ppo.value_loss | How errors of the critic are weighed: mean squared error or huber.
Number of experience episodes between each policy-updating iteration | \
num_episodes_between_training | | rollout.episodes_per_iteration | \
Episodes that are driven before the policy is improved once.
SAC alpha | sac_alpha | | sac.temperature | How much SAC is paid for staying undecided.
Exploration | exploration_type | | ppo.exploration | \
Whether actions are drawn by the policy's probabilities or, now and then, blindly.
 | e_greedy_value | | ppo.epsilon_last | Share of blind actions in the end, with e-greedy.
 | epsilon_steps | | ppo.epsilon_steps | Steps until that share is reached, with e-greedy.
 | stack_size | | network.stack_size | Frames that are seen at once.
 | term_cond_max_episodes | | --stop episodes=N | \
A training ends after so many episodes; with --preset aws after so many iterations, as at AWS.
 | term_cond_avg_score | | --stop reward=N | \
A training ends when the mean reward of the latest 100 episodes exceeds this; unused at AWS and with --preset aws.
Maximum time, Stop conditions | | RACECRAFT_STOP | --stop minutes=N, --stop laps | When a training ends.
Algorithm, Reinforcement learning algorithm | training_algorithm | | --algorithm | \
What learns: PPO (clipped_ppo) or SAC.
Neural network topology | neural_network | | --preset aws | \
How deep the network is; the fast preset trains its own small one.
Action space | action_space, action_space_type | | model_metadata.json | \
What the car can be told: a list of pairs, or two ranges.
Steering angle, Maximum steering angle | steering_angle | | | Degrees, positive left, 30 at most.
Speed, Maximum speed | speed | | | m/s, as it is told; the car may be slower.
Sensors, Sensor | sensor | | model_metadata.json | What the car sees with.
Camera, Front-facing camera, Single camera | FRONT_FACING_CAMERA | | | One camera that looks forward; \
a value of "sensor".
Stereo camera, Stereo cameras | STEREO_CAMERAS | | | Two cameras that look forward, 6 cm apart; a value of "sensor".
LiDAR, LIDAR sensor | LIDAR, SECTOR_LIDAR, DISCRETIZED_SECTOR_LIDAR | | | \
Distances round the car; a value of "sensor" beside a camera.
Vehicle, Agent, Garage | version | | --car | Which of the original's cars it is, with its steering and its camera.
Track, Environment simulation | | DR_WORLD_NAME | --track | The circuit; `racecraft tracks list` has 127 names.
Race type | | DR_RACE_TYPE | race.type | Time trial, object avoidance or head-to-bot.
Time trial | | DR_RACE_TYPE | race.type | The car drives alone, against the clock: TIME_TRIAL.
Object avoidance, Obstacles, Obstacle avoidance | | DR_RACE_TYPE | race.type | \
Boxes stand on the track: OBJECT_AVOIDANCE; boxes.number says how many.
Head-to-bot, Head-to-head, Head to head racing, Bot cars | | DR_RACE_TYPE | race.type | \
Slower cars drive on the track: HEAD_TO_BOT; bots.number says how many.
Head-to-model | | DR_RACE_TYPE | --against RUN | The car races other trained models: HEAD_TO_MODEL.
Track direction, Direction | is_reversed | DR_TRAIN_REVERSE_DIRECTION | race.reverse | \
Which way round the circuit is driven.
 | | DR_TRAIN_ALTERNATE_DRIVING_DIRECTION | | Both ways round in one training.
 | | DR_TRAIN_CHANGE_START_POSITION | race.change_start | Whether each episode starts further round the track.
 | | DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST | race.start_advance | How much further, in laps.
 | | DR_TRAIN_START_POSITION_OFFSET | race.start_offset | Where on the lap the first start lies.
Reward function | reward_function.py | DR_LOCAL_S3_REWARD_KEY | | \
What the car is paid for, in Python, 15 times a simulated second.
Clone | | DR_LOCAL_S3_PRETRAINED, DR_LOCAL_S3_PRETRAINED_PREFIX | --from RUN | \
Begin with the weights of an older model.
Best model | | DR_TRAIN_BEST_MODEL_METRIC, DR_LOCAL_S3_PRETRAINED_CHECKPOINT | evaluation.best_by | \
Which checkpoint counts as the best.
Checkpoint | .ckpt | DR_EVAL_CHECKPOINT | racecraft checkpoints RUN | The weights after an iteration.
Number of trials, Evaluation | | DR_EVAL_NUMBER_OF_TRIALS | racecraft evaluate --laps N | Laps of an evaluation.
 | | DR_TRAIN_MIN_EVAL_TRIALS | evaluation.episodes | Greedy episodes that judge a policy while it trains.
Simulation job, RoboMaker | | DR_WORKERS | rollout.num_worlds | \
Cars that drive side by side; DR_WORKERS counts courses here.
Model, Model name | | DR_LOCAL_S3_MODEL_PREFIX | --run | A training and all it leaves: a run folder.
S3 bucket, Amazon S3 | | DR_LOCAL_S3_BUCKET, DR_UPLOAD_S3_BUCKET | | A folder that holds models and files.
Logs, CloudWatch logs | SIM_TRACE_LOG | | racecraft logs | Every step as a line of text.
Episode | | | | From a start until the car laps, leaves the track or time is up.
Iteration | | | | Episodes that are driven, and the improvement of the policy after them.
Step | steps | | | A frame, an action, a reward: a fifteenth of a simulated second.
Progress | progress | | | How much of the lap is driven, per cent.
Waypoints | waypoints, closest_waypoints | | | Points along the centre line, by number.
Heading | heading | | | Where the car's nose points, degrees counter-clockwise from x.
Off-track | is_offtrack, all_wheels_on_track | | | All four wheels have left the road.
Physical car model | model.pb | | racecraft export | A model as a car on a table can load it.
Leaderboard, Virtual race | | | | A race of many racers' models.
"""
)


def find_terms(word: str) -> list[Term]:
    """Return the terms of a word: those that bear the name, else those whose name it begins or is part of.

    Case, blanks, dashes and underlines do not matter.
    """
    wanted = _folded(word)
    terms = [*GLOSSARY, *_variables()]
    exact = [term for term in terms if any(_folded(name) == wanted for name in term.names)]
    return exact or [term for term in terms if wanted and any(wanted in _folded(name) for name in term.names)]


def nearest_names(word: str, more: Iterable[str] = (), count: int = 3) -> list[str]:
    """Return the names nearest to a word that no term bears, among the terms' and more."""
    names = {_folded(name): name for name in [*more, *(n for term in [*GLOSSARY, *_variables()] for n in term.names)]}
    return [names[near] for near in difflib.get_close_matches(_folded(word), names, n=count)]


def _variables() -> Iterable[Term]:
    """Return a term for each variable that the table has none for."""
    variables = {name for term in GLOSSARY for name in term.names}
    return [Term(one.effect, variable=one.name) for one in ENV_VARIABLES if one.name not in variables]


def _folded(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum() or letter in ".=")
