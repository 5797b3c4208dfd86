"""Train on a Gymnasium environment with the same loop that trains the cars: a short taste of CartPole."""

import tempfile
from pathlib import Path

import racecraft as rc

with tempfile.TemporaryDirectory() as folder:
    trained = rc.train(
        "gymnasium",
        environment="CartPole-v1",
        stops="steps=6000",  # leave `stops` out to train until it is solved
        run=Path(folder) / "cartpole",
    )
    policy = rc.load_policy(trained.run)  # by itself: no environment, no settings
    judged = rc.evaluate(trained.run.path, episodes=20)

print(f"mean return {judged['mean_return']:.0f} after {trained.summary()['env_steps']} steps")
print(f"the policy sees {', '.join(policy.spec.visible)}; a pole left to chance falls after about 22 steps")
