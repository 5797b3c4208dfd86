"""The options of every training, whatever its world. Begin with `TrainingOptions`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from racecraft.contract.kinds import find_kind
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.serving.watch_process import WatchProcess
    from racecraft.training.request import TrainRequest

FREE = frozenset(
    {
        "stop",
        "run",
        "seeds",
        "resume",
        "detach",
        "mirror",
        "pictures",
        "metrics_port",
        "metrics_host",
        "cluster",
        "notify",
    }  # fmt: skip
)
"""Options of every training that may be given anew when a run is resumed; a run keeps the others."""


@dataclass(frozen=True, kw_only=True)
class TrainingOptions(Request):
    """What every training is asked alike; a world adds its own options, and the request that all of them make."""

    kind: ClassVar[str]
    """Name of the `WorldKind`."""
    example: ClassVar[str] = "runs/RUN-1"
    """A run folder as the world's command makes it, for messages."""
    free: ClassVar[tuple[str, ...]] = ()
    """The world's own options that may be given anew when a run is resumed."""

    stop: tuple[str, ...] = option((), "minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make.")
    seed: int | None = option(1, "Same seed, same machine, same training.", low=0)
    seeds: int | None = option(
        None,
        "Train so many seeds one after another, from --seed on, each into a run of its own below --run, and "
        "judge them on fresh starts; with --detach each is a job. `racecraft compare` takes the folder.",
        low=2,
        high=100,
    )
    algorithm: str | None = option(
        None, "What learns: ppo (the default), sac, or your own as module:Class; `racecraft algorithms` lists them."
    )
    """None: what the user's own files ask for, else ppo."""
    set_: tuple[str, ...] = option((), "group.name=value; `racecraft settings` lists them all.")
    from_: str | None = option(
        None,
        "RUN[:best|last|N|laptime …]: begin with the weights of an earlier run, or of one at an s3:// address; a "
        "merit of `racecraft checkpoints` names the first by it.",
    )
    resume: bool = option(False, "Go on with the run that --run names.")
    detach: bool = option(False, "Go on as a job: the terminal is free, `racecraft jobs` looks after it.")
    keep: str | None = option(
        None,
        "Checkpoints that stay: all, or best,last,N (N more, spread out); best,last,200 where it is left out.",
        metavar="KEPT",
    )
    mirror: str | None = option(None, "s3://BUCKET/PREFIX: keep the run there as well, while it trains.")
    pictures: bool = option(True, "Leave a report with its curves in the run folder.")
    metrics_port: int | None = option(None, "Serve Prometheus metrics on this port; 0: a free one.", low=0, high=65535)
    metrics_host: str = option("127.0.0.1", "Listen address of the metrics; 0.0.0.0: all interfaces, to anyone.")

    notify: tuple[str, ...] = option(
        (),
        "Tell its first lap, a record, an error and its end: desktop, https://HOST/PATH (a webhook) or "
        "mailto:NAME@HOST (by the server in RACECRAFT_SMTP); may be repeated.",
        metavar="ADDRESS",
    )
    cluster: str | None = option(
        None,
        "Carry the worlds by workers: N processes here, or those of a Ray cluster (N@HOST:PORT: so many of it).",
        metavar="N|auto|HOST:PORT",
    )

    def request(self, progress: Callable[[str], None]) -> TrainRequest:
        """Return the request of a new run.

        Raises:
            UserInputError: Something given cannot be used.
        """
        raise NotImplementedError

    @property
    def verb(self) -> tuple[str, ...]:
        """The words of the world's command behind `racecraft`: ("gym", "train")."""
        return tuple(find_kind(self.kind).train_command.split()[1:])

    @property
    def model(self) -> str | None:
        """What metrics call the model; None: by its run."""
        return None

    @property
    def installation(self) -> Path | None:
        """The user's folder, which may name a bucket; None where there is none."""
        return None

    def is_kept(self, name: str) -> bool:
        """Tell whether a run keeps an option, so that it cannot change when the run is resumed."""
        return name not in FREE and name not in self.free

    def kept_as(self) -> Mapping[str, tuple[str, Any]]:
        """Return the options that job.json keeps otherwise than they are given: name and value there."""
        return {}

    def fields_as_given(self) -> Mapping[str, Any]:
        """Return the fields of the request that a run does not keep: they hold as given when it is resumed."""
        return {}

    def open_page(self, progress: Callable[[str], None]) -> WatchProcess | None:
        """Return the page that shows the run while it trains; None where none is wanted."""
        return None

    def args(self, leave_out: tuple[str, ...]) -> tuple[str, ...]:
        """Return what was given as words of the command: options first, arguments behind them."""
        named = {row: value for row, value in self.named().items() if row.name not in leave_out}
        options = [word for row, value in named.items() if not row.is_argument for word in row.args(value)]
        return (*options, *(word for row, value in named.items() if row.is_argument for word in row.args(value)))

    @property
    def overrides(self) -> tuple[str, ...]:
        """The settings, as typed, and those that options of their own stand for."""
        from racecraft.training.settings import keep_override

        return (*self.set_, *(() if self.keep is None else (keep_override(self.keep),)))

    def source(self, progress: Callable[[str], None], folder: Path | None = None) -> str | None:
        """Return the run whose weights are begun with, fetched where it is named by an address."""
        from racecraft.actions.mirroring import fetch_run

        return None if self.from_ is None else fetch_run(self.from_, progress, folder)

    def for_request(self, source: str | None) -> dict[str, Any]:
        """Return all this as keywords of a `TrainRequest`."""
        return {
            "algorithm": self.algorithm,
            "stops": self.stop,
            "run": self.run,
            "seed": self.seed,
            "overrides": self.overrides,
            "clone_from": source,
        }
