"""A headless stand-in of the scene 3DBall, for what ML-Agents' tests do with it: twelve agents, two numbers each.

The ball rolls with the tilt that the actions give, and an episode ends when it has rolled off.
"""

import argparse

import numpy as np

from racecraft.worlds.unity.env.player import Info, ObservationMessage, UnityActionSpec, run_player

BEHAVIOR = "3DBall?team=0"
AGENTS, EDGE, SPEED = 12, 1.0, 0.05


class BallScene:
    behaviors = {BEHAVIOR: UnityActionSpec(continuous=2)}

    def begin(self, seed):
        self.chance = np.random.default_rng(seed)
        self.ids = list(range(AGENTS))
        self.next_id = AGENTS
        self.reset()

    def reset(self):
        self.places = self.chance.uniform(-0.5, 0.5, (AGENTS, 2))
        self.ended = []

    def infos(self):
        told, self.ended = self.ended, []
        return {BEHAVIOR: told + [Info(self.ids[row], [self.see(row)], 0.1) for row in range(AGENTS)]}

    def act(self, actions):
        for row, action in enumerate(actions[BEHAVIOR]):
            self.places[row] += SPEED * np.array(action.continuous)
            if np.abs(self.places[row]).max() > EDGE:
                self.ended.append(Info(self.ids[row], [self.see(row)], -1.0, done=True))
                self.places[row], self.ids[row] = self.chance.uniform(-0.5, 0.5, 2), self.next_id
                self.next_id += 1

    def see(self, row):
        return ObservationMessage(np.concatenate([self.places[row], np.zeros(6)]).astype(np.float32), "ball")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--mlagents-port", type=int, required=True)
    given, _ = parser.parse_known_args()
    return run_player(BallScene(), given.mlagents_port)


if __name__ == "__main__":
    raise SystemExit(main())
