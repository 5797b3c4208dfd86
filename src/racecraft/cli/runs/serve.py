"""`racecraft serve RUN`: any trained policy behind HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.actions.named_run import RUN_HELP
from racecraft.cli.options import Json

if TYPE_CHECKING:
    from racecraft.serving.endpoint_server import EndpointServer


def serve(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=f"{RUN_HELP} Of any world.")],
    port: Annotated[int, typer.Option(help="0: any free one.")] = 8080,
    host: Annotated[str, typer.Option(help="Who may ask; 0.0.0.0: other machines too.")] = "127.0.0.1",
    policy: Annotated[str, typer.Option(help="Whose rows, where groups have policies of their own.")] = "",
    ready: Annotated[Path | None, typer.Option(hidden=True, help="File that is told the address.")] = None,
    json: Json = False,
) -> None:
    """Answer GET /ping and POST /invocations for a trained policy, until Ctrl-C or SIGTERM.

    Observations come as JSON ({"instances": […]} or {"inputs": {…}}), as .npy or .npz, or as a PNG or JPEG picture.

    Examples:

        racecraft serve runs/CartPole-v1-1

        racecraft serve runs/reinvent_base-1:last --port 0 --json

        curl -H 'Content-Type: image/png' --data-binary @frame.png http://127.0.0.1:8080/invocations
    """
    from racecraft.cli.output import say
    from racecraft.players.trained import load_policy
    from racecraft.serving.endpoint_server import EndpointServer
    from racecraft.serving.quick_answers import answer_before_thinking, settle
    from racecraft.web.access import ANYONE, ONLY_HERE
    from racecraft.web.ports import is_loopback

    answer_before_thinking()
    server = EndpointServer(load_policy(run), policy, ONLY_HERE if is_loopback(host) else ANYONE)
    server.warm_up()
    settle()
    _answer_until_interrupted(server, host, port, ready, json)
    say(
        f"{server.requests} answers in {server.batches} batches, {server.refused} refused, "
        f"p99 {server.p99_ms():.1f} ms",
        quiet_stdout=json,
    )


def _answer_until_interrupted(server: EndpointServer, host: str, port: int, ready: Path | None, json: bool) -> None:
    from json import dumps

    from racecraft.cli.output import print_json, say
    from racecraft.formats.atomic import write_atomic
    from racecraft.web.server import serve as serve_application

    def tell(port: int) -> None:
        url = f"http://{host}:{port}"
        if ready is not None:
            write_atomic(ready, dumps({"url": url}) + "\n")
        if json:
            print_json(
                {"url": url, "run": str(server.policy.run.path), "iteration": server.policy.checkpoint.iteration}
            )
        else:
            say(f"{server.policy.run.path} answers at {url}/invocations (Ctrl-C ends)", quiet_stdout=False)

    try:
        serve_application(server.application, host, port, tell)
    finally:
        server.close()
