"""Answers to the exercises: right ones, one for each misconception, and random ones. By "lesson/exercise".

`RIGHT` passes; `CASES` fails with the feedback of its case; what is a figure's is written as the figure gives it.
"""

import re

from racecraft.lessons.checking import material
from racecraft.lessons.course import course
from racecraft.worlds.deepracer.lessons import checks, disturbed, sight

TRAINED = checks.facts() | disturbed.facts() | sight.facts()
"""What was recorded for the lessons about cars."""
TOURNAMENT = material("racecraft.worlds.battlesnake.lessons", "tournament.json")["rows"]
PAIRS = [row["low"] > 50 or row["high"] < 50 for row in TOURNAMENT]
"""Whether it is sure who of a pair is better."""
LAP = material("racecraft.worlds.deepracer.lessons", "sight.json")["steps"]
GAPS = [one - other for *_, one, other in LAP]
"""Points between the two likeliest actions at each step of the lap."""
ROW, COLUMN, HEIGHT, WIDTH = (int(one) for one in re.findall(r"\d+", TRAINED["bend_patch"]))
ROAD = {"columns": 7, "pays": "centre", "moves": "ahead", "changed": []}


def drive(*moves, **road):
    return {"drive": {"grid": ROAD | road, "moves": list(moves)}}


REWARD = "def reward_function(p):\n    return {}"


def claim(parameter, way, pay):
    return {"parameter": parameter, "way": way, "code": REWARD.format(pay)}


def long_road(drives):
    return {"drives": drives, "epsilon": "0.3", "gamma": "0.9"}


PAY = "def pay(row, column):\n    return {}"
CLIP = "def clipped(r, a, e):\n    h = min(max(r, 1 - e), 1 + e)\n    return {}"


def patch(*squares, picture=TRAINED["bend"]):
    return {"patch": {"picture": picture, "patch": list(squares)}}


def pairs(*sure):
    return {f"pair{number}": "sure" if one else "open" for number, one in enumerate(sure, 1)}


AWAY = [[1, 1, 1, 1, 1, 1], [0, 2, 1, 1, 1, 1], [2, 0, 1, 1, 1, 1], [0, 2, 1, 1, 1, 0]]
"""The one that goes straight first has 12.0, the others come back to the middle."""

SNAKE_MOVE = """STEPS = {"up": (0, 1), "down": (0, -1), "left": (-1, 0), "right": (1, 0)}
def move(head, body, side):
    for name, (dx, dy) in STEPS.items():
        at = [head[0] + dx, head[1] + dy]
        if CONDITION:
            return name
    return "up"
"""
ON_BOARD = "0 <= at[0] < side and 0 <= at[1] < side"


def snake(letters):
    """Moves by their first letters, as the figure gives them."""
    names = {name[0]: name for name in ("up", "down", "left", "right")}
    return {"moves": [names[letter] for letter in letters]}


def snake_code(condition):
    return {"code": SNAKE_MOVE.replace("CONDITION", condition)}


ROOMY = """STEPS = {"up": (0, 1), "down": (0, -1), "left": (-1, 0), "right": (1, 0)}
def room(start, taken, side):
    seen, todo = {start}, [start]
    while todo:
        x, y = todo.pop()
        for dx, dy in STEPS.values():
            at = (x + dx, y + dy)
            if 0 <= at[0] < side and 0 <= at[1] < side and at not in taken and at not in seen:
                seen.add(at)
                todo.append(at)
    return len(seen)
def move(data):
    board, head = data["board"], data["you"]["head"]
    taken = {(p["x"], p["y"]) for snake in board["snakes"] for p in snake["body"][:-1]}
    def worth(name):
        at = (head["x"] + STEPS[name][0], head["y"] + STEPS[name][1])
        if at in taken or not (0 <= at[0] < board["width"] and 0 <= at[1] < board["height"]):
            return -1
        food = min((abs(f["x"] - at[0]) + abs(f["y"] - at[1]) for f in board["food"]), default=0)
        return 100 * min(room(at, taken, board["width"]), len(data["you"]["body"])) - food
    return max(STEPS, key=worth)
"""
"""Goes where there is room for its body, and of such squares to the one nearest to food."""
THIRTY, EQUAL = "rdluuldrrdlurdllurruururrdrdlu", "rruullddrruulldldrururr"
LONGER = "uuruuldrdldlurruldrdrrrruulu"

