"""The rows of AWS's chart on one machine: what is trained, with which settings and cores. Begin with `rows_for`.

Facts: battlesnake-and-sagemaker-rl.md B.2, B.3, D. What the source states: five snakes, one reward, one observation,
the same hyperparameters and time for all; the old trainer's figures are its script's defaults (B.3). What it does not
state is ours: how many games are stepped side by side, the first layers behind the convolutions, the memory's switches
(those of RLlib's DQN and Ape-X by default). All five snakes share one network here, as in the old trainer; RLlib's
runs had one each.
"""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import SettingError, nearest

GYMS = {
    "starter-pack": "the starter pack's gym, its rules and observations",
    "exact": "the official rules, seen as our snakes see them",
}
"""Which world is played in."""
WORLDS = "racecraft.worlds.battlesnake.env.source_experiment"
PLAIN = {"starter-pack": "StarterPackGames", "exact": "ExactGames"}
MASKED = {"starter-pack": "MaskedStarterPackGames", "exact": "MaskedExactGames"}

NETWORKS = {
    "starter-pack": (
        "network.conv_filters=16,32,256", "network.conv_kernels=5,3,3", "network.conv_strides=4,1,1",
        "network.hidden_units=256", "network.activation=relu", "network.stack_size=2",
    ),
    "exact": (
        "network.conv_filters=", "network.conv_kernels=", "network.conv_strides=", "network.image_units=128",
        "network.hidden_units=128,128", "network.activation=relu",
    ),
}  # fmt: skip
"""Of the starter pack the convolutions of its own RLlib model (B.2) over two frames."""
SHARED = ("learning_rate=5e-4", "discount=0.95", "batch_size=64", "train_every=20", "optimiser=adam")
"""Hyperparameters of the old trainer (B.3) that all of the source's rows have."""
LOOP = ("evaluation.every=1000000", "evaluation.episodes=5")
"""Nobody is judged while the clock runs; the checkpoints are, afterwards."""
TARGET_EVERY = 500 // 20
"""Gradient steps: RLlib's target_network_update_freq of 500 counts environment steps, and one is taken every 20."""
RLLIB = ("replay.capacity=50000", "replay.keep_mib=0", "runtime.keep_every=1")
"""RLlib's memory by default; too large for every checkpoint, so a resumed run begins it anew."""


@dataclass(frozen=True)
class Row:
    """One row of the chart."""

    name: str
    title: str
    algorithm: str
    world: str
    """As `racecraft gym train` takes it."""
    settings: tuple[str, ...]
    """As after `--set`."""
    cores: int
    """It may use."""
    is_ours: bool = False
    """Whether the source's chart has no such row."""


def rows_for(gym: str, cores: int) -> list[Row]:
    """Return the rows in the chart's order.

    Args:
        gym: A key of GYMS.
        cores: Of this machine. With one, there is no row with a core for the learner alone.

    Raises:
        SettingError: There is no such gym.
    """
    if gym not in GYMS:
        raise SettingError(f"--gym {gym}: expected one of {', '.join(GYMS)}. {nearest(gym, GYMS)}")
    plain = f"{WORLDS}:{PLAIN[gym]}"
    network = (*NETWORKS[gym], *LOOP)
    many = f"{cores} core" + "s" * (cores > 1)
    rllib = (
        *_group("dqn", SHARED), "dqn.double=true", "dqn.dueling=true", f"dqn.target_every={TARGET_EVERY}",
        "dqn.epsilon_last=0.02", "dqn.epsilon_steps=10000", "replay.prioritised=true", *RLLIB,
    )  # fmt: skip
    apex = (*_group("apex", SHARED), "apex.n_step=3", f"apex.target_every={TARGET_EVERY}", *RLLIB)
    rows = [
        Row("old", "hand-written DQN, one game, one core", "dqn", plain, (*network, *_old()), 1),
        Row("dqn-1-core", "DQN, one core", "dqn", plain, (*network, *rllib, *_games(16), "runtime.threads=1"), 1),
        Row(
            "dqn-all-cores", f"DQN, {many}", "dqn", plain,
            (*network, *rllib, *_games(16 * cores), f"runtime.threads={cores}"), cores,
        ),
        Row(
            "apex-homogeneous", f"Ape-X, {many} shared alike", "apex", plain,
            (*network, *apex, *_games(16 * cores), "runtime.threads=1"), cores,
        ),
    ]  # fmt: skip
    if cores > 1:
        others = f"{cores - 1} for the actors"
        rows.append(
            Row("apex-heterogeneous", f"Ape-X, {many}: one for the learner alone, {others}", "apex", plain,
                (*network, *apex, *_games(16 * cores), "runtime.threads=1", "apex.learner_cores=1"), cores)
        )  # fmt: skip
    return [*rows, _ours(gym, network, cores)]


def require_rows(rows: list[Row], named: list[str]) -> list[Row]:
    """Return the rows that are named, in the chart's order; all where none is.

    Raises:
        SettingError: There is no such row.
    """
    known = [row.name for row in rows]
    for name in named:
        if name not in known:
            raise SettingError(f"--row {name}: expected one of {', '.join(known)}. {nearest(name, known)}")
    return [row for row in rows if not named or row.name in named]


def _old() -> tuple[str, ...]:
    """Return the old trainer's own settings (B.3): its exploration fell by 0.995 an episode, a line here."""
    return (
        *_group("dqn", SHARED), "dqn.target_every=1", "dqn.target_share=0.001", "dqn.epsilon_last=0.01",
        "dqn.epsilon_steps=40000", "replay.capacity=5000", "replay.prioritised=false", "replay.keep_mib=0",
        "rollout.num_worlds=1", "rollout.horizon=20", "runtime.threads=1", "runtime.keep_every=5",
    )  # fmt: skip


def _ours(gym: str, network: tuple[str, ...], cores: int) -> Row:
    ppo = (
        "learning_rate=5e-4", "discount=0.99", "gae_lambda=0.95", "epochs=3", "batch_size=1024", "entropy_weight=0.01",
    )  # fmt: skip
    games = ("rollout.num_worlds=64", "rollout.horizon=32", f"runtime.threads={cores}", "runtime.keep_every=1")
    title = f"ours: PPO, self-play, masked, {cores} core" + "s" * (cores > 1)
    return Row(
        "ours", title, "ppo", f"{WORLDS}:{MASKED[gym]}", (*network, *_group("ppo", ppo), *games), cores, is_ours=True
    )


def _games(count: int) -> tuple[str, ...]:
    return (f"rollout.num_worlds={count}", "rollout.horizon=8")


def _group(name: str, settings: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{name}.{one}" for one in settings)
