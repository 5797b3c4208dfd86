"""`racecraft people`: who shares the console, and what they may do."""

from __future__ import annotations

import time

import typer

from racecraft.actions.people import (
    ActLog,
    ChangedPerson,
    Invitations,
    PersonList,
    invite_people,
    list_people,
    remove_person,
    reset_password,
    set_role,
    show_act_log,
    sign_out_everywhere,
)
from racecraft.cli.from_request import command
from racecraft.cli.output import table

app = typer.Typer(help="Who shares the console: invite, roles, passwords.", no_args_is_help=True)


@app.callback()
def people() -> None:
    """Who shares the console: invite, roles, passwords."""


def _show_list(found: PersonList) -> None:
    if not found.people:
        print("nobody was invited yet; `racecraft people invite NAME` makes a link")
        return
    rows = [(one.name, one.role, _state(one.has_password, one.sessions)) for one in found.people]
    table(("name", "role", "sign-in"), rows, left=("name", "role", "sign-in"))


def _state(has_password: bool, sessions: int) -> str:
    if not has_password:
        return "invited"
    return f"signed in, {sessions} browser{'s' * (sessions != 1)}" if sessions else "signed out"


def _show_invitations(made: Invitations) -> None:
    for one in made.invitations:
        if one.wrong:
            print(f"line {one.line}: {one.name}: {one.wrong}")
        else:
            print(f"{one.name} ({one.role}){': ' + one.link if one.link else ''}")
    if made.is_preview:
        count = sum(not one.wrong for one in made.invitations)
        print(f"preview: {count} of {len(made.invitations)} would be invited; the same command without --preview does")


def _show_change(done: ChangedPerson) -> None:
    print(f"{done.name}: {done.change}")


def _show_log(log: ActLog) -> None:
    for one in log.acts:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(one.time))
        detail = ", ".join(f"{name} {value}" for name, value in one.detail.items())
        print(f"{when}  {one.name}  {one.what}  {one.subject}{'  ' + detail if detail else ''}")


app.command("list")(command(list_people, _show_list))
app.command("invite")(command(invite_people, _show_invitations))
app.command("role")(command(set_role, _show_change))
app.command("remove")(command(remove_person, _show_change))
app.command("reset")(command(reset_password, _show_invitations))
app.command("sign-out")(command(sign_out_everywhere, _show_change))
app.command("log")(command(show_act_log, _show_log))
