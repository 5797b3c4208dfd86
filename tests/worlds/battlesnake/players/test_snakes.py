"""Snake players: what they see, what they choose, what the official JSON says and refuses."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from racecraft.players.thread_pool import ThreadPool
from racecraft.worlds.battlesnake.env.board import MOVES, Board, Snake
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.appearance import colour
from racecraft.worlds.battlesnake.players.area_control import Lookout
from racecraft.worlds.battlesnake.players.find import PLAYERS, find_player
from racecraft.worlds.battlesnake.players.from_file import FilePlayer, load_file_player
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.messages import GameCard, MessageError, message, read_message
from racecraft.worlds.battlesnake.players.protocol import PlayerError, SnakePlayer
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move, safe_moves
from racecraft.worlds.battlesnake.players.search import Search

SMALL = GameSettings(7, 7, 2)


def board_of(*bodies, food=(), health=100, size=7):
    snakes = [Snake(f"s{number}", list(body), health) for number, body in enumerate(bodies)]
    return Board(size, size, 5, snakes, list(food))


def ready(name):
    player = find_player(name, seed=1)
    if isinstance(player, Search):
        player.most_walks = 200
    return player


def test_safe_moves_by_hand():
    corner = board_of([(0, 0), (0, 1), (0, 2)], [(1, 0), (2, 0), (3, 0)])
    assert safe_moves(corner, SMALL, "s0") == []
    ring = board_of([(2, 2), (2, 3), (3, 3), (3, 2)], [(6, 6)] * 3)
    assert "right" in safe_moves(ring, SMALL, "s0"), "the tail moves on"
    ring.snakes[0].body.append((3, 2))
    assert "right" not in safe_moves(ring, SMALL, "s0"), "a doubled tail stays"
    edge = board_of([(0, 3), (1, 3), (2, 3)])
    assert safe_moves(edge, SMALL, "s0") == ["up", "down"]
    assert safe_moves(edge, GameSettings(7, 7, 1, "wrapped"), "s0") == ["up", "down", "left"]


def test_a_starving_snake_sees_only_food_as_safe():
    board = board_of([(3, 3), (3, 2), (3, 1)], food=[(4, 3)], health=1)
    assert safe_moves(board, SMALL, "s0") == ["right"]


@pytest.mark.parametrize("name", PLAYERS)
def test_every_player_moves_safely_where_it_can(name):
    player = ready(name)
    assert isinstance(player, SnakePlayer)
    for key in range(3):
        referee = Referee(GameSettings(7, 7, 3), StreamDice(key))
        while not referee.over and referee.board.turn < 25:
            moves = {}
            before = referee.board.copy()
            for snake in referee.board.alive():
                moves[snake.id] = player.choose(referee.board, referee.settings, snake.id, 0.02)
                safe = safe_moves(referee.board, referee.settings, snake.id)
                assert moves[snake.id] in (safe or MOVES)
            assert referee.board == before, "a player changes nothing on the board"
            referee.turn(moves)


@pytest.mark.parametrize("name", PLAYERS)
@pytest.mark.parametrize("ruleset", ["solo", "royale", "constrictor", "wrapped", "wrapped_constrictor"])
def test_every_player_plays_every_ruleset(name, ruleset):
    settings = GameSettings(7, 9, 1 if ruleset == "solo" else 2, ruleset)
    referee, player = Referee(settings, StreamDice(1)), ready(name)
    for _ in range(6):
        referee.turn({s.id: player.choose(referee.board, settings, s.id, 0.01) for s in referee.board.alive()})


def test_hungry_goes_for_food_and_flood_fill_for_room():
    board = board_of([(3, 3), (3, 2), (3, 1)], food=[(6, 3)])
    assert find_player("hungry").choose(board, SMALL, "s0", 0.1) == "right"
    # Up leads into a pocket of one square with food; left into the open.
    wall = [(1, 6), (1, 5), (1, 4), (0, 4)]
    body = [(0, 5), *wall[::-1][:1], (0, 3), (0, 2), (1, 2)]
    pocket = board_of(body, wall[:3] + [(2, 4)], food=[(0, 6)])
    assert find_player("hungry").choose(pocket, SMALL, "s0", 0.1) == "up"


@pytest.mark.parametrize("name", ["flood_fill", "area_control", "search"])
def test_better_players_do_not_enter_a_pocket(name):
    # The own body closes off two squares on the left; the rest of the board lies on the right.
    body = [(2, 0), (2, 1), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2), (3, 2), (3, 3)]
    board = board_of(body, [(6, 6), (6, 5), (6, 4)], food=[(1, 0)])
    assert ready("hungry").choose(board, SMALL, "s0", 0.1) == "left"
    assert ready(name).choose(board, SMALL, "s0", 0.1) == "right"


@pytest.mark.parametrize("name", ["area_control", "search"])
def test_better_players_take_the_win(name):
    # Both heads look at (3, 3); s0 is longer and the other has no way but there.
    board = board_of(
        [(2, 3), (1, 3), (0, 3), (0, 2), (0, 1), (0, 0)],
        [(4, 3), (5, 3), (5, 4), (4, 4), (4, 5)],
        [(4, 2), (5, 2), (5, 1), (4, 1), (4, 1)],
    )
    settings = GameSettings(7, 7, 3)
    assert safe_moves(board, settings, "s1") == ["left"]
    assert ready(name).choose(board, settings, "s0", 0.2) == "right"


def test_appraisal_by_law():
    board = board_of([(1, 1), (1, 0), (0, 0)], [(5, 5), (5, 6), (6, 6)])
    worths = Lookout(board, SMALL).values_after(("up", "down"))
    assert worths[0] == pytest.approx(worths[1]), "a symmetric position is worth the same to both"
    assert Lookout(board, SMALL).values_after(("down", "down"))[0] == 0, "the dead are worth nothing"
    assert Lookout(board, SMALL).values_after(("down", "down"))[1] == 1, "the last one has won"


def test_search_grows_one_visit_a_walk_and_repeats_itself():
    board = Referee(GameSettings(11, 11, 4), StreamDice(1)).board
    settings = GameSettings(11, 11, 4)
    tree = Tree(board, settings, "s0")
    tree.simulate(300)
    assert tree.visits().sum() == 300
    again = Tree(board, settings, "s0")
    again.simulate(100)
    again.simulate(200)
    assert tree.visits().tolist() == again.visits().tolist()


def test_players_are_found_by_name_or_refused():
    with pytest.raises(PlayerError, match="flood_fill"):
        find_player("flod_fill")
    with pytest.raises(PlayerError, match="nothing.py"):
        find_player("nothing.py")
    assert isinstance(find_player("search+hungry"), Search)


def test_the_best_safe_move_always_answers():
    assert best_safe_move(Board(3, 3), SMALL, "nobody") == "up"
    assert best_safe_move(board_of([(0, 0), (0, 1), (1, 1), (1, 0)]), SMALL, "s0") in MOVES


# The official JSON


def letter():
    referee = Referee(GameSettings(7, 7, 2, "royale", map="standard", hazard_damage=9), StreamDice(2))
    referee.board.hazards[(0, 0)] = 2
    return referee, message(referee.board, referee.settings, "s1", GameCard("g", 300, {"s1": "Sam"}))


def test_a_message_reads_back_as_the_board_it_told():
    referee, sent = letter()
    read = read_message(json.loads(json.dumps(sent)))
    assert (read.board, read.settings) == (referee.board, referee.settings)
    assert (read.game_id, read.you, read.timeout_ms) == ("g", "s1", 300)
    assert (sent["you"]["name"], sent["you"]["latency"], sent["you"]["length"]) == ("Sam", "0", 3)


BAD_MESSAGES = [
    (lambda m: [], "the message is a list"),
    (lambda m: m.pop("game"), "game is missing"),
    (lambda m: m.update(board=3), "board is a whole number"),
    (lambda m: m["board"].update(width=10**6), "width"),
    (lambda m: m["board"].update(width="7"), "width"),
    (lambda m: m["game"]["ruleset"].update(name=7), "name"),
    (lambda m: m["board"]["snakes"][0].update(body=[]), "body"),
    (lambda m: m["board"]["snakes"][0].update(body=[{"x": 1}]), "y is missing"),
    (lambda m: m["board"]["snakes"][0].update(body=[{"x": 99, "y": 1}]), "99"),
    (lambda m: m["board"]["snakes"][0].update(health=900), "health"),
    (lambda m: m["board"]["snakes"][0].update(id="s1"), "same id"),
    (lambda m: m["board"].update(snakes=[m["you"]] * 40), "players|same id"),
    (lambda m: m["board"].update(food=[{"x": 1.5, "y": 2}]), "food"),
    (lambda m: m["board"].update(hazards=[None]), "hazards"),
    (lambda m: m["game"].update(timeout=1e99), "timeout"),
]


@pytest.mark.parametrize(("spoil", "words"), BAD_MESSAGES)
def test_bad_messages_are_refused_by_name(spoil, words):
    from racecraft.worlds.battlesnake.env.board import BoardError

    _, sent = letter()
    spoilt = spoil(sent)
    with pytest.raises(BoardError, match=words):
        read_message(spoilt if spoilt == [] else sent)
    assert issubclass(MessageError, BoardError)


def test_an_engine_may_know_rules_that_we_do_not():
    _, sent = letter()
    sent["game"]["ruleset"]["name"], sent["game"]["map"] = "wrapped_deluxe", "atlantis"
    sent["game"]["ruleset"]["settings"] |= {"foodSpawnChance": 900, "minimumFood": -4, "hazardDamagePerTurn": 500}
    read = read_message(sent).settings
    assert (read.ruleset, read.map) == ("wrapped", "standard")
    assert (read.food_spawn_chance, read.minimum_food, read.hazard_damage) == (100, 0, 100)
    sent["game"]["ruleset"]["name"] = "squad"
    assert read_message(sent).settings.ruleset == "standard"


# A user's own file


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def move(data:\n", "bad.py:1: .*def move"),
        ("x = 1\n", "no move"),
        ("\n1 / 0\n", "bad.py:2: loading it raised ZeroDivisionError"),
        ("raise SystemExit\n", "SystemExit"),
    ],
)
def test_files_that_cannot_play_are_refused_by_name(tmp_path, source, words):
    path = tmp_path / "bad.py"
    path.write_text(source)
    with pytest.raises(PlayerError, match=words):
        load_file_player(path)


def test_a_file_plays_and_its_failures_are_named(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "turns = []\n"
        "def info():\n    return {'color': '#123456', 'apiversion': '1'}\n"
        "def start(data):\n    turns.clear()\n"
        "def move(data):\n"
        "    turns.append(data['turn'])\n"
        "    return {0: {'move': 'left'}, 1: 'up', 2: 'north', 3: None, 4: data['nothing']}[len(turns) - 1]\n"
    )
    path.write_text(path.read_text().replace("data['nothing']", "'down' if len(turns) < 5 else data['nothing']"))
    player = load_file_player(path)
    _, sent = letter()
    assert player.appearance()["color"] == "#123456"
    player.start(sent, 1)
    assert (player.move(sent, 1), player.move(sent, 1)) == ("left", "up")
    with pytest.raises(PlayerError, match="north"):
        player.move(sent, 1)
    with pytest.raises(PlayerError, match="None"):
        player.move(sent, 1)
    with pytest.raises(PlayerError, match=r"mine.py:8: move\(\) raised KeyError"):
        player.move(sent, 1)
    player.end(sent, 1)
    player.close()


@pytest.fixture
def mine(tmp_path):
    """Make a player of a source; its process ends with the test."""
    made = []

    def make(source):
        (tmp_path / "mine.py").write_text(source)
        made.append(load_file_player(tmp_path / "mine.py"))
        return made[-1]

    yield make
    for player in made:
        player.close()


def test_a_file_that_hangs_is_ended_and_begun_anew(mine):
    player = mine("import os, time\ndef move(data):\n    while data['turn'] == 0: pass\n    return 'left'\n")
    _, sent = letter()
    first = player._worker
    with pytest.raises(TimeoutError):
        player.move(sent, 0.1)
    begin = time.monotonic()
    with pytest.raises(TimeoutError):
        player.move(sent | {"turn": 1}, 0.05)
    assert time.monotonic() - begin < 10, "nobody waits longer than asked"
    assert player.move(sent | {"turn": 1}, 60) == "left"
    assert player._worker is not first
    assert first._process.poll() is not None, "the hanging process is gone"


def test_a_file_that_answers_late_is_not_ended_and_its_late_word_is_not_taken_for_another(mine):
    player = mine(
        "import time\n"
        "def move(data):\n"
        "    time.sleep(0.2 if data['turn'] == 0 else 0)\n"
        "    return 'down' if data['turn'] == 0 else 'left'\n"
    )
    _, sent = letter()
    worker = player._worker
    with pytest.raises(TimeoutError):
        player.move(sent, 0.05)
    assert player.move(sent | {"turn": 1}, 60) == "left"
    assert player._worker is worker


@pytest.mark.parametrize("how", ["os._exit(3)", "os.write(1, b'x'); os.close(0); os.abort()"])
def test_a_file_whose_process_dies_is_begun_anew(mine, how):
    player = mine(
        f"import os\ndef move(data):\n    if data['turn'] == 0: {how}\n    print('not an answer')\n    return 'left'\n"
    )
    _, sent = letter()
    with pytest.raises(PlayerError, match=r"mine.py: its process ended \(exit code -?\d+\)"):
        player.move(sent, 5)
    assert player.move(sent | {"turn": 1}, 60) == "left"


def test_a_file_that_never_loads_is_refused(mine, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.battlesnake.players.from_file.LOAD_SECONDS", 0.3)
    with pytest.raises(PlayerError, match="still loading"):
        mine("while True: pass\n")


def test_the_process_of_a_file_ends_with_its_owner(tmp_path):
    """Also when the owner is killed, and the file is in the middle of an endless loop."""
    (tmp_path / "mine.py").write_text("import os\nprint(os.getpid())\ndef move(data):\n    while True: pass\n")
    code = (
        "import os\n"
        "from racecraft.worlds.battlesnake.players.from_file import load_file_player\n"
        "player = load_file_player('mine.py')\n"
        "try: player.move({}, 0.1)\n"
        "except TimeoutError: os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    worker = int(done.stderr.split()[0])
    until = time.monotonic() + 60
    while Path(f"/proc/{worker}").exists() and time.monotonic() < until:
        time.sleep(0.02)
    assert not Path(f"/proc/{worker}").exists()


def test_a_crew_goes_on_when_a_task_hangs():
    import threading

    crew, gate = ThreadPool(1), threading.Event()
    stuck = crew.submit(gate.wait)
    behind = crew.submit(lambda: 7)
    with pytest.raises(TimeoutError):
        behind.result(0.05)
    crew.leave_behind(stuck)
    assert behind.result(5) == 7
    assert crew.left_behind == 1
    gate.set()
    assert stuck.result(60) is True
    crew.close()


def test_search_goes_on_top_of_a_user_s_file_too(tmp_path):
    """Its move is looked at first; one too slow to be heard does no harm, one that raises is named."""
    board = Board(11, 11, snakes=[Snake("a", [(5, 5), (5, 4), (5, 3)]), Snake("b", [(1, 1)] * 3)], food=[(9, 9)])
    settings = GameSettings(11, 11, 2)
    for name, body in (
        ("left", "assert data['you']['id'] == 'a'; return 'left'"),
        ("slow", "import time; time.sleep(1); return 'left'"),
        ("raises", "return data['nothing']"),
    ):
        (tmp_path / f"{name}.py").write_text(f"def move(data):\n    {body}\n")
    heeded = find_player(f"search+{tmp_path}/left.py")
    heeded.most_walks = 1
    assert heeded.choose(board, settings, "a", 20.0) == "left"
    assert find_player(f"search+{tmp_path}/slow.py").choose(board, settings, "a", 0.2) in ("left", "right", "up")
    with pytest.raises(PlayerError, match="raises.py"):
        find_player(f"search+{tmp_path}/raises.py").choose(board, settings, "a", 20.0)


def asked(player):
    try:
        return player.move({}, 20.0)
    except PlayerError as letter:
        return str(letter)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux holds a process to its data")
def test_a_file_that_wants_too_much_memory_gets_a_letter_and_is_begun_anew(tmp_path):
    """Each move keeps 50 MB: of 256 MB two go well at least, five never do."""
    path = tmp_path / "greedy.py"
    path.write_text("KEPT = []\ndef move(data):\n    KEPT.append(bytearray(50 << 20))\n    return 'up'\n")
    player = FilePlayer(path, memory_mb=256)
    try:
        for _ in range(2):
            answers = [asked(player) for _ in range(5)]
            letter = next(answer for answer in answers if answer != "up")
            assert "greedy.py:3: move() wanted more memory than the 256 MB" in letter
            assert "--file-memory" in letter
            assert answers[:2] == ["up", "up"]
            assert asked(player) == "up", "begun anew"
            player.close()
            player = FilePlayer(path, memory_mb=256)
    finally:
        player.close()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux holds a process to its data")
def test_a_file_that_wants_too_much_memory_to_load_is_refused(tmp_path):
    path = tmp_path / "heavy.py"
    path.write_text("BIG = bytearray(300 << 20)\ndef move(data):\n    return 'up'\n")
    with pytest.raises(PlayerError, match=r"heavy\.py:1: loading it wanted more memory than the 128 MB"):
        FilePlayer(path, memory_mb=128)
    player = FilePlayer(path, memory_mb=1024)
    assert player.move({}, 20.0) == "up"
    player.close()
    with pytest.raises(PlayerError, match="at least 64"):
        FilePlayer(path, memory_mb=1)


@pytest.mark.parametrize(("text", "hexed"), [("Red", "#ff0000"), ("#0aF", "#00aaff"), ("#A0B1c2", "#a0b1c2")])
def test_colours_are_told_as_the_official_board_reads_them(text, hexed):
    assert colour(text) == hexed


@pytest.mark.parametrize("text", ["", "redd", "#gggggg"])
def test_what_is_no_colour_is_refused_with_an_example(text):
    with pytest.raises(PlayerError, match=r"#ff8800"):
        colour(text)