STEP = "def step(place, action):\n    place += (0, -1, 1)[action]\n    prize = {7: 0.1, 17: 1.0}.get(place)\n"
ACT = """from math import tanh
def act(values, layers):
    for number, layer in enumerate(layers):
        values = [BIAS + sum(w * v for w, v in zip(row, values)) for row, b in zip(layer["weights"], layer["bias"])]
        values = [BEND for v in values] if number < len(layers) - 1 else values
    return CHOICE
"""


def step_code(result):
    return {"code": f"{STEP}    return {result}"}


def act_code(bias="b", bend="tanh(v)", choice="values.index(max(values))"):
    return {"code": ACT.replace("BIAS", bias).replace("BEND", bend).replace("CHOICE", choice)}


def question_code(result):
    return {"code": f"def question(observation):\n    return {result}"}


IDLE = ("tau", "strength", "time_horizon", "checkpoint_settings", "run_id")
"""Keys of a configuration that do not count here."""


def basic_yaml(**values):
    """The configuration of lesson U4 without the keys that do not count, some values changed; None: without it."""
    exercise = next(one for one in course().find("unity-configuration").exercises if one.id == "without-effect")
    lines = [line for line in exercise.fields[0].code.splitlines() if line.split(":")[0].strip() not in IDLE]
    return {"code": with_values(lines, values)}


def article_yaml(**values):
    exercise = next(one for one in course().find("unity-configuration").exercises if one.id == "the-article")
    numbers = {"batch_size": 100, "buffer_size": 500, "learning_rate": "1e-4", "num_epoch": 20, "gamma": 0.995}
    return {"code": with_values(exercise.fields[0].code.splitlines(), numbers | {"max_steps": 10000} | values)}


def with_values(lines, values):
    kept = []
    for line in lines:
        key, _, value = line.partition(":")
        value = values.get(key.strip(), value.strip())
        if value is not None:
            kept.append(f"{key}: {value}")
    return "\n".join(kept)


