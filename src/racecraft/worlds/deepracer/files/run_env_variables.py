"""Every variable of DeepRacer for Cloud that a user's `system.env`, `run.env` or `worker-N.env` may hold.

One table feeds them all: what is obeyed in a training, `racecraft settings FOLDER`, new files, the page of the docs and
the glossary. A variable's status is one of

    used     obeyed in a training or an evaluation; `training/race_environment.py` says how
    verbs    obeyed by the dr- verbs, which know a whole installation: `racecraft dr`
    told     a name or a colour: written into AWS's files, and no training changes by it

or a word of REASONS: it speaks of something that is not here (Docker, a bucket's address, a screen), and why says the
table. Variables whose names begin with RACECRAFT_ are ours: DeepRacer for Cloud passes them over, and has none for when
a training ends or for what it cannot do.

Source: facts: deepracer-systems.md A2, from its templates, `prepare-config.py` and reference page.
"""

from __future__ import annotations

from dataclasses import dataclass

USED, COMMANDS, INFO_ONLY, NOT_APPLICABLE = "used", "verbs", "told", "without"
VARIABLE_EFFECTS = {
    USED: "Obeyed",
    COMMANDS: "Obeyed by the dr- commands",
    INFO_ONLY: "Told on: written into AWS's files, changes no training",
    NOT_APPLICABLE: "Not applicable here",
}
"""What a status means, as a heading; by how much a variable does."""

REASONS = {
    "container": "no container runs here: racecraft is one program, and there is no image to choose or to keep alive",
    "role": "a role belongs to a profile: `role_arn` in ~/.aws/config, and DR_UPLOAD_S3_PROFILE names the profile",
    "screen": "the simulator draws no window and needs no screen",
    "stream": "no video stream is sent anywhere; films are files (`racecraft evaluate RUN --video FILE.mp4`)",
    "clock": "simulated time waits for no clock: ticks are computed as fast as the machine can",
    "gazebo": "there is no Gazebo: physics, camera and marshals are one compiled program",
    "cloudwatch": "nothing is sent to AWS; logs lie in the run folder",
    "device": "runtime.device and runtime.threads say where the work is done: --set runtime.device=cuda",
    "metrics": "live figures are pushed to no server: `racecraft train --metrics-port 9100` serves them for Prometheus "
    "and Telegraf to fetch, --set runtime.tensorboard=true writes them, `racecraft report RUN` draws them",
    "layout": "a run folder has one layout, and each file one name in it",
    "thrown": "no experience is thrown away: rollout.horizon and rollout.num_worlds say how much an iteration collects",
    "racer": "cars race here, and no board names who sent them: DR_EVAL_OPP_DISPLAY_NAME is what table and film say",
    "unpaid": "a race is judged by laps and penalties, and nothing is paid in it; `racecraft logs MODEL --page "
    "logs.html --reward reward_function.py` asks a reward function about the laps that were driven",
    "droa": "no account of DeepRacer on AWS is spoken to",
}
"""Why a variable has nothing to say here, by the word in its row."""


@dataclass(frozen=True)
class EnvVariable:
    """One variable."""

    name: str
    file: str
    """Where it stands in a new installation: "system" or "run". Any file may hold it."""
    default: str
    """Its value in a new file; empty where it has none."""
    status: str
    """A key of STATUSES."""
    doc: str
    why: str = ""
    """Of a variable that is not applicable: the reason, a clause."""

    @property
    def effect(self) -> str:
        """What it does here, or why it does nothing: a sentence or two."""
        return f"{self.doc} {self.why[0].upper()}{self.why[1:]}." if self.why else self.doc

    @property
    def is_secret(self) -> bool:
        """Whether its value is nobody's business: never printed, never written down."""
        return "SECRET" in self.name or "ACCESS_KEY" in self.name


OTHER_SPELLINGS = {
    "DR_TRAIN_ROUND_ROBIN_ADVANCE_DISTANCE": "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST",
    "DR_COLLISION_PENALTY": "DR_EVAL_COLLISION_PENALTY",
    "DR_EVAL_OPP_MODEL_PREFIX": "DR_EVAL_OPP_S3_MODEL_PREFIX",
    "DR_CHANGE_START_POSITION": "DR_TRAIN_CHANGE_START_POSITION",
    "DR_ALTERNATE_DRIVING_DIRECTION": "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION",
}
"""Names that documents, older versions or slips of the code use, and the names they mean."""


