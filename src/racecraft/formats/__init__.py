"""Every file a stranger may bring or take. Reader and writer stand together, with a round-trip test.

Files that racers bring, in the AWS dialect (degrees, percent), which is spoken here and nowhere above:

    model_metadata.py    what the car can do and sees: `model_metadata.json`
    hyperparameters.py   how it learns: `hyperparameters.json`
    reward_file.py       what it is paid for: `reward_function.py`
    run_env.py           the settings of DeepRacer for Cloud: `system.env`, `run.env`, `worker-N.env`

Files that AWS's tools read, written as AWS writes them:

    sim_trace.py         one CSV row a tick
    simulation_log.py    the same ticks, and what was trained, as lines of a log
    training_metrics.py  one row an episode, as JSON
    training_params.py   what the simulator was told, as a sliver of YAML
    model_folder.py      where all of these stand, and which checkpoint is best and last

Files of our own, which strangers may take away:

    run_folder.py        one training in one folder: layout, `job.json`, `metrics.jsonl`
    run_lock.py          who may write there
    checkpoint.py        weights and a trainer's whole state, as safetensors (`tensor_file.py`)
    episodes.py          one row a tick, as Parquet

Helpers: `atomic.py` writes a file whole or not at all, `json_text.py` knows on which line a JSON value stands.

Radians, metres and seconds inside; nothing read here can run code, except a reward function, which is its owner's.
This room knows nothing of worlds or learning.
"""
