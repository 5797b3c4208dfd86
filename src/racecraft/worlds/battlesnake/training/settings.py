"""Settings of self-play: whom a learning snake meets."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class SelfPlayConfig:
    """Whom a learning snake meets."""

    anchor_share: float = setting(
        0.5, "Share of the games against anchors, built-in players that never change.", low=0.0, high=1.0
    )
    anchors: tuple[str, ...] = setting(
        ("flood_fill", "flood_fill", "hungry", "random_safe"),
        "Who sits there, in turn; a name may stand several times.",
        choices=("random_safe", "hungry", "flood_fill"),
    )
    foreign: tuple[str, ...] = setting(
        (), "Foreign snakes that are met, too: addresses of servers, runs, files; `--anchors` names them."
    )
    foreign_share: float = setting(0.125, "Share of the games against those, where there are any.", low=0.0, high=1.0)
    foreign_ms: int = setting(100, "What they may think for a move.", unit="ms", low=1, high=60_000)
    pool_share: float = setting(
        0.25, "Share of the games against a past self from the pool; the rest is against itself.", low=0.0, high=1.0
    )
    pool_size: int = setting(8, "Past selves in the pool; the oldest leave it.", low=1, high=100)
    pool_every: int = setting(10, "A self enters the pool after every so many iterations.", unit="iterations", low=1)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class SearchConfig:
    """How every position is searched while a snake learns by search."""

    walks: int = setting(48, "Walks of the tree of each position; most of the time goes there.", low=4, high=4096)
    noise_share: float = setting(
        0.2, "Share of chance in how likely moves are thought at first, so that all are tried.", low=0.0, high=1.0
    )

    def __post_init__(self) -> None:
        check_group(self)
