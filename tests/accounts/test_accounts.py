"""Accounts, links, sessions and rights by themselves, without a server."""

import contextlib
import sqlite3
import threading
from pathlib import Path

import pytest

from racecraft.accounts.attempts import Attempts, TooManyAttemptsError
from racecraft.accounts.invitation_csv import read_invitations
from racecraft.accounts.invitations import accept, invite, invited, reset
from racecraft.accounts.people import LOCAL_OWNER, AccountError, Person, Role
from racecraft.accounts.rights import NotAllowedError, Verb, may, require
from racecraft.accounts.sessions import Sessions
from racecraft.accounts.store import Accounts
from racecraft.contract.errors import InputFileError, SettingError

PASSWORD = "a horse in the rain"


@pytest.fixture
def accounts(tmp_path, monkeypatch):
    """An empty store whose passwords are hashed by Argon2 with its least work."""
    from argon2 import PasswordHasher

    cheap = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr("racecraft.accounts.passwords._hasher", lambda: cheap)
    made = Accounts(f"sqlite:///{tmp_path}/jobs.sqlite")
    yield made
    made.close()


@pytest.fixture
def clock(monkeypatch):
    """The time of sessions and links, to be moved."""
    at = [1000.0]
    monkeypatch.setattr("time.time", lambda: at[0])
    return at


def member(accounts, name, role=Role.RACER):
    person, token = invite(accounts, LOCAL_OWNER, name, role)
    return accept(accounts, token, PASSWORD) and accounts.named(person.name)


def test_a_link_works_once_and_the_password_it_set_signs_in(accounts):
    ada, token = invite(accounts, LOCAL_OWNER, "Ada", Role.RACER)
    assert invited(accounts, token) == ada
    assert not accounts.named("ada").has_password
    with pytest.raises(AccountError):
        accounts.with_password("Ada", "")
    accept(accounts, token, PASSWORD)
    assert accounts.with_password("ADA", PASSWORD).id == ada.id
    for wrong in ((PASSWORD.upper(), "Ada"), (PASSWORD, "Adam"), ("", "Ada")):
        with pytest.raises(AccountError):
            accounts.with_password(wrong[1], wrong[0])
    with pytest.raises(AccountError):
        accept(accounts, token, "another password")
    accounts.with_password("Ada", PASSWORD)


def test_only_the_newest_link_works_and_none_for_ever(accounts, clock):
    _, first = invite(accounts, LOCAL_OWNER, "Ada", Role.RACER)
    second = reset(accounts, LOCAL_OWNER, accounts.named("Ada"))
    with pytest.raises(AccountError):
        invited(accounts, first)
    clock[0] += 13 * 86400
    assert invited(accounts, second).name == "Ada"
    clock[0] += 2 * 86400
    with pytest.raises(AccountError):
        invited(accounts, second)


def test_the_store_holds_neither_passwords_nor_tokens(accounts, tmp_path):
    _, link = invite(accounts, LOCAL_OWNER, "Bob", Role.RACER)
    ada = member(accounts, "Ada")
    token = Sessions(accounts).begin(ada)
    with contextlib.closing(sqlite3.connect(tmp_path / "jobs.sqlite")) as kept:
        text = "\n".join(kept.iterdump())
    assert "Ada" in text
    assert not [secret for secret in (PASSWORD, link, token) if secret in text]


def test_two_people_never_share_a_name_or_an_id(accounts):
    ada = member(accounts, "Ada")
    for taken in ("ADA", " Ada ", "\uff21da", "Owner"):
        with pytest.raises(AccountError):
            invite(accounts, LOCAL_OWNER, taken, Role.RACER)
    for wrong in ("", "..", "a/b", "a" * 33, "<b>", "Ada\n"[:0], "a\x00b"):
        with pytest.raises(SettingError):
            invite(accounts, LOCAL_OWNER, wrong, Role.RACER)
    accounts.remove(ada)
    assert accounts.find(ada.id) is None
    assert member(accounts, "Ada").id != ada.id


def test_a_session_ends_by_time_sign_out_removal_a_new_password_or_a_lower_role(accounts, clock):
    sessions, ada = Sessions(accounts), member(accounts, "Ada", Role.ORGANISER)
    token = sessions.begin(ada)
    assert sessions.find(token).person == ada
    assert sessions.find(token[:-1]) is None
    clock[0] += 8 * 86400
    assert sessions.find(token) is None
    for end in (
        lambda shown: sessions.end(sessions.find(shown).session),
        lambda shown: sessions.end_all(ada),
        lambda shown: accounts.set_password(ada, "some other password"),
        lambda shown: accounts.set_role(ada, Role.RACER),
        lambda shown: accounts.remove(ada),
    ):
        token = sessions.begin(ada)
        assert sessions.find(token)
        end(token)
        assert sessions.find(token) is None