RIGHT = {
    "grid/early-drive": drive(1, 0, 1, 0),
    "grid/best-drive": drive(1, 1, 1, 1, 1, 1),
    "grid/last-values": {"last": "2", "before": "3.8"},
    "grid/three-drives": {"last": "1.75", "start": "2,8525"},
    "grid/turn-an-arrow": {"grid": ROAD | {"changed": [[1, 3, 2.1]]}},
    "reward/goal-fails": {"columns": "20", "reason": "never_paid"},
    "reward/first-reward": {"drives": "27"},
    "reward/long-road": long_road("600"),
    "explore/better-epsilon": {"better": "none", "reason": "never_tries"},
    "explore/converged": {"a": "100", "b": "150", "c": "0"},
    "hyperparameters/better-or-luck": {"better": "yes", "seeds": "10", "reason": "open"},
    "explore/schedule": {"first": "1", "last": "0"},
    "discount/the-turn": {"gamma": "0.58"},
    "discount/end-of-lap": {"weight": "0.05"},
    "gradient/drive-four": {"left": "-1.37", "straight": "2.73", "right": "-1.37"},
    "gradient/mean-and-policy": {"mean": "1.033", "pi": "0.52"},
    "gradient/points-away": {"batch": AWAY},
    "gradient/drives-needed": {"drives": "18"},
    "gradient/own-weights": {"code": "def weights(r):\n    m = sum(r) / len(r)\n    return [one - m for one in r]"},
    "car/first-lap": {"iteration": str(TRAINED["first_lap"])},
    "car/left-the-road": {"count": str(TRAINED["left_road"])},
    "reward-function/heads-north": {"x": str(TRAINED["north_x"]), "y": str(TRAINED["north_y"])},
    "reward-function/as-expected": {"before": "first", "own": "faster", "expected": "nearer", "reason": "otherwise"},
    "tracks/new-road": {"car": "faster", "track": "China_track"},
    "tracks/same-road": dict(zip(("one", "other"), TRAINED["same_road"].lower().split(" and "), strict=True)),
    "real/varied-car": {"plain": "first", "varied": "faster"},
    "real/packed-car": {"car": "first", "same": "most", "reason": "same_numbers"},
    "reward-function/slow-lap": {"slow": "531", "fast": "66"},
    "reward-function/second-reward": {"reward": "32"},
    "reward-function/nearer-is-more": {"code": REWARD.format("1 - p['distance_from_center'] / p['track_width']")},
    "hyperparameters/match": {"a": "3e-3", "b": "3e-5", "c": "3e-4"},
    "hyperparameters/clipped": {"code": CLIP.format("min(r * a, h * a)")},
    "sight/patch": patch(ROW - 1, COLUMN - 1, HEIGHT, WIDTH),
    "sight/hottest": {"changes": "all", "reason": "still_enough"},
    "sight/undecided": {"step": TRAINED["undecided_steps"].split(",")[0]},
    "sight/mirrored": {"steers": "right", "reason": "never_driven"},
    "family/dqn-update": {"value": "1.2"},
    "family/target-off": {"happens": "same", "reason": "own_guess"},
    "family/priority": {"largest": "44", "smallest": "7"},
    "family/temperature": {"temperature": "1.73"},
    "family/evolution": {"slope": "6"},
    "family/tried-next": {"prior": "0.38"},
    "real/worst-disturbance": {"worst": "light", "reason": "acts_late"},
    "real/surely-worse": {"count": str(TRAINED["sure"])},
    "tracks/worst-track": {"worst": "bowtie", "reason": "road_alone"},
    "reward/two-numbers": {"code": PAY.format("2.0 if row == 2 else 0.0")},
    "explore/found-again": {"soonest": "zero", "reason": "old_values"},
    "gradient/too-large": {"step": "5", "reason": "certain_too_soon"},
    "hyperparameters/best-step": {"fastest": "1", "stuck": "20"},
    "reward-function/finish": {"code": PAY.format("2.0 if (row, column) == (2, 6) else -0.1 if 0 < row < 4 else -1.0")},
    "race/claim": claim("speed", "more", "p['speed']"),
    "race/sound": {"code": REWARD.format("p['speed'] ** 2")},
    "race/own-lap": {"car": "first"},
    "race/one-change": {"before": "first", "after": "faster", "expected": "undo", "reason": "keep"},
    "race/beat-the-first": {"first": "first", "own": "faster"},
    "snake-board/thirty-turns": snake(THIRTY),
    "snake-board/hunger": snake("rdlu" * 5),
    "snake-board/head-to-head": snake(LONGER),
    "snake-move/beat-random": {"code": ROOMY},
    "snake-move/safe-move": snake_code(f"{ON_BOARD} and at not in body"),
    "snake-rating/points": {"near": "64", "far": "91"},
    "snake-rating/undecided": pairs(*PAIRS),
    "snake-learn/learned-beats": {"snake": "first", "code": ROOMY},
    "snake-collectors/four-runs": {"most": "apart", "reason": "ties"},
    "snake-search/search-in-front": {"snake": "first", "wins": "half", "reason": "replies"},
    "unity-basic/best": {"actions": [2] * 7},
    "unity-basic/fresh-agent": {"earns": "high", "reason": "near_and_long"},
    "unity-learn/own-step": step_code("[place, -0.01 + (prize or 0), prize is not None]"),
    "unity-learn/first-training": {"model": "right"},
    "unity-learn/which-first": {"first": "large", "reason": "met_first"},
    "unity-back/own-forward": act_code(),
    "unity-back/same-decisions": {"model": "right", "differ": "few", "reason": "same"},
    "unity-back/own-question": question_code("{'instances': [observation]}"),
    "unity-other/dqn": {"model": "by dqn"},
    "unity-other/fewest-steps": {"fewest": "dqn", "reason": "overlap"},
    "unity-other/count-weights": {"count": "195"},
    "unity-penalty/the-turn": {"gamma": "0.58"},
    "unity-configuration/without-effect": basic_yaml(),
    "unity-configuration/the-article": article_yaml(),
    "unity-configuration/half-way": {"epsilon": "0.15"},
    "unity-penalty/dearest-step": {"cost": "0.223"},
    "unity-penalty/without-penalty": {"strolls": "same", "reason": "discount"},
}
CASES = {
    "snake-rating/points": {
        "near_low": {"near": "55", "far": "91"},
        "near_high": {"near": "90", "far": "91"},
        "far_low": {"near": "64", "far": "80"},
        "far_high": {"near": "64", "far": "100"},
    },
    "snake-rating/undecided": {"not_sure": pairs(*[True] * 6), "sure": pairs(*[False] * 6)},
    "snake-learn/learned-beats": {
        "fails": {"snake": "lost", "code": ROOMY},
        "few": {"snake": "as fast", "code": ROOMY},
        "weaker": {"snake": "faster", "code": ROOMY},
    },
    "snake-collectors/four-runs": {
        "run": {"most": "hand"},
        "order": {"most": "apart", "reason": "order"},
        "cores": {"most": "all", "reason": "cores"},
    },
    "snake-search/search-in-front": {
        "run": {"snake": "first", "wins": "more"},
        "learns": {"snake": "first", "wins": "most", "reason": "learns"},
        "faster": {"snake": "first", "wins": "most", "reason": "faster"},
    },
    "reward/long-road": {
        "not_longer": long_road("300") | {"epsilon": "0.9"},
        "few": long_road("400"),
        "more_than_needed": long_road("900"),
    },
    "explore/converged": {
        "too_early": {"a": "10", "b": "150", "c": "0"},
        "too_late": {"a": "350", "b": "150", "c": "0"},
        "flat_below": {"a": "0", "b": "150", "c": "0"},
        "still_climbs": {"a": "100", "b": "150", "c": "350"},
    },
    "hyperparameters/better-or-luck": {
        "run": {"better": "yes"},
        "few_seeds": {"better": "yes", "seeds": "4", "reason": "open"},
        "shown": {"better": "yes", "seeds": "10", "reason": "shown"},
        "same": {"better": "luck", "seeds": "10", "reason": "same"},
    },
    "real/worst-disturbance": {
        "run": {"worst": "latency"},
        "too_dark": {"worst": "light", "reason": "too_dark"},
        "all_alike": {"worst": "light", "reason": "all_alike"},
    },
    "real/surely-worse": {"fewer_laps": {"count": str(TRAINED["fewer"])}, "other": {"count": "30"}},
    "family/dqn-update": {
        "local_network": {"value": "1.65"},
        "no_discount": {"value": "1.25"},
        "whole_step": {"value": "1.4"},
        "other": {"value": "3"},
    },
    "family/target-off": {
        "run": {"happens": "slower"},
        "memory": {"happens": "nothing", "reason": "memory"},
        "exploring": {"happens": "nothing", "reason": "exploring"},
    },
    "family/priority": {
        "no_exponent": {"largest": "55.6", "smallest": "2.8"},
        "all_alike": {"largest": "25", "smallest": "25"},
        "other": {"largest": "90", "smallest": "1"},
    },
    "family/temperature": {"too_even": {"temperature": "5"}, "too_sure": {"temperature": "0.2"}},
    "family/evolution": {
        "difference": {"slope": "3"},
        "no_width": {"slope": "1.5"},
        "turned_round": {"slope": "-6"},
        "other": {"slope": "10"},
    },
    "family/tried-next": {"still_first": {"prior": "0.35"}, "more_than_needed": {"prior": "0.6"}},
    "unity-basic/best": {
        "not_ended": {"actions": [2, 2]},
        "near_prize": {"actions": [1, 1, 1]},
        "detour": {"actions": [0, *[2] * 7]},
    },
    "unity-learn/own-step": {
        "no_list": step_code("place"),
        "moves": step_code("[place + 1, -0.01, False]"),
        "penalty": step_code("[place, prize or -0.01, prize is not None]"),
        "pays": step_code("[place, float('nan'), prize is not None]"),
        "ends": step_code("[place, -0.01 + (prize or 0), prize == 1.0]"),
    },
    "unity-learn/first-training": {"near_prize": {"model": "left"}, "not_yet": {"model": "idle"}},
    "unity-learn/which-first": {
        "run": {"first": "large"},
        "cheaper": {"first": "near", "reason": "cheaper"},
        "order": {"first": "near", "reason": "order"},
    },
    "unity-back/own-forward": {
        "no_action": act_code(choice="values"),
        "sums_alone": act_code("0", "v"),
        "no_bias": act_code("0"),
        "no_tanh": act_code(bend="v"),
        "other": act_code(choice="0.0"),
    },
    "unity-back/same-decisions": {
        "run": {"model": "right", "differ": "none"},
        "rounding": {"model": "right", "differ": "few", "reason": "rounding"},
        "learning": {"model": "right", "differ": "many", "reason": "learning"},
    },
    "unity-back/own-question": {
        "refused": question_code("{'observation': 10}"),
        "changed": question_code("{'instances': [[0.0] * 20]}"),
        "many": question_code("{'instances': [observation, observation]}"),
    },
    "unity-other/dqn": {"same": {"model": "right"}, "not_yet": {"model": "idle dqn"}},
    "unity-other/fewest-steps": {
        "run": {"fewest": "small"},
        "apart": {"fewest": "small", "reason": "apart"},
        "one_seed": {"fewest": "small", "reason": "one_seed"},
    },
    "unity-other/count-weights": {
        "no_bias": {"count": "184"},
        "units": {"count": "31"},
        "product": {"count": "480"},
        "other": {"count": "5000"},
    },
    "unity-configuration/without-effect": {
        "unreadable": basic_yaml(hidden_units="many"),
        "idle": {"code": basic_yaml()["code"] + "\ncheckpoint_settings: {run_id: first}"},
        "silent": basic_yaml(beta_schedule=None),
        "changed": basic_yaml(num_layers=3),
    },
    "unity-configuration/the-article": {
        "unreadable": article_yaml(gamma="high"),
        "exchanged": article_yaml(batch_size=500, buffer_size=100),
        "differs": article_yaml(gamma=0.99),
    },
    "unity-configuration/half-way": {
        "to_zero": {"epsilon": "0.1"},
        "not_fallen": {"epsilon": "0.2"},
        "other": {"epsilon": "0.5"},
    },
    "unity-penalty/the-turn": {"still_left": {"gamma": "0.3"}, "already_right": {"gamma": "0.9"}},
    "unity-penalty/dearest-step": {
        "all_steps": {"cost": "0.129"},
        "still_right": {"cost": "0.05"},
        "already_left": {"cost": "0.4"},
    },
    "unity-penalty/without-penalty": {
        "run": {"strolls": "better"},
        "nothing": {"strolls": "same", "reason": "nothing"},
        "prize": {"strolls": "same", "reason": "prize"},
    },
    "unity-basic/fresh-agent": {
        "run": {"earns": "low"},
        "half": {"earns": "low", "reason": "half"},
        "never": {"earns": "middle", "reason": "never"},
    },
    "snake-board/thirty-turns": {
        "goes_on": snake("rd"),
        "wall": snake("dd"),
        "itself": snake("ud"),
        "body": snake("uurrdrru"),
        "head": snake("rrurur"),
        "hunger": snake("rdlu" * 5),
    },
    "snake-board/hunger": {"goes_on": snake("rdlu"), "other_end": snake("dd")},
    "snake-board/head-to-head": {
        "not_met": snake("r"),
        "shorter": snake("rrurur"),
        "both": snake(EQUAL),
        "other_end": snake("dd"),
    },
    "snake-move/beat-random": {
        "fails": {"code": "def move(data):\n    return None"},
        "at_once": {"code": "def move(data):\n    return 'up'"},
        "few": {"code": ROOMY.replace("key=worth", "key=lambda name: -worth(name) if worth(name) >= 0 else -1e9")},
    },
    "snake-move/safe-move": {
        "no_move": {"code": "def move(head, body, side):\n    return None"},
        "wall": snake_code("at not in body"),
        "neck": snake_code("at == body[1]"),
        "body": snake_code(f"{ON_BOARD} and at != body[1]"),
    },
    "sight/patch": {
        "other_picture": patch(2, 1, 1, 3, picture=TRAINED["spot"]),
        "same": patch(0, 4, 2, 2),
        "too_large": patch(0, 0, 6, 8),
    },
    "sight/hottest": {
        "run": {"changes": "few"},
        "wrong_map": {"changes": "few", "reason": "wrong_map"},
        "no_picture": {"changes": "few", "reason": "no_picture"},
    },
    "sight/undecided": {
        "close": {"step": str(1 + next(at for at, gap in enumerate(GAPS) if 1 <= gap < 5))},
        "sure": {"step": str(1 + GAPS.index(max(GAPS)))},
    },
    "sight/mirrored": {
        "run": {"steers": "left"},
        "no_sides": {"steers": "left", "reason": "no_sides"},
        "same_picture": {"steers": "left", "reason": "same_picture"},
    },
    "reward/two-numbers": {
        "no_number": {"code": PAY.format("None")},
        "many": {"code": PAY.format("row + column")},
        "few": {"code": PAY.format("2.0 if (row, column) == (2, 24) else 0.0")},
    },
    "explore/found-again": {
        "run": {"soonest": "large"},
        "forgets": {"soonest": "large", "reason": "forgets"},
        "convergence": {"soonest": "large", "reason": "convergence"},
    },
    "gradient/too-large": {
        "run": {"step": "5"},
        "jumps": {"step": "5", "reason": "jumps"},
        "slow": {"step": "5", "reason": "slow"},
    },
    "hyperparameters/best-step": {
        "never": {"fastest": "20", "stuck": "20"},
        "slower": {"fastest": "0.3", "stuck": "20"},
        "still_climbing": {"fastest": "1", "stuck": "0.03"},
    },
    "reward-function/finish": {
        "no_number": {"code": PAY.format("None")},
        "for_ever": {"code": PAY.format("2.0 if row == 2 else 0.1 if 0 < row < 4 else 0.0")},
        "elsewhere": {"code": PAY.format("5.0 if row == 0 else -1.0")},
    },
    "race/claim": {
        "no_number": claim("speed", "more", "None"),
        "no_effect": claim("speed", "more", "1.0"),
        "turned_round": claim("speed", "less", "p['speed']"),
        "sometimes": claim("speed", "more", "1.0 * (p['speed'] > 2)"),
    },
    "race/sound": {"fault": {"code": REWARD.format("1.0")}},
    "race/own-lap": {"no_lap": {"car": "lost"}},
    "race/one-change": {
        "run": {"before": "first", "after": "faster", "expected": "keep"},
        "keep": {"before": "first", "after": "lost", "expected": "keep", "reason": "keep"},
        "undo": {"before": "first", "after": "as fast", "expected": "keep", "reason": "undo"},
        "open": {"before": "first", "after": "faster", "expected": "keep", "reason": "open"},
    },
    "race/beat-the-first": {
        "slower": {"first": "faster", "own": "first"},
        "no_lap": {"first": "first", "own": "lost"},
        "as_fast": {"first": "first", "own": "as fast"},
    },
    "car/first-lap": {"before": {"iteration": "3"}, "behind": {"iteration": "19"}},
    "car/left-the-road": {"laps": {"count": str(TRAINED["whole_laps"])}, "other": {"count": "30"}},
    "reward-function/heads-north": {
        "off_centre": {"x": "4", "y": "2.5"},
        "opposite": {"x": "0.9", "y": "2.8"},
        "other_heading": {"x": "4", "y": "0.7"},
    },
    "reward-function/as-expected": {
        "run": {"before": "first", "own": "faster", "expected": "faster"},
        "as_expected": {"before": "first", "own": "lost", "expected": "faster", "reason": "as_expected"},
        "otherwise": {"before": "first", "own": "faster", "expected": "calmer", "reason": "otherwise"},
        "same": {"before": "first", "own": "faster", "expected": "calmer", "reason": "same"},
    },
    "tracks/new-road": {
        "trained_here": {"car": "faster", "track": "Oval_track"},
        "few_tracks": {"car": "first", "track": "China_track"},
        "few": {"car": "lost", "track": "China_track"},
    },
    "tracks/same-road": {
        "twice": {"one": "a", "other": "a"},
        "lengths": {"one": "b", "other": "c"},
        "shapes": {"one": "c", "other": "f"},
    },
    "real/varied-car": {
        "both_lap": {"plain": "as fast", "varied": "first"},
        "fewer": {"plain": "first", "varied": "lost"},
    },
    "real/packed-car": {
        "run": {"car": "first", "same": "all"},
        "compressed": {"car": "first", "same": "most", "reason": "compressed"},
        "learns_on": {"car": "first", "same": "most", "reason": "learns_on"},
    },
    "reward-function/slow-lap": {
        "exchanged": {"slow": "66", "fast": "531"},
        "same": {"slow": "100", "fast": "100"},
        "seconds": {"slow": "35.4", "fast": "4.4"},
        "other": {"slow": "900", "fast": "1"},
    },
    "reward-function/second-reward": {
        "kept_the_one": {"reward": "0.64"},
        "one_factor": {"reward": "40"},
        "no_factor": {"reward": "50"},
        "other": {"reward": "7"},
    },
    "reward-function/nearer-is-more": {
        "no_number": {"code": REWARD.format("None")},
        "same": {"code": REWARD.format("1.0")},
        "turned_round": {"code": REWARD.format("p['distance_from_center']")},
    },
    "hyperparameters/match": {
        "flat": {"a": "3e-5", "b": "3e-4", "c": "3e-3"},
        "exchanged": {"a": "3e-4", "b": "3e-5", "c": "3e-3"},
        "twice": {"a": "3e-4", "b": "3e-5", "c": "3e-4"},
    },
    "hyperparameters/clipped": {
        "never_clipped": {"code": CLIP.format("r * a")},
        "always_clipped": {"code": CLIP.format("h * a")},
        "other": {"code": CLIP.format("0")},
    },
    "tracks/worst-track": {
        "run": {"worst": "oval"},
        "harder": {"worst": "oval", "reason": "harder"},
        "too_short": {"worst": "oval", "reason": "too_short"},
    },
    "reward/goal-fails": {
        "run": {"columns": "20"},
        "prize": {"columns": "20", "reason": "prize"},
        "more_drives": {"columns": "20", "reason": "more_drives"},
    },
    "reward/first-reward": {
        "columns_not_moves": {"drives": "33.4"},
        "too_few": {"drives": "4"},
        "too_many": {"drives": "300"},
    },
    "explore/better-epsilon": {
        "run": {"better": "none"},
        "bad_driving": {"better": "none", "reason": "bad_driving"},
        "luck": {"better": "some", "reason": "luck"},
    },
    "explore/schedule": {
        "still_exploring": {"first": "1", "last": "0.5"},
        "never_explored": {"first": "0", "last": "0"},
    },
    "discount/the-turn": {"still_left": {"gamma": "0.3"}, "already_right": {"gamma": "0.9"}},
    "discount/end-of-lap": {
        "seconds_not_steps": {"weight": "0.82"},
        "too_small": {"weight": "0"},
        "too_large": {"weight": "0.5"},
    },
    "gradient/drive-four": {
        "sign": {"left": "1.3667", "straight": "2.7333", "right": "1.3667"},
        "only_own": {"left": "0", "straight": "4.1", "right": "0"},
        "no_total": {"left": "-0.333", "straight": "0.667", "right": "-0.333"},
        "other": {"left": "1", "straight": "1", "right": "1"},
    },
    "gradient/mean-and-policy": {
        "sum_not_mean": {"mean": "4.133", "pi": "0.5205"},
        "mean_wrong": {"mean": "0", "pi": "0.5205"},
        "added_to_pi": {"mean": "1.0333", "pi": "0.85"},
        "pi_wrong": {"mean": "1.0333", "pi": "0.1"},
    },
    "gradient/points-away": {
        "points_right": {"batch": [[1, 0, 1, 0], [0, 0], [2, 2], [1, 1, 0, 0]]},
        "no_good_straight": {"batch": [[1, 0, 0], [0, 2, 1, 1, 1, 1], [0, 0], [2, 0, 1, 1, 1, 1]]},
    },
    "gradient/drives-needed": {"too_few": {"drives": "4"}, "more_than_needed": {"drives": "50"}},
    "gradient/own-weights": {
        "no_list": {"code": "def weights(returns):\n    return 3"},
        "unchanged": {"code": "def weights(returns):\n    return returns"},
        "sum_not_zero": {"code": "def weights(returns):\n    return [one - 1 for one in returns]"},
        "other_scale": {"code": "def weights(r):\n    m = sum(r) / len(r)\n    return [2 * (one - m) for one in r]"},
    },
    "grid/early-drive": {
        "not_ended": drive(1),
        "begins_aside": drive(0, 2, 0, 0),
        "too_much": drive(1, 1, 0, 0),
        "too_little": drive(0, 0),
        "other_grid": drive(1, 0, 1, 0, changed=[[2, 1, 3.0]]),
    },
    "grid/best-drive": {
        "left_road": drive(1, 0, 1, 0),
        "stayed": drive(1, 1, 1, 1, 1, 0),
        "not_ended": drive(1, 1),
        "other_grid": drive(1, 1, 1, 1, 1, 1, changed=[[2, 1, 3.0]]),
    },
    "grid/last-values": {
        "only_reward": {"last": "2", "before": "2"},
        "no_discount": {"last": "2", "before": "4"},
        "last_wrong": {"last": "3", "before": "3.8"},
        "before_wrong": {"last": "2", "before": "9"},
    },
    "grid/three-drives": {
        "whole_step": {"last": "2", "start": "2.8525"},
        "last_wrong": {"last": "0.5", "start": "2.8525"},
        "same_everywhere": {"last": "1.75", "start": "1.75"},
        "start_wrong": {"last": "1.75", "start": "9"},
    },
    "grid/turn-an-arrow": {
        "nothing_changed": {"grid": ROAD},
        "more_than_needed": {"grid": ROAD | {"changed": [[1, 3, 2.5]]}},
        "several": {"grid": ROAD | {"changed": [[1, 3, 9], [1, 4, 9]]}},
        "still_straight": {"grid": ROAD | {"changed": [[1, 3, 0.4]]}},
    },
}


def random_take(exercise, name, rng):
    """Return what a figure gives after somebody played with it at random."""
    road = dict(ROAD)
    if name == "grid":
        road["changed"] = [
            [rng.randrange(1, 4), rng.randrange(6), round(rng.uniform(-4, 4), 1)] for _ in range(rng.randint(0, 3))
        ]
        return road
    if name == "moves":
        return [rng.choice(("up", "down", "left", "right")) for _ in range(40)]
    if name == "actions":
        return [rng.randrange(3) for _ in range(40)]
    if name == "patch":
        top, left = rng.randrange(6), rng.randrange(8)
        return patch(top, left, rng.randint(1, 6 - top), rng.randint(1, 8 - left))["patch"]
    if name == "batch":
        return [ended_drive(rng) for _ in range(4)]
    return {"grid": road, "moves": [rng.randrange(3) for _ in range(6)]}


def ended_drive(rng):
    """Return moves of a random car until it ends."""
    moves, row = [], 2
    while row in (1, 2, 3) and len(moves) < 6:
        moves.append(rng.randrange(3))
        row += moves[-1] - 1
    return moves
