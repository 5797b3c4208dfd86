"""Every variable of DeepRacer for Cloud that a user's `system.env`, `run.env` or `worker-N.env` may hold.

A variable is `used` where racecraft obeys it (`training/deepracer/race_environment.py` says how), and `known` where it
is read, kept and passed over: it belongs to Docker, AWS, Gazebo or a race that is not built yet. One variable is ours,
RACECRAFT_STOP: DeepRacer for Cloud passes it over, and has none for when a training ends.

Source: facts: DeepRacer for Cloud, its templates, `prepare-config.py` and reference page.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EnvVariable:
    """One variable."""

    name: str
    file: str
    """Where it stands in a new installation: "system" or "run". Any file may hold it."""
    default: str
    """Its value in a new file; empty where it has none."""
    status: str
    """Either "used" or "known"."""
    doc: str


OTHER_SPELLINGS = {
    "DR_TRAIN_ROUND_ROBIN_ADVANCE_DISTANCE": "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST",
    "DR_COLLISION_PENALTY": "DR_EVAL_COLLISION_PENALTY",
    "DR_EVAL_OPP_MODEL_PREFIX": "DR_EVAL_OPP_S3_MODEL_PREFIX",
    "DR_CHANGE_START_POSITION": "DR_TRAIN_CHANGE_START_POSITION",
    "DR_ALTERNATE_DRIVING_DIRECTION": "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION",
}
"""Names that documents, older versions or slips of the code use, and the names they mean."""


def _rows(file: str, table: str) -> tuple[EnvVariable, ...]:
    """Read a table of lines "NAME | default | status | doc"; names are written without DR_."""
    rows = [[cell.strip() for cell in line.split("|")] for line in table.strip().splitlines()]
    return tuple(
        EnvVariable(name if name.startswith("RACECRAFT_") else f"DR_{name}", file, default, status, doc)
        for name, default, status, doc in rows
    )


_RUN = _rows(
    "run",
    """
