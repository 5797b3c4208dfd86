"""Every file a stranger may bring or take. Reader and writer stand together, with a round-trip test.

Files that racers bring, in the AWS dialect (degrees, percent), which is spoken here and nowhere above:

    model_metadata.py    what the car can do and sees: `model_metadata.json`
    hyperparameters.py   how it learns: `hyperparameters.json`
    reward_file.py       what it is paid for: `reward_function.py`

Files of our own, which strangers may take away:

    run_folder.py        one training in one folder: layout, lock, `job.json`, `metrics.jsonl`
    checkpoint.py        weights and a trainer's whole state as safetensors
    episodes.py          one row a tick, as Parquet

Helpers: `whole.py` writes a file whole or not at all, `json_text.py` knows on which line a JSON value stands.

Radians, metres and seconds inside; nothing read here can run code, except a reward function, which is its owner's.
This room knows nothing of worlds or learning.
"""
