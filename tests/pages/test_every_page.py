"""Every page that racecraft writes or serves is read by everybody: axe finds nothing, light or dark, wide or narrow.

The pages of the console are walked in tests/console/test_flows.py.
"""

import contextlib
from types import SimpleNamespace

import pytest
from tests.browser import Browser, needs_chromium
from tests.reference import TRACES

import racecraft as rc
from racecraft.contract.kind import load

pytestmark = needs_chromium
CAR, SNAKE = "racecraft.worlds.deepracer.actions", "racecraft.worlds.battlesnake.actions"
TINY_CAR = {
    "camera.width": 16, "camera.height": 12, "rollout.num_worlds": 4, "rollout.horizon": 64, "evaluation.episodes": 2,
    "race.max_episode_seconds": 2.0, "network.conv_filters": (4,), "network.conv_kernels": (4,),
    "network.conv_strides": (2,), "network.hidden_units": (8,), "runtime.threads": 1,
}  # fmt: skip
TINY_GYM = {"rollout.num_worlds": 2, "rollout.horizon": 64, "network.hidden_units": (8,), "evaluation.episodes": 2}


def do(target, *arguments, **options):
    return load(target)(*arguments, **options)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run of an environment, one of a car, a game and an arena; each is made when it is first asked for."""
    base = tmp_path_factory.mktemp("pages")

    def once(name, make):
        path = base / name
        if not path.exists():
            make(path)
        return path

    def gym(path):
        rc.train("gymnasium", environment="CartPole-v1", settings=TINY_GYM, stops="iterations=3", run=path, quiet=True)

    def other(path):
        settings = {**TINY_GYM, "ppo.learning_rate": 1e-3}
        rc.train("gymnasium", environment="CartPole-v1", settings=settings, stops="iterations=3", run=path, quiet=True)

    def car(path):
        rc.train("deepracer", settings=TINY_CAR, preset="fast", stops="iterations=2", run=path, quiet=True)

    def game(path):
        do(f"{SNAKE}.play:play", ["flood_fill", "hungry"], width=7, height=7, seed=3, output=path)

    def arena(path):
        do(f"{SNAKE}.arena:new_arena", anchor="hungry", snakes=2, width=7, height=7, arena=path)
        do(f"{SNAKE}.arena:add_players", ["flood_fill"], arena=path)
        do(f"{SNAKE}.arena_play:play_arena", games=2, arena=path)

    def reward(path):
        do(f"{CAR}.new:new", path)
        angle = "math.atan2(params['y'] - params['waypoints'][0][1], params['x'] - params['waypoints'][0][0])"
        text = f"import math\ndef reward_function(params):\n    return abs(params['heading'] - {angle})\n"
        (path / "reward_function.py").write_text(text)  # its fault stands in a line that is wider than a phone

    def league(path):
        do(f"{CAR}.create_race:create_race", "Cup", track=["Oval_track"], league=path)

    makers = {
        "league": league,
        "gym": gym,
        "other": other,
        "car": car,
        "game.jsonl": game,
        "arena.sqlite": arena,
        "racer": reward,
    }
    return SimpleNamespace(base=base, of=lambda name: once(name, makers[name]))


WRITTEN = {
    "report": lambda made, page: do("racecraft.actions.report:report", made.of("gym"), output=page),
    "report of a car": lambda made, page: do("racecraft.actions.report:report", made.of("car"), output=page),
    "compare": lambda made, page: do("racecraft.actions.compare:compare", [str(made.of("gym")), str(made.of("other"))],
                                     page=page, starts=4),
    "logs": lambda made, page: do(f"{CAR}.logs:logs", [made.of("car")], page=page),
    "why": lambda made, page: do(f"{CAR}.why:why", made.of("car"), page=page),
    "look": lambda made, page: do(f"{CAR}.look:look", made.of("car"), page=page),
    "replay": lambda made, page: do(f"{CAR}.replay:replay", made.of("car"), page=page),
    "telemetry": lambda made, page: do(f"{CAR}.telemetry:telemetry", [TRACES / "drfc-1-worker"], page=page),
    "reward check": lambda made, page: do(f"{CAR}.reward:check_reward", made.of("racer"), page=page),
    "reward map": lambda made, page: do(f"{CAR}.reward:map_reward", made.of("racer"), track="Oval_track", page=page),
    "reward rescore": lambda made, page: do(f"{CAR}.reward:rescore", made.of("racer"), [made.of("car")], page=page),
    "game": lambda made, page: do(f"{SNAKE}.watch:watch", made.of("game.jsonl"), html=page),
    "index": lambda made, page: do("racecraft.actions.league.exporting:export_league", to="site", out=page.parent,
                                   league=made.of("league")),
}  # fmt: skip
"""Pages in files, and what writes them."""
SERVED = {
    "watch": lambda made: do("racecraft.actions.watch:watch", made.of("gym"), port=0, open_it=False),
    "watch a car": lambda made: do("racecraft.actions.watch:watch", made.of("car"), port=0, open_it=False),
    "arena": lambda made: do(f"{SNAKE}.arena_play:show_board", arena=made.of("arena.sqlite"), port=0, open_it=False),
}
"""Pages of servers, and what serves them."""
QUICK = ("report", "game", "watch")


def names():
    """Return every page; those that take long to make are left to the long tests."""
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in (*WRITTEN, *SERVED)]


@pytest.fixture(scope="module")
def browser():
    one = Browser()
    yield one
    one.close()


@contextlib.contextmanager
def address(name, made):
    """Yield where a page is."""
    if name in WRITTEN:
        page = made.base / f"{name.replace(' ', '-')}.html"
        WRITTEN[name](made, page)
        yield page.as_uri()
        return
    served = SERVED[name](made)
    try:
        yield served.url
    finally:
        served.close()


def wide(browser):
    """Return what stands beyond the window's right edge."""
    return browser.value(
        """[...document.querySelectorAll('*')].filter(one => one.getBoundingClientRect().right > innerWidth + 1
             && !one.closest('.scroll, svg')).map(one => one.outerHTML.slice(0, 200)).slice(0, 5)"""
    )


@pytest.mark.parametrize("name", names())
def test_a_page_is_read_by_everybody(name, made, browser):
    with address(name, made) as at:
        browser.complaints.clear()
        for width, dark in ((1440, False), (1440, True), (390, False)):
            browser.show(width, 900, dark)
            browser.open(at)
            browser.page.wait_for_timeout(300)
            assert browser.shut_out() == [], f"{width} CSS pixels, {'dark' if dark else 'light'}"
            assert browser.sideways() == 0, (width, wide(browser))
        assert browser.complaints == []
        browser.open("about:blank")  # before its server ends