RUN_ID | 0 | known | Number of a run beside others.
WORLD_NAME | reinvent_base | used | Track.
RACE_TYPE | TIME_TRIAL | used | TIME_TRIAL, OBJECT_AVOIDANCE or HEAD_TO_BOT; HEAD_TO_MODEL is not built yet.
CAR_NAME | FastCar | known | Name shown on the video.
CAR_BODY_SHELL_TYPE | deepracer | known | Shell of the car on the video.
CAR_COLOR | Red | known | Colour of the car on the video.
DISPLAY_NAME | $DR_CAR_NAME | known | Name shown on the video.
RACER_NAME | $DR_CAR_NAME | known | Name of the racer.
ENABLE_DOMAIN_RANDOMIZATION | False | known | Other colours and light in each episode.
EVAL_NUMBER_OF_TRIALS | 3 | used | Laps of `racecraft evaluate` where none are asked for.
EVAL_IS_CONTINUOUS | True | known | After a mishap: go on with a penalty instead of ending the trial.
EVAL_MAX_RESETS | 100 | known | Mishaps until a trial ends all the same.
EVAL_OFF_TRACK_PENALTY | 5.0 | known | Seconds for leaving the track.
EVAL_COLLISION_PENALTY | 5.0 | known | Seconds for a collision.
EVAL_SAVE_MP4 | False | known | Keep the video.
EVAL_CHECKPOINT | last | used | The checkpoint it drives where none is asked for: last or best.
EVAL_OPP_S3_MODEL_PREFIX | rl-deepracer-sagemaker | known | Model of the opponent.
EVAL_OPP_CAR_BODY_SHELL_TYPE | deepracer | known | Shell of the opponent.
EVAL_OPP_CAR_NAME | FasterCar | known | Name of the opponent's car.
EVAL_OPP_DISPLAY_NAME | $DR_EVAL_OPP_CAR_NAME | known | Name of the opponent on the video.
EVAL_OPP_RACER_NAME | $DR_EVAL_OPP_CAR_NAME | known | Name of the opponent.
EVAL_DEBUG_REWARD | False | known | Run the reward function in evaluations too.
EVAL_RESET_BEHIND_DIST | 1.0 | known | Metres behind the mishap where the car goes on.
EVAL_REVERSE_DIRECTION | False | known | Evaluate in the opposite direction.
EVAL_RTF |  | known | Limit of the simulator's speed.
TRAIN_RTF |  | known | Limit of the simulator's speed.
TRAIN_CHANGE_START_POSITION | True | used | Whether starts advance round the track.
TRAIN_REVERSE_DIRECTION | False | used | Drive in the opposite direction.
TRAIN_ALTERNATE_DRIVING_DIRECTION | False | known | Change the direction after each episode.
TRAIN_START_POSITION_OFFSET | 0.0 | used | Where on the lap the first start lies, 0 to 1.
TRAIN_ROUND_ROBIN_ADVANCE_DIST | 0.05 | used | How far the next start lies ahead, in laps.
TRAIN_MULTI_CONFIG | False | known | Whether worker-N.env files are used.
TRAIN_MIN_EVAL_TRIALS | 5 | used | Evaluation laps after each iteration.
TRAIN_BEST_MODEL_METRIC | progress | used | What makes a checkpoint the best: progress, reward or laptime.
TRAIN_MAX_STEPS_PER_ITERATION |  | known | Steps of an iteration beyond which AWS throws experience away.
RACECRAFT_STOP |  | used | When training ends, as after --stop: laps minutes=30.
LOCAL_S3_MODEL_PREFIX | rl-deepracer-sagemaker | known | Folder of the model.
LOCAL_S3_PRETRAINED | False | used | Whether training begins with an older model.
LOCAL_S3_PRETRAINED_PREFIX | rl-sagemaker-pretrained | used | Folder of that model.
LOCAL_S3_PRETRAINED_CHECKPOINT | last | used | Its checkpoint: last or best.
LOCAL_S3_CUSTOM_FILES_PREFIX | custom_files | used | Folder of the user's files.
LOCAL_S3_TRAINING_PARAMS_FILE | training_params.yaml | known | Name of the file for the simulator.
LOCAL_S3_EVAL_PARAMS_FILE | evaluation_params.yaml | known | Name of the file for the simulator.
LOCAL_S3_MODEL_METADATA_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/model_metadata.json | known | The car.
LOCAL_S3_HYPERPARAMETERS_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/hyperparameters.json | known | How it learns.
LOCAL_S3_REWARD_KEY | $DR_LOCAL_S3_CUSTOM_FILES_PREFIX/reward_function.py | known | What it is paid for.
LOCAL_S3_METRICS_PREFIX | $DR_LOCAL_S3_MODEL_PREFIX/metrics | known | Folder of the metrics.
UPLOAD_S3_PREFIX | $DR_LOCAL_S3_MODEL_PREFIX-1 | known | Folder for uploads.
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
CLOUD | local | known | Kind of storage.
AWS_APP_REGION | us-east-1 | known | AWS region.
UPLOAD_S3_PROFILE | default | known | AWS profile for uploads.
UPLOAD_S3_BUCKET |  | known | Bucket for uploads.
UPLOAD_S3_ROLE |  | known | Role for uploads, in older files.
LOCAL_S3_BUCKET | bucket | known | Folder that stands for the bucket.
LOCAL_S3_PROFILE | default | known | Profile of the local storage.
LOCAL_S3_ENDPOINT_URL |  | known | Address of the local storage.
LOCAL_S3_AUTH_MODE |  | known | How the local storage is opened.
LOCAL_ACCESS_KEY_ID |  | known | Key of the local storage.
LOCAL_SECRET_ACCESS_KEY |  | known | Key of the local storage.
MINIO_URL |  | known | Address of the local storage.
REMOTE_MINIO_URL |  | known | Address of a storage elsewhere.
GUI_ENABLE | False | known | Window of the simulator.
USE_GUI |  | known | Window of the simulator.
KINESIS_STREAM_NAME |  | known | Video stream.
KINESIS_STREAM_ENABLE |  | known | Video stream, in older files.
CAMERA_MAIN_ENABLE | True | known | Camera behind the car, for the video.
CAMERA_SUB_ENABLE | False | known | Camera above the track, for the video.
CAMERA_KVS_ENABLE | True | known | Video stream.
ENABLE_EXTRA_KVS_OVERLAY | False | known | More figures on the video.
SIMAPP_SOURCE | awsdeepracercommunity/deepracer-simapp | known | Docker image.
SIMAPP_VERSION |  | known | Tag of the Docker image.
SAGEMAKER_IMAGE |  | known | Docker image, in older files.
ROBOMAKER_IMAGE |  | known | Docker image, in older files.
COACH_IMAGE |  | known | Docker image, in older files.
MINIO_IMAGE | latest | known | Docker image.
ANALYSIS_IMAGE | cpu | known | Docker image.
WORKERS | 1 | known | Simulators side by side.
ROBOMAKER_MOUNT_LOGS | False | known | Logs outside of Docker.
ROBOMAKER_MOUNT_SIMAPP_DIR |  | known | The simulator's files outside of Docker.
ROBOMAKER_MOUNT_SCRIPTS_DIR |  | known | The simulator's scripts outside of Docker.
ROBOMAKER_CUDA_DEVICES |  | known | GPU of the simulator.
SAGEMAKER_CUDA_DEVICES |  | known | GPU of the learner.
CLOUD_WATCH_ENABLE | False | known | Logs to AWS.
CLOUD_WATCH_LOG_STREAM_PREFIX |  | known | Logs to AWS.
DOCKER_STYLE | swarm | known | swarm or compose.
HOST_X | False | known | The host's screen.
DISPLAY |  | known | The screen.
WEBVIEWER_PORT | 8100 | known | Port of the viewer.
QUIET_ACTIVATE | False | known | Say nothing at the start.
EXPERIMENT_NAME |  | known | Folder below experiments/.
TELEGRAF_HOST |  | known | Where live figures go.
TELEGRAF_PORT |  | known | Where live figures go.
DROA_URL |  | known | DeepRacer on AWS.
DROA_USERNAME |  | known | DeepRacer on AWS.
DROA_DEBUG |  | known | DeepRacer on AWS.
GAZEBO_ARGS |  | known | Arguments of the simulator.
GAZEBO_RENDER_ENGINE | ogre2 | known | Renderer of the simulator.
DIR |  | known | Folder of the installation.
CONFIG |  | known | The run.env that was read.
""",
)

ENV_VARIABLES = _RUN + _SYSTEM
BY_NAME = {variable.name: variable for variable in ENV_VARIABLES}
