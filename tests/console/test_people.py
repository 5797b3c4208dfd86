"""People who share a console over the network: each sees only what is theirs, whatever they send."""

import contextlib
import hashlib
import http.client
import json
import re
import time
from urllib.parse import quote, urlencode

import pytest
from tests.console.conftest import write_run

from racecraft.accounts.invitations import accept, invite
from racecraft.accounts.people import LOCAL_OWNER, Role
from racecraft.accounts.rights import Verb, may
from racecraft.accounts.store import Accounts
from racecraft.console.application import make_console
from racecraft.console.commands import run_command
from racecraft.console.pages import create, garage
from racecraft.console.personal import PersonalConsoles
from racecraft.console.rights import RIGHTS, verb_of
from racecraft.console.workspace import Workspace
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import load_class, refuses_own_code
from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.job import new_job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.submit import environment_here
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.store import League
from racecraft.web.access import opened
from racecraft.web.server import ServerThread

TOKEN, PASSWORD, SECRET = "the-token-of-the-terminal", "a horse in the rain", "return 42.4242"
NAMES = {"Ada": Role.RACER, "Bob": Role.RACER, "Eve": Role.ORGANISER, "Sue": Role.SPECTATOR}


class Browser:
    """Keeps cookies, and sends the form token of the page it saw last, as a browser would."""

    def __init__(self, port, cookie=""):
        self.port, self.cookie, self.form_token = port, cookie, ""

    def ask(self, path, fields=None, *, method="", form_token=None, body=None, **headers):
        """Return (status, headers, text)."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        named = {"Accept": "text/html", **{name.replace("_", "-"): value for name, value in headers.items()}}
        if self.cookie:
            named.setdefault("Cookie", self.cookie)
        if fields is not None:
            token = self.form_token if form_token is None else form_token
            body = urlencode({**fields, "form_token": token}, doseq=True)
            named.setdefault("Content-Type", "application/x-www-form-urlencoded")
        connection.request(method or ("GET" if body is None else "POST"), path, body, named)
        answer = connection.getresponse()
        text = answer.read().decode("utf-8", "replace")
        for line in answer.headers.get_all("set-cookie") or []:
            self.cookie = line.partition(";")[0]
        if found := re.search(r'name="form_token" value="([^"]+)"', text):
            self.form_token = found[1]
        connection.close()
        return answer.status, dict(answer.getheaders()), text

    def sign_in(self, name, password=PASSWORD):
        self.ask("/sign-in")
        done = self.ask("/sign-in", {"name": name, "password": password, "next": "/"})
        if done[0] == 303:
            self.ask("/account")
        return done


class Club:
    """A console open to others with four people; Bob has a model and a job."""

    def __init__(self, folder):
        self.home = JobPaths(folder / "jobs", f"sqlite:///{folder}/jobs.sqlite")
        self.accounts = Accounts(self.home.store_url)
        self.people = {}
        for name, role in NAMES.items():
            person, link = invite(self.accounts, LOCAL_OWNER, name, role)
            self.people[name] = accept(self.accounts, link, PASSWORD)
        self.root = folder / "workspace"
        bob = self.people["Bob"]
        self.bobs = self.root / "people" / f"Bob-{bob.id}"
        workspace = Workspace.open(self.bobs)
        self.model = workspace.create("secret-car", {"reward_function.py": f"def reward_function(p): {SECRET}"})
        write_run(self.model.path / "runs/1")
        spec = JobSpec(command=("train", "."), name="secret-car-1", run="runs/1", folder=str(self.model.path))
        store = JobPaths(self.home.path, self.home.store_url, bob.owned).store()
        store.add(new_job(spec, time.time()))
        self.league = League.open_or_create(self.root / "league")
        self.league.add_race(Race(id="", title="Cup", kind="deepracer", tracks=("Oval_track",), rules={}))
        self.league.add_entry(
            "cup", lambda folder: Entry(number=0, racer="Bob", model="m", entered=1.0, person=bob.owned)
        )
        drive = Drive(track="Oval_track", seed=1, outcomes=(Outcome(laps=(9.0,)),), folder="drives/00001-0")
        result = Result(heat="00001", entries=(1,), drives=(drive,), judged=1.0)
        self.league.save_result("cup", result, {0: {"trace.csv": SECRET.encode()}})
        self.application = make_console(self.root, self.home, opened(TOKEN))
        self.server = ServerThread(self.application, "console")
        self.port = self.server.start("127.0.0.1", 0)

    def browser(self, name=""):
        made = Browser(self.port)
        if name:
            assert made.sign_in(name)[0] == 303
        return made

    def owner(self):
        made = Browser(self.port)
        made.ask(f"/?token={TOKEN}")
        made.ask("/people")
        return made

    def state_of_bob(self):
        """Return all that only Bob may change: his files, his job, the people, who is signed in."""
        files = {
            str(path.relative_to(self.bobs)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(self.bobs.rglob("*"))
            if path.is_file() and not path.name.startswith("console.sqlite")
        }
        job = self.home.store().find("secret-car-1")
        people = [(one.name, one.role, one.has_password) for one in self.accounts.people()]
        return files, job.state, people, self.league.entries("cup"), self.league.races()

    def close(self):
        self.server.close()
        self.accounts.close()


@pytest.fixture
def club(tmp_path, monkeypatch):
    from argon2 import PasswordHasher

    cheap = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr("racecraft.accounts.passwords._hasher", lambda: cheap)
    for page in (create, garage):
        monkeypatch.setattr(page, "begin_training", lambda home, model, words: None)
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    made = Club(tmp_path)
    yield made
    made.close()


def test_every_route_of_the_console_stands_in_the_table_of_rights(club):
    consoles = next(
        one.app for one in club.application.routes if isinstance(getattr(one, "app", None), PersonalConsoles)
    )
    paths = {route.path for route in consoles._pages[""].routes}
    named = {"/" if path == "/index.json" else path.removesuffix(".json") for path in paths}
    assert named - set(RIGHTS) == set(), "add these to console/rights.py; until then they are the owner's alone"
    assert set(RIGHTS) - named == set(), "no route has these paths any more"


def test_each_racer_sees_their_own_models_and_jobs_alone(club):
    ada, bob = club.browser("Ada"), club.browser("Bob")
    assert "secret-car" in bob.ask("/models")[2]
    assert "secret-car-1" in bob.ask("/jobs")[2]
    assert SECRET in bob.ask("/models/secret-car/files/reward_function.py")[2]
    assert ada.ask("/models")[0] == 200
    for path in ("/", "/models", "/models.json", "/jobs", "/jobs.json", "/models?q=secret"):
        assert "secret-car" not in ada.ask(path)[2], path
    assert ada.ask("/models/first", {"kind": "deepracer"})[0] == 303
    assert "first-car" in ada.ask("/models")[2]
    assert "first-car" not in bob.ask("/models")[2]
    assert "secret-car-1" in club.owner().ask("/jobs")[2]


def tricks(club, ada):
    """Yield (name, answer) of every trick that Ada plays on Bob's things, on the owner's and on the roles."""
    bob, accounts = club.people["Bob"], club.accounts
    car, place = "/models/secret-car", f"Bob-{bob.id}%2fmodels%2fsecret-car"
    for name, path in {
        "guess a model": car,
        "its data": f"{car}.json",
        "its file": f"{car}/files/reward_function.py",
        "its camera": f"{car}/watch/api/run",
        "compare": "/compare?m=secret-car&m=first-car",
        "clone": "/drafts/new?from=secret-car",
        "climb": f"/models/first-car/files/../../../Bob-{bob.id}/models/secret-car/reward_function.py",
        "climb, encoded": f"/models/first-car/files/..%2f..%2f..%2f{place}%2freward_function.py",
        "an absolute path": f"/models/first-car/files/{quote(str(club.model.path / 'reward_function.py'))}",
        "a workspace as a model": f"/models/{quote(f'../../Bob-{bob.id}/models/secret-car')}",
        "an imported model": "/import/secret-car",
        "the people": "/people.json",
        "a drive outside the race": "/races/cup/drives/..%2f..%2f..%2fsecret",
        "the entry's files": "/races/cup/entries/00001/entry.json",
        "a race outside the league": "/races/..%2f..%2fpeople",
        "the league's secret": "/races/cup/drives/..%2f..%2fsecret/0",
        "the trace of his drive": "/races/cup/drives/00001/files.zip",
        "a film outside the race": "/races/cup/drives/..%2f..%2fsecret/film.mp4",
        "a poster outside the race": "/races/cup/drives/..%2f..%2fsecret/film.jpg",
        "the form that changes a race": "/races/cup/edit",
        "two slashes": "//people",
        "a path in capitals": "/PEOPLE",
    }.items():
        yield name, ada.ask(path)
    for name, path, fields in (
        ("stop a job", "/jobs/secret-car-1/stop", {}),
        ("stop a model", f"{car}/stop", {}),
        ("rename", f"{car}/rename", {"name": "mine"}),
        ("write a note", f"{car}/note", {"text": "hacked"}),
        ("delete", "/models/act", {"act": "delete", "m": "secret-car"}),
        ("restore", "/models/act", {"act": "restore", "place": f"../../Bob-{bob.id}/models/secret-car"}),
        ("export", f"{car}/export", {"to": "onnx"}),
        ("evaluate", f"{car}/evaluations", {}),
        ("resume", f"{car}/resume", {"minutes": "1"}),
        ("withdraw his car", "/races/cup/withdraw", {"entry": "1"}),
        ("enter his car", "/races/cup/enter", {"model": "secret-car", "racer": "Bob"}),
        ("close a race", "/races/cup/act", {"act": "close"}),
        ("judge a race again", "/races/cup/act", {"act": "reset"}),
        ("make a race", "/races/new", {"kind": "deepracer", "title": "Mine"}),
        ("change a race", "/races/cup/edit", {"title": "Mine"}),
        ("copy a race", "/races/cup/copy", {"title": "Mine"}),
        ("make a season", "/seasons/new", {"title": "Mine"}),
        ("film another heat", "/races/cup/drives/..%2f..%2fsecret/film", {}),
        ("become owner", f"/people/{club.people['Ada'].id}/role", {"role": "owner"}),
        ("remove Bob", f"/people/{bob.id}/remove", {"name": "Bob"}),
        ("reset Bob's password", f"/people/{bob.id}/reset", {}),
        ("invite an owner", "/people/invite", {"name": "Mallory", "role": "owner"}),
        ("invite by CSV", "/people/invite", {"csv": "name,role\nMallory,owner\n"}),
        (
            "name another person",
            "/account/password",
            {"name": "Bob", "old": PASSWORD, "again": "x"},
        ),
    ):
        yield name, ada.ask(path, fields)
    yield "another method", ada.ask("/people", method="PUT", body="role=owner")
    yield "a method in a header", ada.ask(f"{car}/files/reward_function.py", {}, X_HTTP_Method_Override="DELETE")
    yield "a path in a header", ada.ask("/people", X_Original_URL="/account", X_Rewrite_URL="/account")
    yield "an address in a header", ada.ask("/people", X_Forwarded_For="127.0.0.1", X_Real_IP="127.0.0.1")
    yield "a person in a header", ada.ask("/people", X_Remote_User="owner", racecraft_person="owner")
    yield "a forged bearer", ada.ask("/people", Authorization="Bearer owner")
    yield "a forged cookie", Browser(club.port, f"racecraft-{club.port}={bob.id}").ask(car)
    yield "a stranger's cookie", Browser(club.port, f"racecraft-{club.port}=stranger-x").ask(car)
    yield "no cookie", Browser(club.port).ask(f"{car}/files/reward_function.py")
    yield "another's form token", ada.ask("/models/act", {"act": "archive", "m": "first-car"},
                                          form_token=club.browser("Bob").form_token)  # fmt: skip
    yield "no form token", ada.ask("/account/sign-out-everywhere", {}, form_token="")
    yield "another site's form", club.browser("Bob").ask("/models/act", {"act": "delete", "m": "secret-car"},
                                                         Origin="http://evil.example")  # fmt: skip
    yield (
        "another site's script",
        club.browser("Bob").ask(f"{car}.json", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="cors"),
    )
    _, used = invite(accounts, LOCAL_OWNER, "Zoe", Role.RACER)
    accept(accounts, used, PASSWORD)
    accounts.remove(accounts.named("Zoe"))
    yield "a used link", Browser(club.port).ask(f"/invitation/{used}")
    yield "a guessed link", Browser(club.port).ask("/invitation/" + "a" * 32)
    yield "a large form", ada.ask("/people/preview", {"csv": "x" * 2_000_000})
    yield "a huge header", ada.ask("/account", X_Junk="x" * 40_000)
    yield "sign in by a list", ada.ask("/sign-in", {"name": ["Bob", "Ada"], "password": ["", "' or 1=1 --"]})


def test_no_trick_reads_writes_or_stops_what_is_not_the_tricksters(club):
    ada = club.browser("Ada")
    ada.ask("/models/first", {"kind": "deepracer"})
    ada.ask("/account")
    before, reached, count = club.state_of_bob(), [], 0
    for name, (status, headers, text) in tricks(club, ada):
        count += 1
        led_to_sign_in = status == 303 and headers["location"].startswith("/sign-in?")
        if not (led_to_sign_in or 400 <= status < 500) or SECRET in text:
            reached.append((name, status))
        ada.ask("/account")
    assert reached == []
    assert club.state_of_bob() == before
    assert count >= 54
    assert ada.ask("/account")[0] == 200


def test_nothing_in_a_racers_folder_is_taken_for_a_module(tmp_path):
    (tmp_path / "racecraft.py").write_text('raise SystemExit(print(\'{"error": "taken"}\'))')
    token = refuses_own_code.set(True)
    try:
        assert "error" not in run_command(["algorithms"], tmp_path)
        assert environment_here()["PYTHONSAFEPATH"] == "1"
        with pytest.raises(SettingError, match="code of its own"):
            load_class("tests.console.test_people:Browser", "network")
    finally:
        refuses_own_code.reset(token)


def test_a_sign_in_takes_a_new_token_and_a_planted_one_stays_a_strangers(club):
    victim = Browser(club.port)
    victim.ask("/sign-in")
    planted = victim.cookie
    assert victim.sign_in("Bob")[0] == 303
    assert victim.cookie != planted
    status, headers, _ = Browser(club.port, planted).ask("/models")
    assert (status, headers["location"]) == (303, "/sign-in?next=%2Fmodels")
    kept = victim.cookie
    victim.ask("/account/sign-out", {})
    assert Browser(club.port, kept).ask("/models")[0] == 303


def test_what_another_page_still_loads_leaves_the_cookie_of_a_sign_in_page_alone(club):
    browser = Browser(club.port)
    browser.ask("/sign-in")
    form = browser.cookie, browser.form_token
    browser.cookie = ""
    browser.ask("/sign-in?next=%2Fmodels", Sec_Fetch_Mode="cors")
    assert browser.cookie == ""
    browser.cookie, browser.form_token = form
    assert browser.ask("/sign-in", {"name": "Bob", "password": PASSWORD})[0] == 303


def test_after_sign_in_nobody_is_led_to_another_site(club):
    for then in ("//evil.example", "https://evil.example", "/\\evil.example", "javascript:alert(1)"):
        browser = Browser(club.port)
        browser.ask(f"/sign-in?next={quote(then, safe='')}")
        status, headers, _ = browser.ask("/sign-in", {"name": "Bob", "password": PASSWORD, "next": then})
        assert (status, headers["location"]) == (303, "/")


def test_the_eleventh_wrong_password_within_a_minute_waits_and_others_sign_in(club):
    browser = Browser(club.port)
    browser.ask("/sign-in")
    told = [browser.ask("/sign-in", {"name": "Bob", "password": f"guess {n}"}) for n in range(11)]
    assert {status for status, _, _ in told} == {403}
    assert "Too many attempts" not in told[9][2]
    assert "Too many attempts" in told[10][2]
    assert browser.sign_in("Bob")[0] == 403
    assert club.browser("Ada")


def test_each_role_opens_what_the_table_says(club):
    for name, role in NAMES.items():
        browser = club.browser(name)
        person = club.accounts.named(name)
        for path in ("/models", "/jobs", "/people", "/account", "/settings"):
            status, _, text = browser.ask(path)
            assert (status == 200) == may(person, verb_of(path, "GET")), (name, path, status)
            assert str(club.root) not in text, (name, path)
        assert (browser.ask("/people/invite", {"name": f"G {name}", "role": "racer"})[0] == 200) == may(
            person, Verb.INVITE
        )
        if role is Role.ORGANISER:
            assert browser.ask("/people/invite", {"name": "Boss", "role": "organiser"})[0] == 403
            owner = club.people["Bob"]
            assert browser.ask(f"/people/{owner.id}/role", {"role": "spectator"})[0] == 403
    assert [act.name for act in club.accounts.acts(1)] == ["Eve"]


def test_a_lower_role_a_removal_and_sign_out_everywhere_take_effect_at_once(club):
    owner, bob, second = club.owner(), club.browser("Bob"), club.browser("Bob")
    bob.ask("/account/sign-out-everywhere", {})
    assert second.ask("/models")[0] == 303
    eve, id = club.browser("Eve"), club.people["Eve"].id
    assert eve.ask("/people")[0] == 200
    assert owner.ask(f"/people/{id}/role", {"role": "racer"})[0] == 303
    assert eve.ask("/people")[0] == 303
    eve = club.browser("Eve")
    assert eve.ask("/people")[0] == 403
    assert owner.ask(f"/people/{id}/remove", {"name": "eve"})[0] == 303
    assert eve.ask("/account")[0] == 303
    assert Browser(club.port).sign_in("Eve")[0] == 403


def test_another_password_signs_out_every_other_browser(club):
    here, there = club.browser("Bob"), club.browser("Bob")
    new = "rain on a horse"
    assert here.ask("/account/password", {"old": "wrong", "password": new, "again": new})[0] == 422
    assert here.ask("/account/password", {"old": PASSWORD, "password": new, "again": new})[0] == 303
    assert here.ask("/account")[0] == 200
    assert there.ask("/account")[0] == 303
    assert Browser(club.port).sign_in("Bob")[0] == 403
    assert Browser(club.port).sign_in("Bob", new)[0] == 303


def test_the_machine_itself_needs_no_sign_in(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    home = JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite")
    server = ServerThread(make_console(tmp_path / "workspace", home), "console")
    browser = Browser(server.start("127.0.0.1", 0))
    assert [browser.ask(path)[0] for path in ("/", "/people", "/settings")] == [200, 200, 200]
    status, _, text = browser.ask("/people/invite", {"name": "Ada", "role": "organiser"})
    assert status == 200
    assert re.search(r"http://[^/]+/invitation/[\w-]{32}", text)
    assert browser.ask("/people", Host="evil.example")[0] == 403
    assert json.loads(browser.ask("/people.json")[2])["people"][0]["name"] == "Ada"
    server.close()


def test_a_racer_withdraws_their_own_car_and_an_organisers_acts_are_logged(club):
    club.league.add_entry("cup", lambda folder: club.league.entries("cup")[1])
    bob, eve = club.browser("Bob"), club.browser("Eve")
    assert bob.ask("/races/cup/withdraw", {"entry": "2"})[0] == 303
    assert list(club.league.entries("cup")) == [1]
    assert eve.ask("/races/cup/act", {"act": "close"})[0] == 303
    assert eve.ask("/races/cup/withdraw", {"entry": "1"})[0] == 303
    told = [(act.name, act.what, act.subject) for act in club.accounts.acts(2)]
    assert told == [("Eve", "withdraw entry", "cup"), ("Eve", "close race", "cup")]
    for path in ("/races/cup", "/races", "/racers/Bob"):
        assert str(club.root) not in club.browser("Sue").ask(path)[2]


def test_a_screens_link_opens_one_races_live_page_until_it_ends(club):
    eve, screen = club.browser("Eve"), Browser(club.port)
    club.league.add_race(Race(id="", title="Secret", kind="deepracer", tracks=("Oval_track",), rules={}))

    def link_after(act):
        eve.ask("/races/cup")
        eve.ask("/races/cup/act", {"act": act})
        found = re.search(rf"http://127.0.0.1:{club.port}(/screen/cup/\w+)", eve.ask("/races/cup")[2])
        return found and found[1]

    link = link_after("make link")
    status, _, page = screen.ask(link)
    assert (status, "Cup" in page, f"{link}/events" in page) == (200, True, True)
    assert '"closed":true' in page, "the road is drawn"
    assert "cars" in json.loads(screen.ask(f"{link}/drives/00001/0")[2])
    messages = set()
    for path in (link.replace("/cup/", "/secret/"), f"{link}x", "/screen/secret/x", "/screen/none/x"):
        messages.add(screen.ask(path, Accept="application/json")[2])
        assert screen.ask(f"{path}/events")[0] == 404
    assert [json.loads(one)["error"] for one in messages] == ["no_such_screen"]  # nobody learns which races there are
    assert [screen.ask(path)[0] for path in ("/races/cup", "/races/cup/show", "/events")] == [303, 303, 303]
    sue = club.browser("Sue")
    assert link not in sue.ask("/races/cup")[2]
    assert sue.ask("/races/cup/act", {"act": "make link"})[0] == 403
    assert link_after("end link") is None
    assert screen.ask(link)[0] == screen.ask(f"{link}/drives/00001/0")[0] == screen.ask(f"{link}/events")[0] == 404
    assert link_after("make link") != link


def test_a_shared_model_is_copied_whole_and_only_while_it_is_shared(club):
    ada, bob = club.browser("Ada"), club.browser("Bob")
    (club.model.path / "link").symlink_to("/etc/passwd")
    taken = {"owner": club.people["Bob"].id, "name": "secret-car"}
    ada.ask("/shared")
    assert ada.ask("/shared/copy", taken)[0] == 404
    bob.ask("/models/secret-car")
    assert bob.ask("/models/secret-car/share", {"shared": "1"})[0] == 303
    assert "secret-car" in ada.ask("/shared")[2]
    assert SECRET not in ada.ask("/shared.json")[2]
    for wrong in ({"name": "../secret-car"}, {"owner": ""}, {"owner": "../.."}):
        assert ada.ask("/shared/copy", taken | wrong)[0] == 404
    before = club.state_of_bob()
    status, headers, _ = ada.ask("/shared/copy", taken)
    assert (status, headers["location"]) == (303, "/models/secret-car")
    assert SECRET in ada.ask("/models/secret-car/files/reward_function.py")[2]
    own = next((club.root / "people").glob("Ada-*")) / "models/secret-car"
    assert (own / "runs/1/metrics.jsonl").is_file()
    assert not (own / "link").exists()
    ada.ask("/models/secret-car")
    assert ada.ask("/models/secret-car/rename", {"name": "mine"})[0] == 303
    assert club.state_of_bob() == before
    bob.ask("/models/secret-car/share", {"shared": ""})
    assert ada.ask("/shared/copy", taken)[0] == 404
    assert club.browser("Sue").ask("/shared")[0] == 403
