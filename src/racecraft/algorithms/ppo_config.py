"""The settings of proximal policy optimisation, in `ppo.py`."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class PpoConfig:
    """Proximal policy optimisation with a clipped objective."""

    learning_rate: float = setting(5e-4, "Adam's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.97, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    gae_lambda: float = setting(0.95, "Mix of advantage estimates (lambda).", low=0.0, high=1.0)
    epochs: int = setting(4, "Passes over each rollout.", low=1, high=100)
    batch_size: int = setting(256, "Transitions in one minibatch.", low=1)
    clip: float = setting(0.2, "How far the probability ratio may move from 1.", low=0.0, high=1.0)
    entropy_weight: float = setting(0.01, "Weight of the entropy bonus.", low=0.0, high=1.0)
    value_weight: float = setting(0.5, "Weight of the value loss.", low=0.0)
    value_loss: str = setting("mse", "How the critic's error is measured.", choices=("mse", "huber"))
    max_grad_norm: float | None = setting(0.5, "Gradients are scaled down to this norm.", low=0.0)
    adam_epsilon: float = setting(1e-5, "Adam's epsilon.", low=0.0)
    adam_form: str = setting(
        "paper",
        "Where Adam adds its epsilon: `tensorflow` adds it before the second moment's bias is taken out, which makes "
        "the first steps smaller.",
        choices=("paper", "tensorflow"),
    )
    standardise: str = setting(
        "minibatch", "Over what advantages are standardised.", choices=("minibatch", "rollout", "none")
    )
    drop_remainder: bool = setting(False, "Leave out the last minibatch of an epoch when it is not full.")
    precision: str = setting(
        "float32",
        "What layers multiply in while training; weights, heads, losses and Adam stay float32. bfloat16 is coarser, "
        "and faster on processors that have it (avx512_bf16, amx); auto takes it there.",
        choices=("float32", "bfloat16", "auto"),
    )
    centred_pixels: bool = setting(
        False,
        "Step the layer that looks at pixels as if their mean were 0, which it never is: it learns sooner. Weights and "
        "files are of pixels as they are; networks of your own (`network.encoder`, `network.policy`) are left alone.",
    )
    probability_floor: float = setting(
        0.0, "No choice counts as less likely than this; the others are not lowered for it.", low=0.0, high=1e-3
    )
    distribution: str = setting(
        "gaussian",
        "How numbers are drawn: `gaussian` and cut to their bounds, as at AWS, or `squashed` into them by a tanh.",
        choices=("gaussian", "squashed"),
    )
    initial_std: float = setting(
        1.0,
        "How widely numbers are drawn at the beginning: standard deviation, in halves of their range.",
        low=1e-3, high=10.0,
    )  # fmt: skip
    learning_rate_schedule: str = setting(
        "constant",
        "How the learning rate goes on: as it is, or in a straight line to 1e-10 at the stop `steps=`, "
        "or where there is none at `minutes=`.",
        choices=("constant", "linear"),
    )
    clip_schedule: str = setting(
        "constant", "The same for the clip, which ends at 0.1.", choices=("constant", "linear")
    )
    entropy_schedule: str = setting(
        "constant", "The same for the entropy's weight, which ends at 1e-5.", choices=("constant", "linear")
    )
    exploration: str = setting(
        "categorical",
        "How choices are drawn while training: by their probability, or the likeliest with random ones between.",
        choices=("categorical", "e-greedy"),
    )
    epsilon_last: float = setting(
        0.05, "Share of random choices at the end; with e-greedy exploration.", low=0.0, high=1.0
    )
    sequence_length: int = setting(
        16, "Ticks that gradients flow back through, with `network.memory`; minibatches are whole such stretches.",
        unit="ticks", low=1,
    )  # fmt: skip
    epsilon_steps: int = setting(
        10_000, "Steps until that share is reached, in a straight line from 1; with e-greedy.", unit="steps", low=1
    )
    asynchronous: bool = setting(
        False,
        "Learn in a thread of its own while worlds go on with the weights of before, and weigh by V-trace what they "
        "decided: for slow worlds, with few epochs.",
    )
    ratio_cap: float = setting(
        1.0,
        "How much a decision of older weights may count at most (rho and c of V-trace); with asynchronous.",
        low=1e-3,
    )

    def __post_init__(self) -> None:
        check_group(self)
