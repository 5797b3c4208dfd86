"""The words of reinforcement learning, as the lessons use them, each with one sentence. Begin with `WORDS`.

`racecraft explain WORD`, the words' page of the course and the box of a lesson read this one table.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from racecraft.contract.message import Message


@dataclass(frozen=True)
class Term:
    """A word and what it means."""

    name: str
    meaning: Message


def _words(*rows: tuple[str, Message]) -> tuple[Term, ...]:
    return tuple(Term(name, meaning) for name, meaning in rows)


WORDS = _words(
    ("reinforcement learning", Message("Learning by trial and reward.")),
    ("agent", Message("What decides: a car, a snake, a character in Unity.")),
    ("environment", Message("Everything the agent acts in: road, other cars, rules.")),
    ("state", Message("What fully describes the situation now.")),
    ("observation", Message("What the agent is given of the state, such as a camera picture.")),
    ("action", Message("One thing the agent may do.")),
    ("action space", Message("All actions the agent may choose from.")),
    ("reward", Message("The number paid after each action.")),
    ("reward function", Message("Code that turns one moment into a number.")),
    ("episode", Message("One drive from its start to its end.")),
    ("step", Message("One decision and its consequence; a car decides 15 times a second.")),
    ("return", Message("The rewards of an episode added up, later ones discounted.")),
    ("discount factor", Message("How much a later reward still counts; written γ.")),
    ("policy", Message("Which action the agent takes in which state, and how likely.")),
    ("random policy", Message("Every action is equally likely.")),
    ("greedy", Message("Always the best known action.")),
    ("value", Message("The return to be expected from here on.")),
    ("value function", Message("The value of every state.")),
    ("action value (Q)", Message("The value of doing this action here.")),
    ("advantage", Message("How much better an action was than what is expected here.")),
    ("baseline", Message("What is subtracted from returns, so that good means better than usual.")),
    ("Q-learning", Message("Learning the value of each action from its reward and the best value behind it.")),
    ("policy gradient", Message("Raising the probability of what paid.")),
    ("gradient", Message("The direction in which the return grows fastest.")),
    ("exploration", Message("Trying what is not known to pay.")),
    ("exploitation", Message("Doing what has paid best so far.")),
    ("ε-greedy", Message("A random action with probability ε, otherwise the best known one.")),
    ("convergence", Message("The curves stop improving and stay.")),
    ("local optimum", Message("Better than everything nearby, not the best of all.")),
    ("overfitting", Message("Good where it was trained, bad elsewhere.")),
    ("generalisation", Message("Working where it was not trained.")),
    ("domain randomisation", Message("Training under changing light, camera, wheels and delays, for the real car.")),
    ("training", Message("Letting the agent learn.")),
    ("evaluation", Message("Drives without exploring, to judge the policy.")),
    ("replay buffer", Message("A store of past steps to learn from again.")),
    ("experience", Message("Steps collected for learning.")),
    ("entropy", Message("How undecided the policy still is.")),
    ("clipping", Message("Holding the probability ratio within limits.")),
    ("probability ratio", Message("An action's new probability divided by its old one.")),
    ("epoch", Message("One pass over the collected steps.")),
    ("batch", Message("The steps used for one gradient.")),
    ("learning rate", Message("How far one step of the learner goes.")),
    ("hyperparameter", Message("A setting of the learning; the training does not change it.")),
    ("neural network", Message("A function from observation to action probabilities, with weights that learn.")),
    ("convolution", Message("A small filter that is slid over a picture and answers where its pattern is.")),
    ("heat map (Grad-CAM)", Message("Where in a picture the last convolution found what a decision was made by.")),
    ("weights", Message("The numbers inside a neural network.")),
    ("checkpoint", Message("A saved state of a training.")),
    ("model", Message("What a training leaves: the policy and its settings.")),
    ("supervised learning", Message("Learning from labelled examples.")),
    ("unsupervised learning", Message("Finding structure in data without labels.")),
    ("behavioural cloning", Message("Copying recorded driving; supervised learning of a policy.")),
    ("search (planning)", Message("Looking ahead before moving.")),
    ("self-play", Message("Learning by playing against oneself.")),
    ("deep Q-network (DQN)", Message("Q-learning with a neural network and a replay buffer.")),
    ("target network", Message("A slow copy of the network that gives the targets.")),
    ("temperature", Message("How even a choice by values is; near 0 the best is always taken.")),
    ("evolution strategy", Message("Learning by trying changed weights and moving towards what scored better.")),
    ("PPO", Message("A policy gradient with a limit on each step.")),
    ("sparse reward", Message("A reward paid rarely, for example only at the goal.")),
    ("reward shaping", Message("Adding small rewards that guide.")),
    ("reward hacking", Message("Scoring without doing what was meant.")),
    ("credit assignment", Message("Finding which action earned the reward.")),
    ("terminal state", Message("A state that ends the episode.")),
    ("truncated (time limit)", Message("Ended by the clock, not by the task.")),
    ("random seed", Message("A number that makes chance repeatable.")),
    ("centre line", Message("The middle of the track.")),
    ("progress", Message("Per cent of the lap driven.")),
    ("off track", Message("All wheels outside the track; the episode ends.")),
    ("waypoint", Message("A numbered point on the centre line.")),
    ("lap", Message("Once round the track.")),
    ("ratings (Elo)", Message("Strength as a number; 400 points are odds of ten to one.")),
    ("heuristic", Message("A rule written by hand.")),
    ("worker", Message("A process that collects steps.")),
    ("step penalty", Message("A small cost of each step; 0.01 in Unity's Basic.")),
    ("endpoint", Message("An address that answers observations with actions.")),
    ("wrapper", Message("Gives one interface the shape of another.")),
    ("deploy", Message("Put a model where it answers.")),
)  # fmt: skip
"""In the order in which the course meets them."""


def find_words(wanted: str) -> list[Term]:
    """Return the words of this name, else those whose name holds it; case, blanks and dashes do not matter.

    >>> [word.name for word in find_words("dqn")], [word.name for word in find_words("Discount-Factor")]
    (['deep Q-network (DQN)'], ['discount factor'])
    """
    folded = _folded(wanted)
    exact = [word for word in WORDS if folded in (_folded(word.name), *map(_folded, word.name.rstrip(")").split("(")))]
    return exact or [word for word in WORDS if folded and folded in _folded(word.name)]


def _folded(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())


def words_of(names: Iterable[str]) -> list[Term]:
    """Return the words of these names.

    Raises:
        KeyError: A name is none of `WORDS`.
    """
    by_name = {word.name: word for word in WORDS}
    return [by_name[name] for name in names]