def test_a_token_is_replaced_each_hour_and_the_session_ends_after_a_month(accounts, clock):
    sessions, ada = Sessions(accounts), member(accounts, "Ada")
    token = first = sessions.begin(ada)
    clock[0] += 3601
    found = sessions.find(token)
    assert found.renewed
    assert not sessions.find(token).renewed  # it works a minute longer
    assert sessions.find(found.renewed).session == found.session
    clock[0] += 61
    assert sessions.find(first) is None
    token = found.renewed
    for _ in range(40):
        clock[0] += 86400
        found = sessions.find(token)
        if found is None:
            break
        token = found.renewed or token
    assert 29 * 86400 < clock[0] < 32 * 86400


def test_of_requests_at_once_one_renews_a_token(accounts, clock):
    sessions, ada = Sessions(accounts), member(accounts, "Ada")
    token, found = sessions.begin(ada), []
    clock[0] += 3601
    threads = [threading.Thread(target=lambda: found.append(sessions.find(token))) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(bool(one.renewed) for one in found if one) == 1
    assert all(found)


def test_rights_grow_with_the_role_and_end_at_other_peoples_models():
    people = {role: Person(id=role[:3], name=role, role=role) for role in Role}
    allowed = {role: {verb.name for verb in Verb if may(people[role], verb)} for role in Role}
    assert allowed[Role.SPECTATOR] == {"WATCH", "USE_ACCOUNT"}
    assert allowed[Role.RACER] - allowed[Role.SPECTATOR] == {"KEEP_MODELS", "ENTER"}
    assert allowed[Role.ORGANISER] - allowed[Role.RACER] == {"ORGANISE", "INVITE"}
    assert allowed[Role.OWNER] - allowed[Role.ORGANISER] == {"APPOINT", "RUN_MACHINE"}
    racer = people[Role.RACER]
    assert may(racer, Verb.ENTER, owner=racer.id)
    assert not may(racer, Verb.ENTER, owner="another")
    assert may(people[Role.ORGANISER], Verb.ENTER, owner="another")
    assert not any(may(person, Verb.KEEP_MODELS, owner="another") for person in people.values())
    with pytest.raises(NotAllowedError, match="organiser"):
        require(racer, Verb.ORGANISE)


def test_nobody_gives_a_role_that_is_not_below_their_own(accounts):
    eve = member(accounts, "Eve", Role.ORGANISER)
    invite(accounts, eve, "Bob", Role.RACER)
    for role in (Role.ORGANISER, Role.OWNER):
        with pytest.raises(NotAllowedError):
            invite(accounts, eve, "Mallory", role)
    with pytest.raises(NotAllowedError):
        reset(accounts, eve, member(accounts, "Boss", Role.OWNER))
    with pytest.raises(NotAllowedError):
        invite(accounts, accounts.named("Bob"), "Mallory", Role.SPECTATOR)
    assert [(act.name, act.what, act.subject) for act in accounts.acts()][-2:] == [
        ("Eve", "invite", "Bob"), ("owner", "invite", "Eve"),
    ]  # fmt: skip


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_csv_says_what_is_wrong_line_by_line(accounts, separator):
    known = [member(accounts, "Ada")]
    text = "\ufeffname,role\nBob,\nbob,racer\nEve,king\nada,racer\n\nZo\u00eb,Spectator\n".replace(",", separator)
    rows = read_invitations(Path("club.csv"), text, known)
    assert [(row.line, row.name, bool(row.wrong)) for row in rows] == [
        (2, "Bob", False), (3, "bob", True), (4, "Eve", True), (5, "ada", True), (7, "Zo\u00eb", False),
    ]  # fmt: skip
    assert [rows[0].role, rows[-1].role] == [Role.RACER, Role.SPECTATOR]
    for bad in ("", "who\nBob", "name\n" + "x\n" * 1001, 'name\n"Bob'):
        with pytest.raises(InputFileError):
            read_invitations(Path("club.csv"), bad, [])


def test_attempts_are_refused_for_a_minute_and_others_are_not(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    attempts = Attempts(most=3)
    for _ in range(3):
        attempts.count("here", "Ada")
    with pytest.raises(TooManyAttemptsError):
        attempts.count("here", "Bob")
    attempts.count("there", "Bob")
    now[0] += 60.0
    attempts.count("here", "Bob")


@pytest.mark.parametrize("password", ["short", "aaaaaaaaaaaa", "Ada Lovelace", "x" * 600])
def test_poor_passwords_are_refused(accounts, password):
    _, token = invite(accounts, LOCAL_OWNER, "Ada Lovelace", Role.RACER)
    with pytest.raises(AccountError):
        accept(accounts, token, password)