def _rows(file: str, table: str) -> tuple[EnvVariable, ...]:
    """Read a table of lines "NAME | default | status or reason | doc"; names are written without DR_."""
    rows = [[cell.strip() for cell in line.split("|")] for line in table.strip().splitlines()]
    return tuple(
        EnvVariable(
            name if name.startswith(_WHOLE_NAMES) else f"DR_{name}",
            file,
            default,
            NOT_APPLICABLE if status in REASONS else status,
            doc,
            REASONS.get(status, ""),
        )
        for name, default, status, doc in rows
    )


_WHOLE_NAMES = ("RACECRAFT_", "CUDA_")
"""Beginnings of names that have no DR_ before them."""

_RUN = _rows(
    "run",
    """
RUN_ID | 0 | verbs | Number of a run beside others: each trains, stops and shows its log by itself.
WORLD_NAME | reinvent_base | used | Track.
RACE_TYPE | TIME_TRIAL | used | TIME_TRIAL, OBJECT_AVOIDANCE, HEAD_TO_BOT or HEAD_TO_MODEL (its own past selves).
CAR_NAME | FastCar | told | Name shown on the video.
CAR_BODY_SHELL_TYPE | deepracer | told | Shell of the car on the video.
CAR_COLOR | Red | told | Colour of the car on the video.
DISPLAY_NAME | $DR_CAR_NAME | told | Name shown on the video.
RACER_NAME | $DR_CAR_NAME | told | Name of the racer.
ENABLE_DOMAIN_RANDOMIZATION | False | used | Other lamps, and other colours of objects, in each episode.
EVAL_NUMBER_OF_TRIALS | 3 | used | Laps of `racecraft evaluate` where none are asked for; trials of a judged race.
EVAL_IS_CONTINUOUS | True | used | Of a judged race: trials are laps of one drive, or each begins at rest.
EVAL_MAX_RESETS | 100 | used | Of a judged race: how often the car is set back; the next mishap ends the trial.
EVAL_OFF_TRACK_PENALTY | 5.0 | used | Of a judged race: seconds for leaving the track or driving backwards.
EVAL_COLLISION_PENALTY | 5.0 | used | Of a judged race: seconds for a collision.
EVAL_SAVE_MP4 | False | verbs | Whether dr-start-evaluation films the race, with the original's three cameras into mp4/.
EVAL_CHECKPOINT | last | used | The checkpoint it drives where none is asked for: last or best.
EVAL_OPP_S3_MODEL_PREFIX | rl-deepracer-sagemaker | verbs | Model that dr-start-evaluation races, in HEAD_TO_MODEL.
EVAL_OPP_CAR_BODY_SHELL_TYPE | deepracer | verbs | Shell of the opponent on the video.
EVAL_OPP_CAR_NAME | FasterCar | verbs | Name of the opponent where DR_EVAL_OPP_DISPLAY_NAME gives it none.
EVAL_OPP_DISPLAY_NAME | $DR_EVAL_OPP_CAR_NAME | verbs | Name of the opponent in the table and the film's title.
EVAL_OPP_RACER_NAME | $DR_EVAL_OPP_CAR_NAME | racer | Name of the opponent's racer.
EVAL_DEBUG_REWARD | False | unpaid | The reward function in evaluations, for debugging.
EVAL_RESET_BEHIND_DIST | 1.0 | used | Of a judged race: metres behind an object that is too near where the car goes on.
EVAL_REVERSE_DIRECTION | False | used | Of a judged race: in the opposite direction, else the track's own.
EVAL_RTF |  | clock | Limit of the simulator's speed.
TRAIN_RTF |  | clock | Limit of the simulator's speed.
TRAIN_CHANGE_START_POSITION | True | used | Whether starts advance round the track.
TRAIN_REVERSE_DIRECTION | False | used | Drive in the opposite direction.
TRAIN_ALTERNATE_DRIVING_DIRECTION | False | used | Each car drives one way in one episode and the other way in the next.
TRAIN_START_POSITION_OFFSET | 0.0 | used | Where on the lap the first start lies, 0 to 1.
TRAIN_ROUND_ROBIN_ADVANCE_DIST | 0.05 | used | How far the next start lies ahead, in laps.
TRAIN_MULTI_CONFIG | False | used | Whether cars are shared out among run.env and worker-N.env files.
TRAIN_MIN_EVAL_TRIALS | 5 | used | Evaluation laps after each iteration.
TRAIN_BEST_MODEL_METRIC | progress | used | What makes a checkpoint the best: progress, reward or laptime.
TRAIN_MAX_STEPS_PER_ITERATION |  | thrown | Steps of an iteration beyond which AWS throws experience away.
RACECRAFT_PRESET |  | verbs | Learner and network: fast (the default), or aws, which models of AWS are cloned with.
RACECRAFT_SET |  | used | Settings of ours, as after --set, blanks between: runtime.threads=2 ppo.clip=0.1.
RACECRAFT_STOP |  | used | When training ends, as after --stop: laps minutes=30.
LOCAL_S3_MODEL_PREFIX | rl-deepracer-sagemaker | verbs | The run folder of the model, in the bucket.
LOCAL_S3_PRETRAINED | False | used | Whether training begins with an older model.
LOCAL_S3_PRETRAINED_PREFIX | rl-sagemaker-pretrained | used | Folder of that model.
LOCAL_S3_PRETRAINED_CHECKPOINT | last | used | Its checkpoint: last or best.
LOCAL_S3_CUSTOM_FILES_PREFIX | custom_files | used | Folder of the user's files.
LOCAL_S3_TRAINING_PARAMS_FILE | training_params.yaml | layout | Name of the file for the simulator.
LOCAL_S3_EVAL_PARAMS_FILE | evaluation_params.yaml | layout | Name of the file for the simulator.
LOCAL_S3_MODEL_METADATA_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/model_metadata.json | used | The car.
LOCAL_S3_HYPERPARAMETERS_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/hyperparameters.json | used | How it learns.
LOCAL_S3_REWARD_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/reward_function.py | used | What it is paid for.
LOCAL_S3_METRICS_PREFIX | $DR_LOCAL_S3_MODEL_PREFIX/metrics | layout | Folder of the metrics.
UPLOAD_S3_PREFIX | $DR_LOCAL_S3_MODEL_PREFIX-1 | verbs | Folder in the bucket for uploads.
OA_NUMBER_OF_OBSTACLES | 6 | used | Obstacles on the track.
OA_MIN_DISTANCE_BETWEEN_OBSTACLES | 2.0 | used | Metres between them.
OA_RANDOMIZE_OBSTACLE_LOCATIONS | False | used | Other places in each episode.
OA_IS_OBSTACLE_BOT_CAR | False | used | Obstacles that look like cars.
OA_OBSTACLE_TYPE | box_obstacle | used | box_obstacle, deepracer_box_obstacle or amazon_box_obstacle.
OA_OBJECT_POSITIONS |  | used | Places as "progress,lane;progress,lane", 0 to 1, lane -1 is the outer one.
H2B_IS_LANE_CHANGE | False | used | Whether bot cars change lanes.
H2B_LOWER_LANE_CHANGE_TIME | 3.0 | used | Seconds between changes, at least.
H2B_UPPER_LANE_CHANGE_TIME | 5.0 | used | Seconds between changes, at most.
H2B_LANE_CHANGE_DISTANCE | 1.0 | used | Metres a change takes.
H2B_NUMBER_OF_BOT_CARS | 3 | used | Bot cars on the track.
H2B_MIN_DISTANCE_BETWEEN_BOT_CARS | 2.0 | used | Metres between them.
H2B_RANDOMIZE_BOT_CAR_LOCATIONS | False | used | Other places in each episode.
H2B_BOT_CAR_SPEED | 0.2 | used | Their speed in m/s.
H2B_BOT_CAR_PENALTY | 5.0 | used | Seconds for which they stand after one of them ran into a car.
""",
)

