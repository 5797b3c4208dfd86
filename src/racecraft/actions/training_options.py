"""The options of every training, whatever its world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.settings.request import Request, option


@dataclass(frozen=True, kw_only=True)
class TrainingOptions(Request):
    """What every training is asked alike; a world says in its own words what stops it and where its run lies."""

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
    keep: str | None = option(None, "Checkpoints that stay: all, or best,last,N (N more, spread out).", metavar="KEPT")
    mirror: str | None = option(None, "s3://BUCKET/PREFIX: keep the run there as well, while it trains.")
    pictures: bool = option(True, "Leave a report with its curves in the run folder.")
    metrics_port: int | None = option(None, "Serve Prometheus metrics on this port; 0: a free one.")

    metrics_host: str = option("127.0.0.1", "Listen address of the metrics; 0.0.0.0: all interfaces, to anyone.")

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
