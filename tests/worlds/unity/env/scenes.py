"""Test doubles: small scenes and players that lie, run in a thread or as a program of their own.

python scenes.py --scene crash --mlagents-port 5005
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time

import numpy as np

from racecraft.worlds.unity.env.basic_scene import BasicScene
from racecraft.worlds.unity.env.player import (
    ActionMessage,
    Info,
    ObservationMessage,
    Player,
    UnityActionSpec,
    run_player,
)


class Recorder:
    """A scene that plays a list of moments and writes down what it was told."""

    def __init__(self, behaviors, moments):
        self.behaviors, self.moments, self.told, self.resets, self.seed = behaviors, list(moments), [], 0, None
        self.at = 0

    def begin(self, seed):
        self.seed = seed

    def reset(self):
        self.resets += 1

    def infos(self):
        self.at += 1
        return self.moments[min(self.at - 1, len(self.moments) - 1)]

    def act(self, actions):
        self.told.append({name: [(one.continuous, one.discrete) for one in listed] for name, listed in actions.items()})


class CopyScene:
    """Each agent sees a number in [-1, 1] and a bit, and should tell both: hybrid actions, learnable in seconds."""

    behaviors = {"Copy?team=0": UnityActionSpec(continuous=1, branches=(2,))}

    def __init__(self, agents=4):
        self.agents = agents

    def begin(self, seed):
        self.rng = np.random.default_rng(seed)
        self.rewards = np.zeros(self.agents)
        self._draw()

    def reset(self):
        self._draw()

    def infos(self):
        return {
            "Copy?team=0": [
                Info(
                    i,
                    [ObservationMessage(np.array([self.numbers[i], self.bits[i]], np.float32), "sight")],
                    float(self.rewards[i]),
                )
                for i in range(self.agents)
            ]
        }

    def act(self, actions):
        listed = actions.get("Copy?team=0", [])
        for i, action in enumerate(listed):
            self.rewards[i] = (action.discrete[0] == self.bits[i]) - abs(action.continuous[0] - self.numbers[i])
        self._draw()

    def _draw(self):
        self.numbers = self.rng.uniform(-1, 1, self.agents)
        self.bits = self.rng.integers(0, 2, self.agents)


class PictureScene:
    """One agent with a picture as PNG (5 channels), a raw one (2 channels) and three numbers."""

    behaviors = {"Eyes": UnityActionSpec(branches=(2, 3))}
    png = np.random.default_rng(1).integers(0, 256, (6, 8, 5), dtype=np.uint8)
    raw = np.random.default_rng(2).random((3, 4, 2)).astype(np.float32)

    def begin(self, seed):
        pass

    def reset(self):
        pass

    def infos(self):
        seen = [
            ObservationMessage(self.png, "camera"),
            ObservationMessage(self.raw, "grid"),
            ObservationMessage(np.arange(3, dtype=np.float32), "numbers"),
        ]
        return {"Eyes": [Info(5, seen, forbidden=[False, True, False, True, False])]}

    def act(self, actions):
        pass


class DotScene:
    """Each agent sees a picture of a grey field with a bright dot on its left or right, and should go there.

    One choice ends the episode: +1 for the right side, -1 for the wrong one. A policy that does not look earns 0.

    Args:
        as_png: Whether the picture travels as PNG (three channels) or raw (two).
        with_sign: Whether a number comes with the picture that turns the task round: -1 means "away from the dot". Then
            neither alone tells what to do.
    """

    behaviors = {"Dot?team=0": UnityActionSpec(branches=(2,))}
    side = 16

    def __init__(self, as_png=True, with_sign=False, agents=16):
        self.as_png, self.with_sign, self.agents = as_png, with_sign, agents
        self.ended = []

    def begin(self, seed):
        self.rng = np.random.default_rng(seed)
        self._draw()

    def reset(self):
        self.ended.clear()
        self._draw()

    def infos(self):
        told = [*self.ended, *(Info(i, self._seen(i)) for i in range(self.agents))]
        self.ended.clear()
        return {"Dot?team=0": told}

    def act(self, actions):
        listed = actions.get("Dot?team=0") or [ActionMessage([], [0])] * self.agents
        for i, action in enumerate(listed):
            wanted = self.right[i] if self.signs[i] > 0 else not self.right[i]
            reward = 1.0 if action.discrete[0] == int(wanted) else -1.0
            self.ended.append(Info(i, self._seen(i), reward, done=True))
        self._draw()

    def _draw(self):
        self.right = self.rng.random(self.agents) < 0.5
        self.signs = self.rng.choice([-1.0, 1.0], self.agents) if self.with_sign else np.ones(self.agents)
        self.rows = self.rng.integers(2, self.side - 4, self.agents)
        self.columns = self.rng.integers(1, self.side // 2 - 3, self.agents) + self.right * self.side // 2

    def _seen(self, i):
        picture = np.full((self.side, self.side, 3 if self.as_png else 2), 60, np.uint8)
        picture[self.rows[i] : self.rows[i] + 3, self.columns[i] : self.columns[i] + 3] = 255
        eye = ObservationMessage(picture if self.as_png else picture.astype(np.float32) / 255, "eye")
        return [eye, ObservationMessage(np.array([self.signs[i]], np.float32), "sign")] if self.with_sign else [eye]


class DrawnScene:
    """Agents who are shown something drawn anew each time; one answer is an episode."""

    def __init__(self, agents=16):
        self.agents = agents
        self.ended = []

    def begin(self, seed):
        self.rng = np.random.default_rng(seed)
        self._draw()

    def reset(self):
        self.ended.clear()


class MaskScene(DrawnScene):
    """Three doors, of which one is forbidden each time; behind the highest allowed one lies +1, behind the other -1."""

    behaviors = {"Door?team=0": UnityActionSpec(branches=(3,))}

    def infos(self):
        told = [*self.ended]
        self.ended.clear()
        for i in range(self.agents):
            told.append(Info(i, [self._seen(i)], forbidden=[door == self.shut[i] for door in range(3)]))
        return {"Door?team=0": told}

    def act(self, actions):
        listed = actions.get("Door?team=0")
        for i in range(self.agents):
            door = listed[i].discrete[0] if listed else (self.shut[i] + 1) % 3
            if door == self.shut[i]:
                raise AssertionError(f"agent {i} went through the door that was shut")
            best = 1 if self.shut[i] == 2 else 2
            self.ended.append(Info(i, [self._seen(i)], 1.0 if door == best else -1.0, done=True))
        self._draw()

    def _draw(self):
        self.shut = self.rng.integers(0, 3, self.agents)

    def _seen(self, i):
        return ObservationMessage(np.eye(3, dtype=np.float32)[self.shut[i]], "sight")


class TellScene(DrawnScene):
    """Each agent sees a number in [-1, 1] and a bit, and tells both at once: hybrid actions, with a choice forbidden.

    It earns 1 less how far its number is away, or -1 where the bit is wrong; the third choice is never allowed. One
    telling is an episode.
    """

    behaviors = {"Teller?team=0": UnityActionSpec(continuous=1, branches=(3,))}

    def infos(self):
        told = list(self.ended)
        self.ended.clear()
        told += [Info(i, [self._seen(i)], forbidden=[False, False, True]) for i in range(self.agents)]
        return {"Teller?team=0": told}

    def act(self, actions):
        listed = actions.get("Teller?team=0") or [ActionMessage([0.0], [0])] * self.agents
        for i, action in enumerate(listed):
            if action.discrete[0] == 2:
                raise AssertionError(f"agent {i} chose what was forbidden")
            right = action.discrete[0] == self.bits[i]
            reward = 1.0 - abs(action.continuous[0] - self.numbers[i]) if right else -1.0
            self.ended.append(Info(i, [self._seen(i)], float(reward), done=True))
        self._draw()

    def _draw(self):
        self.numbers = self.rng.uniform(-1, 1, self.agents)
        self.bits = self.rng.integers(0, 2, self.agents)

    def _seen(self, i):
        return ObservationMessage(np.array([self.numbers[i], self.bits[i]], np.float32), "sight")


class AimScene(DrawnScene):
    """Each agent sees a number in [-1, 1] and should tell it: numbers alone. It earns 1 less how far it is away.

    One telling is an episode.
    """

    behaviors = {"Aim?team=0": UnityActionSpec(continuous=1)}

    def infos(self):
        told = list(self.ended)
        self.ended.clear()
        return {"Aim?team=0": told + [Info(i, [self._seen(i)]) for i in range(self.agents)]}

    def act(self, actions):
        listed = actions.get("Aim?team=0") or [ActionMessage([0.0], [])] * self.agents
        for i, action in enumerate(listed):
            reward = 1.0 - abs(action.continuous[0] - self.numbers[i])
            self.ended.append(Info(i, [self._seen(i)], float(reward), done=True))
        self._draw()

    def _draw(self):
        self.numbers = self.rng.uniform(-1, 1, self.agents)

    def _seen(self, i):
        return ObservationMessage(np.array([self.numbers[i]], np.float32), "sight")


class LeverScene(DrawnScene):
    """Two levers of two and three places; each agent sees where both should stand: several branches.

    Both right earn 1, one of them 0, none -1. Of the second lever a place that is wrong is forbidden each time. One
    pull is an episode.
    """

    behaviors = {"Lever?team=0": UnityActionSpec(branches=(2, 3))}

    def infos(self):
        told = list(self.ended)
        self.ended.clear()
        for i in range(self.agents):
            stuck = [place == self.stuck[i] for place in range(3)]
            told.append(Info(i, [self._seen(i)], forbidden=[False, False, *stuck]))
        return {"Lever?team=0": told}

    def act(self, actions):
        listed = actions.get("Lever?team=0")
        for i in range(self.agents):
            left, right = listed[i].discrete if listed else (self.left[i], self.right[i])
            if right == self.stuck[i]:
                raise AssertionError(f"agent {i} moved a lever to where it cannot stand")
            reward = float(left == self.left[i]) + float(right == self.right[i]) - 1.0
            self.ended.append(Info(i, [self._seen(i)], reward, done=True))
        self._draw()

    def _draw(self):
        self.left = self.rng.integers(0, 2, self.agents)
        self.right = self.rng.integers(0, 3, self.agents)
        self.stuck = (self.right + self.rng.integers(1, 3, self.agents)) % 3

    def _seen(self, i):
        seen = np.concatenate([np.eye(2)[self.left[i]], np.eye(3)[self.right[i]]])
        return ObservationMessage(seen.astype(np.float32), "sight")


class DuoScene:
    """Two behaviors that see and do different things: dots and numbers; the dots ask at every second message only."""

    behaviors = {**DotScene.behaviors, **TellScene.behaviors}

    def __init__(self):
        self.dots, self.tellers, self.tick = DotScene(as_png=False, agents=8), TellScene(agents=12), 0

    def begin(self, seed):
        self.dots.begin(seed)
        self.tellers.begin(seed)

    def reset(self):
        self.dots.reset()
        self.tellers.reset()

    def infos(self):
        dots = self.dots.infos() if self.tick % 2 == 0 else {"Dot?team=0": []}
        return dots | self.tellers.infos()

    def act(self, actions):
        if self.tick % 2 == 0:
            self.dots.act(actions)
        self.tellers.act(actions)
        self.tick += 1


class BigScene:
    """One agent that sees eight megabytes."""

    behaviors = {"Big": UnityActionSpec(continuous=2)}
    sight = np.linspace(0, 1, 2_000_000, dtype=np.float32)

    def begin(self, seed):
        pass

    def reset(self):
        pass

    def infos(self):
        return {"Big": [Info(0, [ObservationMessage(self.sight)])]}

    def act(self, actions):
        pass


class GameScene:
    """Two teams of two, with groups; every third moment an agent is interrupted, and a referee sees other things."""

    behaviors = {
        "Striker?team=0": UnityActionSpec(continuous=2),
        "Striker?team=1": UnityActionSpec(continuous=2),
        "Referee?team=0": UnityActionSpec(branches=(2, 2)),
    }

    def begin(self, seed):
        self.tick = 0
        self.heard = []

    def reset(self):
        self.tick = 0

    def infos(self):
        told = {}
        for team in (0, 1):
            sight = [ObservationMessage(np.array([team, self.tick, 0.5], np.float32))]
            infos = [Info(10 * team + i, sight, 0.25, group_id=team + 1, group_reward=0.5) for i in (0, 1)]
            if self.tick and self.tick % 3 == 0:
                infos.insert(0, Info(10 * team, sight, 1.0, done=True, interrupted=team == 1, group_id=team + 1))
            told[f"Striker?team={team}"] = infos
        told["Referee?team=0"] = [
            Info(99, [ObservationMessage(np.eye(4, dtype=np.float32))], forbidden=[True, False, False, False])
        ]
        return told

    def act(self, actions):
        self.tick += 1
        self.heard.append(actions)


class Crasher(BasicScene):
    """Ends in the middle of its ninth step, after telling its log why."""

    steps = 0

    def act(self, actions):
        self.steps += 1
        if self.steps == 9:
            print("Fatal: the reactor is out of neutrons", flush=True)
            os.abort()
        super().act(actions)


class Sleeper(BasicScene):
    """Falls asleep in its third step."""

    steps = 0

    def act(self, actions):
        self.steps += 1
        if self.steps == 3:
            print("Zzz", flush=True)
            time.sleep(600)
        super().act(actions)


class Liar(Player):
    """A player whose messages are bent by `lie(number, message)`, which returns a message or bytes."""

    lie = staticmethod(lambda number, message: message)
    count = 0

    def exchange_message(self, exchange, message):
        bent = self.lie(self.count, message)
        self.count += 1
        return exchange(bent if isinstance(bent, bytes) else bent.SerializeToString())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--mlagents-port", type=int, required=True)
    parser.add_argument("--scene", required=True)
    given, _ = parser.parse_known_args()
    if given.scene == "early":
        print("No GPU, no display, no hope", flush=True)
        return 3
    if given.scene == "silent":
        print("loading shaders for ever", flush=True)
        time.sleep(600)
    if given.scene == "stubborn":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        helper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        print("helper", helper.pid, flush=True)
        run_player(BasicScene(), given.mlagents_port)
        time.sleep(600)
    scene = PROGRAMS[given.scene]()
    return run_player(scene, given.mlagents_port)


PROGRAMS = {
    "crash": Crasher,
    "sleep": Sleeper,
    "copy": CopyScene,
    "game": GameScene,
    "basic": BasicScene,
    "aim": AimScene,
    "doors": MaskScene,
    "duo": DuoScene,
    "levers": LeverScene,
    "tell": TellScene,
    "dot-png": DotScene,
    "dot-raw": lambda: DotScene(as_png=False),
    "dot-sign-png": lambda: DotScene(with_sign=True),
    "dot-sign-raw": lambda: DotScene(as_png=False, with_sign=True),
}


if __name__ == "__main__":
    raise SystemExit(main())
