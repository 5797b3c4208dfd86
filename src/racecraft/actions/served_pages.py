"""Pages of an application behind an address of this machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served
from racecraft.contract.progress import Progress

if TYPE_CHECKING:
    from racecraft.web.access import Access
    from racecraft.web.server import ListeningServer, Tls


@dataclass(frozen=True)
class ServedPages(Served):
    """Pages behind an address."""

    address: str
    listening: ListeningServer
    opens_page: bool

    def as_dictionary(self) -> dict[str, Any]:
        """Return the address."""
        return {"address": self.address}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Answer until Ctrl-C or SIGTERM."""
        from racecraft.web.browser import open_page

        ready()
        if self.opens_page:
            open_page(self.address)
        self.listening.run()


def listen(
    application: Any,
    access: Access,
    *,
    host: str,
    port: int | None,
    usual_port: int,
    progress: Progress,
    path: str = "/",
    tls: Tls | None = None,
) -> tuple[str, ListeningServer]:
    """Listen; return the address of a page and the server.

    Args:
        application: What answers, as `web.server` takes it.
        access: Who may ask.
        host: Address to listen on.
        port: Port; None: the usual one, or where it is taken the next free.
        usual_port: The usual one.
        progress: Receives a message where another port is taken.
        path: Of the page.
        tls: Answer by https alone; None: by http.

    Raises:
        PortError: The address cannot be listened on.
    """
    from racecraft.web.ports import choose_port
    from racecraft.web.server import ListeningServer, address_of

    chosen, note = choose_port(port, usual_port)
    if note:
        progress(note)
    listening = ListeningServer(application, host, chosen, tls)
    return address_of(host, listening.port, access, path, scheme="https" if tls else "http"), listening
