"""What each path of the console needs: one table. A path that is missing is the owner's alone. Begin with `RIGHTS`.

What a path shows or changes beyond that is decided by whose console it is: another person's models are in no console
but their own (`personal.py`).
"""

from __future__ import annotations

from collections.abc import Mapping

from racecraft.accounts.people import Person
from racecraft.accounts.rights import Verb, may

ALL = Verb.USE_ACCOUNT
MODELS = Verb.KEEP_MODELS

RIGHTS: Mapping[str, Verb | tuple[Verb, Verb]] = {
    "/": MODELS,
    "/account": ALL,
    "/account/password": ALL,
    "/account/sign-out": ALL,
    "/account/sign-out-everywhere": ALL,
    "/compare": MODELS,
    "/compare/look": MODELS,
    "/drafts/new": MODELS,
    "/drafts/{id}/{step}": MODELS,
    "/drafts/{id}/{step}/keep": MODELS,
    "/drafts/{id}/{step}/look": MODELS,
    "/drive": MODELS,
    "/drive/{track}": MODELS,
    "/drive/{track}/teach": MODELS,
    "/drive/{track}/wheel": MODELS,
    "/endpoints": Verb.RUN_MACHINE,
    "/endpoints/{name}": Verb.RUN_MACHINE,
    "/endpoints/{name}/delete": Verb.RUN_MACHINE,
    "/events": ALL,
    "/import": MODELS,
    "/import/{name}": MODELS,
    "/import/{name}/train": MODELS,
    "/jobs": MODELS,
    "/jobs/{job}/stop": MODELS,
    "/lessons": ALL,
    "/lessons/sheet/{path}": ALL,
    "/lessons/words": ALL,
    "/lessons/{lesson}": ALL,
    "/lessons/{lesson}/{exercise}": ALL,
    "/logs/{name}": MODELS,
    "/logs/{name}/laps": MODELS,
    "/models": MODELS,
    "/models/act": MODELS,
    "/models/first": MODELS,
    "/models/{name}": MODELS,
    "/models/{name}/checkpoints": MODELS,
    "/models/{name}/evaluations": MODELS,
    "/models/{name}/export": MODELS,
    "/models/{name}/files": MODELS,
    "/models/{name}/games/{number:int}": MODELS,
    "/models/{name}/logs.zip": MODELS,
    "/models/{name}/files/{path:path}": MODELS,
    "/models/{name}/laps/design": MODELS,
    "/models/{name}/laps/lap.csv": MODELS,
    "/models/{name}/note": MODELS,
    "/models/{name}/rename": MODELS,
    "/models/{name}/resume": MODELS,
    "/models/{name}/share": MODELS,
    "/models/{name}/stop": MODELS,
    "/models/{name}/view/{path:path}": MODELS,
    "/models/{name}/watch": MODELS,
    "/models/{name}/{tab}": MODELS,
    "/models/{name}/{tab}/look": MODELS,
    "/parts": ALL,
    "/people": Verb.INVITE,
    "/people/invite": Verb.INVITE,
    "/people/preview": Verb.INVITE,
    "/people/{id}/remove": Verb.APPOINT,
    "/people/{id}/reset": Verb.INVITE,
    "/people/{id}/role": Verb.APPOINT,
    "/pictures/{kind}/{key}.svg": ALL,
    "/races/{id}/drives/{heat}/{number:int}": Verb.WATCH,
    "/races/{id}/show": Verb.WATCH,
    "/racers/{name}": Verb.WATCH,
    "/races": Verb.WATCH,
    "/races/new": Verb.ORGANISE,
    "/races/practice": Verb.ENTER,
    "/races/{id}": Verb.WATCH,
    "/races/{id}/act": Verb.ORGANISE,
    "/races/{id}/board.csv": Verb.WATCH,
    "/races/{id}/copy": Verb.ORGANISE,
    "/races/{id}/drives/{heat}": Verb.WATCH,
    "/races/{id}/drives/{heat}/files.zip": Verb.ENTER,
    "/races/{id}/drives/{heat}/film": Verb.ENTER,
    "/races/{id}/drives/{heat}/film.jpg": Verb.WATCH,
    "/races/{id}/drives/{heat}/film.mp4": Verb.WATCH,
    "/races/{id}/edit": Verb.ORGANISE,
    "/races/{id}/enter": Verb.ENTER,
    "/races/{id}/withdraw": Verb.ENTER,
    "/seasons/new": Verb.ORGANISE,
    "/seasons/{id}": Verb.WATCH,
    "/settings": MODELS,
    "/settings/disk": MODELS,
    "/settings/notify": Verb.RUN_MACHINE,
    "/settings/restore": Verb.RUN_MACHINE,
    "/settings/workspace.zip": Verb.RUN_MACHINE,
    "/shared": MODELS,
    "/shared/copy": MODELS,
    "/tracks": MODELS,
    "/tracks/new": MODELS,
    "/tracks/new/check": MODELS,
    "/tracks/new/read": MODELS,
    "/tracks/{track}": MODELS,
    "/tracks/{track}.pdf": MODELS,
    "/tuning": Verb.RUN_MACHINE,
    "/tuning/new": Verb.RUN_MACHINE,
    "/tuning/{name}": Verb.RUN_MACHINE,
    "/tuning/{name}/go-on": Verb.RUN_MACHINE,
    "/tuning/{name}/keep": Verb.RUN_MACHINE,
    "/tuning/{name}/stop": Verb.RUN_MACHINE,
}
"""By path, as routes name it: what reading and acting need, or (reading, acting). `.json` needs what its page needs."""


def verb_of(path: str, method: str) -> Verb:
    """Return what a request needs.

    Args:
        path: Of its route, with the names of its parameters.
        method: GET and HEAD read; all others act.
    """
    found = RIGHTS.get("/" if path == "/index.json" else path.removesuffix(".json"), Verb.RUN_MACHINE)
    if isinstance(found, Verb):
        return found
    return found[0] if method in ("GET", "HEAD") else found[1]


def may_open(person: Person, path: str) -> bool:
    """Tell whether a person may read a page."""
    return may(person, verb_of(path, "GET"))
