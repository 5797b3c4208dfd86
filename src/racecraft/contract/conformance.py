"""The examination every world sits. Inherit `WorldConformance`, provide `make_world`, and pytest does the rest.

::

    class TestMyWorld(WorldConformance):
        def make_world(self, num_worlds):
            return MyWorld(num_worlds)

The exam drives with random actions (masks are heeded). What it could not reach that way, such as an ending that random
driving never meets, it says by skipping with a reason; override `ticks` or `choose` to reach it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from racecraft.contract.world import (
    POLICY_ID,
    ActionSpec,
    Array,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    ReportsEpisodes,
    StepBuffers,
    World,
    WorldSpec,
    allocate,
    mask_width,
)

Story = list[dict[str, Array]]


class WorldConformance:
    """Inherit, provide `make_world`, and the world is examined."""

    num_worlds = 3
    """N of the world that is examined."""
    ticks = 200
    """Ticks of a story."""
    seed = 7

    def make_world(self, num_worlds: int) -> World:
        """Return a new world of `num_worlds` worlds; a world of another fixed number may ignore it."""
        raise NotImplementedError("provide make_world(num_worlds) in your exam")

    def choose(self, spec: WorldSpec, buffers: StepBuffers, rng: np.random.Generator) -> Array:
        """Return the actions of a tick, (N, M, ...): anything legal. Row by row, so that N does not matter.

        Override it to reach what random acting does not.
        """
        mask = buffers.action_mask
        if not spec.groups:
            return legal_actions(spec.actions, (spec.num_worlds, spec.num_agents), mask, rng)
        actions = np.zeros((spec.num_worlds, spec.num_agents, *spec.actions.shape), np.float32)
        for number, group in enumerate(spec.groups.values()):
            own = mask[..., : mask_width(group)] if mask is not None and group.has_action_mask else None
            drawn = legal_actions(group.actions, (spec.num_worlds, spec.num_agents), own, rng)
            wide = drawn.reshape(spec.num_worlds, spec.num_agents, -1)
            theirs = buffers.observations[POLICY_ID] == number
            actions[theirs, : wide.shape[-1]] = wide[theirs]
        return actions

    def test_the_spec_is_whole(self) -> None:
        """Names, shapes and types are there, and a mask stands beside choices only."""
        world = self.make_world(self.num_worlds)
        spec = world.spec
        assert spec.name
        assert spec.num_worlds >= 1
        assert spec.num_agents >= 1
        assert spec.observations, "a world shows at least one observation"
        assert any(not part.privileged for part in spec.observations.values()), "something must be open to the policy"
        assert not spec.has_action_mask or mask_width(spec) > 0, "a mask stands beside choices only"
        for group, kind in spec.groups.items():
            assert {f"{group}/{name}" for name in kind.observations} <= set(spec.observations), f"{group} sees nothing"
        for name, part in spec.observations.items():
            assert part.low <= part.high, f"{name}: low {part.low} above high {part.high}"
        world.close()

    def test_the_same_seed_tells_the_same_story(self) -> None:
        """Twice from the same seed with the same actions: every number is the same, in the same world and in a twin."""
        world, twin = self.make_world(self.num_worlds), self.make_world(self.num_worlds)
        first = self.story(world)
        assert_same_story(first, self.story(world), "a second reset of the same world")
        assert_same_story(first, self.story(twin), "a new world")
        world.close()
        twin.close()

    def test_observations_stay_inside_their_spec(self) -> None:
        """Shapes and types are kept and every number is within its bounds, at each tick."""
        world = self.make_world(self.num_worlds)
        spec = world.spec
        for t, tick in enumerate(self.story(world)):
            for name, part in spec.observations.items():
                seen = tick[f"observations.{name}"]
                assert seen.shape == (spec.num_worlds, spec.num_agents, *part.shape), f"{name} at row {t}"
                assert seen.dtype == np.dtype(part.dtype), f"{name} at row {t}"
                assert not np.isnan(seen.astype(float)).any(), f"{name} at row {t}: not a number"
                if seen.size == 0:
                    continue
                low, high = float(seen.min()), float(seen.max())
                assert low >= part.low, f"{name} at row {t}: {low} is below {part.low}"
                assert high <= part.high, f"{name} at row {t}: {high} is above {part.high}"
        world.close()

    def test_what_a_step_brings_is_sound(self) -> None:
        """Rewards are finite float32, the three flags are bool, and a mask leaves every active agent a choice."""
        world = self.make_world(self.num_worlds)
        for t, tick in enumerate(self.story(world)):
            assert tick["reward"].dtype == np.float32
            assert np.isfinite(tick["reward"]).all(), f"row {t}: reward {tick['reward']}"
            assert all(tick[name].dtype == bool for name in ("terminated", "truncated", "active"))
            if "action_mask" in tick:
                assert tick["action_mask"][tick["active"]].any(axis=-1).all(), f"row {t}: an agent has no choice"
        world.close()

    def test_a_world_writes_into_the_arrays_it_is_given(self) -> None:
        """The arrays of the buffers are filled, not replaced."""
        world = self.make_world(self.num_worlds)
        buffers = allocate(world.spec)
        before = [id(array) for array in _arrays(buffers)]
        world.reset(buffers, self.seed)
        world.step(self.choose(world.spec, buffers, np.random.default_rng(0)), buffers)
        assert [id(array) for array in _arrays(buffers)] == before
        world.close()

    def test_an_ending_shows_its_own_last_observation(self) -> None:
        """Where an episode ends, the final observation is written, within its spec; not left as it was."""
        world = self.make_world(self.num_worlds)
        spec, rng = world.spec, np.random.default_rng(self.seed)
        buffers, endings = allocate(spec), 0
        world.reset(buffers, self.seed)
        for _ in range(self.ticks):
            filled = {name: _fill_with_unlikely(array) for name, array in buffers.final_observations.items()}
            world.step(self.choose(spec, buffers, rng), buffers)
            for n, m in np.argwhere(buffers.ended):
                endings += 1
                for name, part in spec.observations.items():
                    seen = buffers.final_observations[name][n, m]
                    written = (seen != filled[name][n, m]).any() or seen.size == 0
                    assert written or not buffers.truncated[n, m], f"{name}: no final observation of world {n}"
                    assert not written or (seen >= part.low).all() and (seen <= part.high).all(), f"{name}: {seen}"
        world.close()
        if not endings:
            _could_not_reach(f"no episode ended in {self.ticks} ticks")

    def test_a_reset_forgets_the_episodes_before_it(self) -> None:
        """What ended before a reset is not told after it, by a world that tells of its episodes."""
        world = self.make_world(self.num_worlds)
        has_ended = any((tick["terminated"] | tick["truncated"]).any() for tick in self.story(world))
        world.reset(allocate(world.spec), self.seed)
        left = world.pop_episodes() if isinstance(world, ReportsEpisodes) else []
        world.close()
        assert not left, f"{len(left)} episodes from before the reset"
        if not has_ended:
            _could_not_reach(f"no episode ended in {self.ticks} ticks")

    def test_stepping_many_worlds_equals_stepping_each_beside_fewer(self) -> None:
        """World 0 of one tells the story of world 0 of many, when both are told to do the same."""
        many, one = self.make_world(self.num_worlds), self.make_world(1)
        if one.spec.num_worlds != 1 or many.spec.num_worlds == 1:
            _could_not_reach("the number of worlds cannot be chosen")
        recorded: list[Array] = []
        full = self.story(many, recorded.append)
        actions = iter(recorded)
        alone = self.story(one, choose=lambda: next(actions)[:1])
        for t, (some, every) in enumerate(zip(alone, full, strict=True)):
            for name, array in some.items():
                np.testing.assert_array_equal(array, every[name][:1], f"{name} at row {t}")
        many.close()
        one.close()

    def test_a_saved_world_goes_on_as_if_nothing_had_happened(self) -> None:
        """Half a story, save, go on; load into a new world, go on: the same second half, and the same view of now."""
        world, other = self.make_world(self.num_worlds), self.make_world(self.num_worlds)
        spec, rng = world.spec, np.random.default_rng(self.seed)
        buffers = allocate(spec)
        world.reset(buffers, self.seed)
        for _ in range(self.ticks // 2):
            world.step(self.choose(spec, buffers, rng), buffers)
        saved, observations = world.save_state(), _shown(buffers)
        assert all(isinstance(array, np.ndarray) for array in saved.values()), "a state is named arrays"
        kept = {name: array.copy() for name, array in saved.items()}
        recorded: list[Array] = []
        first = self.record_ticks(world, buffers, rng, recorded.append)
        for name, array in kept.items():
            np.testing.assert_array_equal(saved[name], array, f"the saved '{name}' changed while the world went on")

        restored = allocate(spec)
        other.load_state(saved, restored)
        for name, array in observations.items():
            np.testing.assert_array_equal(_shown(restored)[name], array, f"{name} after load_state")
        actions = iter(recorded)
        assert_same_story(
            first, self.record_ticks(other, restored, rng, choose=lambda: next(actions)), "the restored world"
        )
        world.close()
        other.close()

    def test_closing_twice_is_closing_once(self) -> None:
        """Closing again does nothing."""
        world = self.make_world(self.num_worlds)
        world.reset(allocate(world.spec), self.seed)
        world.close()
        world.close()

    def story(
        self,
        world: World,
        record: Callable[[Array], None] | None = None,
        choose: Callable[[], Array] | None = None,
    ) -> Story:
        """Begin the world anew and return what it wrote: one row for the start, one for each tick."""
        buffers = allocate(world.spec)
        world.reset(buffers, self.seed)
        return [_written(buffers), *self.record_ticks(world, buffers, np.random.default_rng(self.seed), record, choose)]

    def record_ticks(
        self,
        world: World,
        buffers: StepBuffers,
        rng: np.random.Generator,
        record: Callable[[Array], None] | None = None,
        choose: Callable[[], Array] | None = None,
    ) -> Story:
        """Return what the world writes in each of `ticks`; `record` is given the actions, `choose` returns them."""
        rows: Story = []
        for _ in range(self.ticks):
            actions = self.choose(world.spec, buffers, rng) if choose is None else choose()
            if record is not None:
                record(actions.copy())
            world.step(actions, buffers)
            rows.append(_written(buffers))
        return rows


def legal_actions(actions: ActionSpec, rows: tuple[int, int], mask: Array | None, rng: np.random.Generator) -> Array:
    """Return any legal actions, (N, M, *shape): numbers within their bounds, choices that the mask allows."""
    if isinstance(actions, ContinuousActions):
        low = np.maximum(np.array(actions.low, np.float32), -1e3)
        high = np.minimum(np.array(actions.high, np.float32), 1e3)
        return np.asarray(low + (high - low) * rng.random((*rows, len(low))), np.float32)
    if isinstance(actions, HybridActions):
        numbers = legal_actions(actions.continuous, rows, None, rng)
        choices = legal_actions(actions.discrete, rows, mask, rng)
        return np.concatenate([numbers, choices.astype(np.float32)], axis=-1)
    assert isinstance(actions, DiscreteActions | MultiDiscreteActions)
    counts = (actions.count,) if isinstance(actions, DiscreteActions) else actions.counts
    liking: Array = rng.random((*rows, sum(counts)))
    if mask is not None:
        liking = np.where(mask, liking, -1.0)
    branches = np.split(liking, np.cumsum(counts)[:-1], axis=-1)
    chosen = np.stack([branch.argmax(axis=-1) for branch in branches], axis=-1).astype(np.int64)
    return chosen[..., 0] if isinstance(actions, DiscreteActions) else chosen


def assert_same_story(first: Story, second: Story, what: str) -> None:
    """Hold two stories against each other, bit for bit."""
    assert len(first) == len(second)
    for t, (one, other) in enumerate(zip(first, second, strict=True)):
        for name, array in one.items():
            np.testing.assert_array_equal(array, other[name], f"{what}: {name} at row {t}")


def _shown(buffers: StepBuffers) -> dict[str, Array]:
    named = {f"observations.{name}": array.copy() for name, array in buffers.observations.items()}
    named["active"] = buffers.active.copy()
    if buffers.action_mask is not None:
        named["action_mask"] = buffers.action_mask.copy()
    return named


def _written(buffers: StepBuffers) -> dict[str, Array]:
    outcome = {name: getattr(buffers, name).copy() for name in ("reward", "terminated", "truncated")}
    cut = buffers.truncated & ~buffers.terminated  # only these rows need a final observation
    final = {f"final.{name}": array.copy() for name, array in buffers.final_observations.items()}
    for array in final.values():
        array[~cut] = 0
    return _shown(buffers) | outcome | final


def _arrays(buffers: StepBuffers) -> list[Any]:
    mask = [] if buffers.action_mask is None else [buffers.action_mask]
    named = [*buffers.observations.values(), *buffers.final_observations.values()]
    return [*named, buffers.reward, buffers.terminated, buffers.truncated, buffers.active, *mask]


def _fill_with_unlikely(array: Array) -> Array:
    """Fill an array with a number nobody would write all over, and return a copy."""
    array.fill(True if array.dtype == bool else 123)
    return array.copy()


def _could_not_reach(what: str) -> None:
    import pytest

    pytest.skip(f"the exam could not reach this: {what}")