_SYSTEM = _rows(
    "system",
    """
CLOUD | local | verbs | Kind of storage: remote has DR_REMOTE_MINIO_URL count; else the lines below decide.
AWS_APP_REGION | us-east-1 | verbs | AWS region of buckets that are S3.
UPLOAD_S3_PROFILE | default | verbs | AWS profile for uploads; another than default makes that bucket S3.
UPLOAD_S3_BUCKET |  | verbs | Bucket for uploads: a folder here, or S3 (s3://NAME, or with a profile).
UPLOAD_S3_ROLE |  | role | Role for uploads, in older files.
LOCAL_S3_BUCKET | bucket | verbs | The bucket: a folder here, or S3 (s3://NAME, or with an endpoint or a profile).
LOCAL_S3_PROFILE | default | verbs | Profile of the bucket; another than default and minio makes it S3.
LOCAL_S3_ENDPOINT_URL |  | verbs | Address of the bucket's store, which makes it S3.
LOCAL_S3_AUTH_MODE |  | verbs | role: no profile is asked for, but the role of the machine.
LOCAL_ACCESS_KEY_ID |  | verbs | Key of the bucket's store, instead of a profile.
LOCAL_SECRET_ACCESS_KEY |  | verbs | What belongs to that key.
MINIO_URL |  | verbs | Address of the bucket's store, which makes it S3, where no other variable names one.
REMOTE_MINIO_URL |  | verbs | The same, with DR_CLOUD=remote.
GUI_ENABLE | False | screen | Window of the simulator.
USE_GUI |  | screen | Window of the simulator.
KINESIS_STREAM_NAME |  | stream | Video stream.
KINESIS_STREAM_ENABLE |  | stream | Video stream, in older files.
CAMERA_MAIN_ENABLE | True | told | Camera behind the car, for the video.
CAMERA_SUB_ENABLE | False | told | Camera above the track, for the video.
CAMERA_KVS_ENABLE | True | stream | Video stream.
ENABLE_EXTRA_KVS_OVERLAY | False | told | More figures on the video.
SIMAPP_SOURCE | awsdeepracercommunity/deepracer-simapp | container | Docker image.
SIMAPP_VERSION |  | container | Tag of the Docker image.
SAGEMAKER_IMAGE |  | container | Docker image, in older files.
ROBOMAKER_IMAGE |  | container | Docker image, in older files.
COACH_IMAGE |  | container | Docker image, in older files.
MINIO_IMAGE | latest | container | Docker image.
ANALYSIS_IMAGE | cpu | container | Docker image.
WORKERS | 1 | used | Courses, with DR_TRAIN_MULTI_CONFIG; cars side by side: rollout.num_worlds.
ROBOMAKER_MOUNT_LOGS | False | layout | Logs outside of Docker.
ROBOMAKER_MOUNT_SIMAPP_DIR |  | container | The simulator's files outside of Docker.
ROBOMAKER_MOUNT_SCRIPTS_DIR |  | container | The simulator's scripts outside of Docker.
ROBOMAKER_CUDA_DEVICES |  | device | GPU of the simulator.
SAGEMAKER_CUDA_DEVICES |  | device | GPU of the learner.
CLOUD_WATCH_ENABLE | False | cloudwatch | Logs to AWS.
CLOUD_WATCH_LOG_STREAM_PREFIX |  | cloudwatch | Logs to AWS.
DOCKER_STYLE | swarm | container | swarm or compose.
HOST_X | False | screen | The host's screen.
DISPLAY |  | screen | The screen.
WEBVIEWER_PORT | 8100 | verbs | Port of the page that dr-start-viewer serves.
QUIET_ACTIVATE | False | verbs | Say nothing when bin/activate.sh is read.
EXPERIMENT_NAME |  | verbs | Folder below experiments/ whose files come before those of the installation.
TELEGRAF_HOST |  | metrics | Where live figures go.
TELEGRAF_PORT |  | metrics | Where live figures go.
DROA_URL |  | droa | DeepRacer on AWS.
DROA_USERNAME |  | droa | DeepRacer on AWS.
DROA_DEBUG |  | droa | DeepRacer on AWS.
GAZEBO_ARGS |  | gazebo | Arguments of the simulator.
GAZEBO_RENDER_ENGINE | ogre2 | gazebo | Renderer of the simulator.
CUDA_VISIBLE_DEVICES |  | device | GPU of the learner.
DIR |  | verbs | Folder of the installation; bin/activate.sh sets it.
CONFIG |  | verbs | The run.env that is read; bin/activate.sh sets it.
""",
)

ENV_VARIABLES = _RUN + _SYSTEM
BY_NAME = {variable.name: variable for variable in ENV_VARIABLES}
