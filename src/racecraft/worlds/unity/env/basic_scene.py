"""A headless stand-in of ML-Agents' Basic scene: a program that speaks the genuine protocol as a player.

    python -m racecraft.worlds.unity.env.basic_scene --mlagents-port 5005

Rules (facts: unity-ml-agents, "'Basic' scene, real values"). One agent on a line of 20 places starts on place 10. It
sees its place, one-hot. Each step it stays (0), goes left (1) or right (2) and pays 0.01. Place 7 holds +0.1 and place
17 holds +1.0; both end the episode, and there is no other end. The best return is 7 * -0.01 + 1.0 = 0.93.

Habits of the original that are kept: each episode has a new agent id, because the scene is loaded again; RESET does
*not* move the agent back; and after a RESET the engine still carries out one step with the zero action, so the reward
that follows is not the agent's doing. `--agents` puts several scenes side by side.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping

import numpy as np

from racecraft.worlds.unity.env.player import ActionMessage, Info, ObservationMessage, UnityActionSpec, run_player

BEHAVIOR = "Basic?team=0"
PLACES, START, SMALL_GOAL, LARGE_GOAL = 20, 10, 7, 17
STEP_REWARD, SMALL_REWARD, LARGE_REWARD = -0.01, 0.1, 1.0
MOVES = (0, -1, 1)
"""Places moved by action: stay, left, right."""


class BasicScene:
    """The scene, `num_agents` times side by side.

    Args:
        num_agents: Agents, independent of each other.
        late_start: Whether an episode's first decision comes one message after the last one's end.
    """

    behaviors = {BEHAVIOR: UnityActionSpec(branches=(3,))}

    def __init__(self, num_agents: int = 1, late_start: bool = False) -> None:
        self._late_start = late_start
        self._places = [START] * num_agents
        self._rewards = [0.0] * num_agents
        self._ids = list(range(num_agents))
        self._next_id = num_agents
        self._ended: list[Info] = []
        self._absent: set[int] = set()
        self._begun = False

    def begin(self, seed: int) -> None:
        """Nothing here is left to chance."""

    def reset(self) -> None:
        """Begin; later resets move nobody, but the engine carries out one step with the zero action."""
        self._ended.clear()
        self._absent.clear()
        if self._begun:
            self._rewards = [STEP_REWARD] * len(self._rewards)
        self._begun = True

    def infos(self) -> Mapping[str, list[Info]]:
        """Tell of ended episodes, then of every agent that asks."""
        ended = list(self._ended)
        self._ended.clear()
        for index, place in enumerate(self._places):
            if index not in self._absent:
                ended.append(Info(self._ids[index], [_see(place)], self._rewards[index]))
        return {BEHAVIOR: ended}

    def act(self, actions: Mapping[str, list[ActionMessage]]) -> None:
        """Move every agent that asked."""
        rows = [index for index in range(len(self._places)) if index not in self._absent]
        self._absent.clear()
        given = actions.get(BEHAVIOR) or [ActionMessage([], [0])] * len(rows)
        for index, action in zip(rows, given, strict=True):
            self._move(index, action.discrete[0])

    def _move(self, index: int, choice: int) -> None:
        place = self._places[index] + MOVES[choice]  # between the goals, so never past an end of the line
        goal = {SMALL_GOAL: SMALL_REWARD, LARGE_GOAL: LARGE_REWARD}.get(place)
        self._places[index], self._rewards[index] = place, STEP_REWARD + (goal or 0.0)
        if goal is not None:
            self._ended.append(Info(self._ids[index], [_see(place)], self._rewards[index], done=True))
            self._places[index], self._rewards[index], self._ids[index] = START, 0.0, self._next_id
            self._next_id += 1
            if self._late_start:
                self._absent.add(index)


def _see(place: int) -> ObservationMessage:
    return ObservationMessage(_ONE_HOT[place], "Basic")


_ONE_HOT = np.eye(PLACES, dtype=np.float32)


def main() -> int:
    """Run the scene as a player; what Unity's players understand and we do not is passed over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], prefix_chars="-", allow_abbrev=False)
    parser.add_argument("--mlagents-port", type=int, help="the port to call; without it there is nothing to do")
    parser.add_argument("--agents", type=int, default=1, help="scenes side by side")
    parser.add_argument("--late-start", action="store_true", help="episodes begin one message after the last one's end")
    parser.add_argument("--linger-seconds", type=float, default=0.0, help="how long to stay after goodbye, for tests")
    given, _ = parser.parse_known_args()
    if given.mlagents_port is None:
        print("no --mlagents-port: a real player would run its own model now; this one has none", file=sys.stderr)
        return 2
    code = run_player(BasicScene(given.agents, given.late_start), given.mlagents_port)
    time.sleep(given.linger_seconds)
    return code


if __name__ == "__main__":
    raise SystemExit(main())
