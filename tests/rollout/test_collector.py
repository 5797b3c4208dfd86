"""The collector by hand and by law, on a walk whose every number is known."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_array_equal
from toy_world import LIMIT, Walk

from racecraft.algorithms.learner import Decision
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import RAW_ACTION, PpoConfig, PpoLearner
from racecraft.contract.errors import ContractError
from racecraft.contract.world import ArraySpec, EpisodeRecord
from racecraft.rollout.collector import Collector, WorkerLayoutError


class Always:
    """Takes the same choice always; notes the clock plus a half, and remembers whose episode ended."""

    device = torch.device("cpu")
    columns = {"noted": ArraySpec((), np.float32)}

    def __init__(self, choice):
        self.choice, self.forgotten, self.asked = choice, [], []

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        clock = observations["clock"][:, 0]
        self.asked.append(rows)
        return Decision(np.full(len(clock), self.choice, np.int64), {"noted": clock.astype(np.float32) + 0.5})

    def reset_state(self, rows):
        self.forgotten.append(rows.copy())


def a_learner(world, seed=1):
    return PpoLearner(world.spec, NetworkConfig(hidden_units=(16,)), PpoConfig(batch_size=32), seed)


def test_a_walk_up_is_cut_by_the_clock_and_its_final_value_is_kept():
    collector = Collector(Walk(2), Always(2), horizon=LIMIT + 3, seed=1)
    kept = collector.collect()
    assert kept.reward.shape == (LIMIT + 3, 2)
    assert_array_equal(kept.observations["clock"][:, 0, 0], [*range(LIMIT), 0, 1, 2])
    assert_array_equal(np.flatnonzero(kept.truncated[:, 0]), [LIMIT - 1])
    assert not kept.terminated.any()
    assert_array_equal(kept.final_index, [2 * (LIMIT - 1), 2 * (LIMIT - 1) + 1])
    assert_array_equal(kept.final_observations["clock"][:, 0], [LIMIT, LIMIT])  # not of the next start
    assert_array_equal(kept.last_observations["clock"][:, 0], [3, 3])
    assert_array_equal(kept.columns["noted"][:, 1], kept.observations["clock"][:, 1, 0] + 0.5)
    assert_array_equal(kept.actions, np.full((LIMIT + 3, 2), 2))
    assert collector.steps_taken == 2 * (LIMIT + 3)


def test_what_was_seen_belongs_to_what_was_done():
    kept = Collector(Walk(3, 2), Always(2), horizon=8, seed=4).collect()
    square = kept.observations["square"].argmax(axis=-1)
    ended = kept.terminated | kept.truncated
    assert kept.reward.shape == (8, 6)
    after = np.minimum(square + 1, 8)
    assert_array_equal(kept.reward, after)
    assert_array_equal(square[1:][~ended[:-1]], after[:-1][~ended[:-1]])


def test_episodes_go_on_from_one_rollout_to_the_next():
    one = Collector(Walk(2), Always(2), horizon=20, seed=1)
    whole = one.collect()
    parts = Collector(Walk(2), Always(2), horizon=10, seed=1)
    first = parts.collect()
    clocks = first.observations["clock"].copy()
    second = parts.collect()
    assert_array_equal(np.concatenate([clocks, second.observations["clock"]]), whole.observations["clock"])


def test_an_actor_hears_whose_episode_ended_and_that_all_begin():
    actor = Always(2)
    kept = Collector(Walk(2), actor, horizon=LIMIT + 3, seed=1)
    assert [rows.tolist() for rows in actor.forgotten] == [[True, True]]
    kept.collect()
    assert [rows.tolist() for rows in actor.forgotten[1:]] == [[True, True]]
    assert actor.asked == [None] * (LIMIT + 3), "all rows are asked about, in order"


def test_finished_episodes_are_told_with_their_sums():
    collector = Collector(Walk(1), Always(0), horizon=20, seed=1)
    start = int(collector.buffer.observations["square"][0, 0, 0].argmax())
    collector.collect()
    first = collector.pop_episodes()[0]
    assert first == EpisodeRecord(0, 0, start, start * (start - 1) / 2, "terminated")
    assert collector.pop_episodes() == []


def test_each_car_drives_its_quota_of_whole_episodes():
    collector = Collector(Walk(4), a := a_learner(Walk(4)), horizon=5, seed=3)
    kept = collector.collect_episodes(3)
    ended = kept.terminated | kept.truncated
    learned = ended & kept.active
    assert_array_equal(learned.sum(axis=0), [3, 3, 3, 3])
    for n in range(4):
        last = np.flatnonzero(learned[:, n])[-1]
        assert kept.active[: last + 1, n].all()
        assert not kept.active[last + 1 :, n].any()
    assert a.update(kept)["transitions"] == kept.num_active
    again = collector.collect_episodes(3)
    assert_array_equal((again.active & (again.terminated | again.truncated)).sum(axis=0), [3] * 4)
    assert_array_equal(again.observations["clock"][0], np.zeros((4, 1)))


def test_storage_grows_and_forgets_nothing():
    grown, roomy = (Collector(Walk(3), Always(2), horizon=ticks, seed=3) for ticks in (2, 200))
    first, second = grown.collect_episodes(14), roomy.collect_episodes(14)  # 168 ticks: past the first room
    assert len(first.reward) == 14 * LIMIT
    for name, array in vars(first).items():
        if isinstance(array, dict):
            for part in array:
                assert_array_equal(array[part], vars(second)[name][part], part)
        else:
            assert_array_equal(array, vars(second)[name], name)


def test_a_horizon_that_grows_drives_the_same_and_is_as_long_in_a_resumed_training():
    growing, short = (Collector(Walk(2), Always(2), horizon=5, seed=3, longest_horizon=to) for to in (15, None))
    for _ in range(128):
        assert_array_equal(growing.collect().reward, short.collect().reward)
    state = growing.state()
    resumed = Collector(Walk(2), Always(2), horizon=5, seed=4, longest_horizon=15)
    resumed.restore(state)
    longer, again = growing.collect(), resumed.collect()
    clocks = [short.collect().observations["clock"].copy() for _ in range(2)]
    assert_array_equal(longer.observations["clock"], np.concatenate(clocks))
    assert_array_equal(longer.observations["clock"], again.observations["clock"])
    assert len(growing.collect().reward) == 10  # 20 would be more than the longest


def test_a_quota_after_a_horizon_and_back_is_no_muddle():
    collector = Collector(Walk(2), Always(2), horizon=7, seed=1)
    collector.collect()
    collector.collect_episodes(1)
    assert collector.collect().active.all()


def test_a_restored_training_goes_on_bit_by_bit_in_the_middle_of_an_episode():
    world = Walk(3, 2, masked=True)
    learner = a_learner(world)
    collector = Collector(world, learner, horizon=7, seed=5)
    learner.update(collector.collect())
    saved = {"learner": learner.state_dict(), "collector": collector.state()}

    other = Walk(3, 2, masked=True)
    twin = a_learner(other, seed=77)
    twin.load_state_dict(saved["learner"])
    resumed = Collector(other, twin, horizon=7, seed=6)
    resumed.restore(saved["collector"])
    collector.pop_episodes()
    for _ in range(3):
        assert learner.update(collector.collect()) == twin.update(resumed.collect())
        assert collector.pop_episodes() == resumed.pop_episodes()
    assert collector.steps_taken == resumed.steps_taken
    mine, its = learner.state_dict()["network"], twin.state_dict()["network"]
    assert all(torch.equal(mine[name], its[name]) for name in mine)


def test_a_world_that_loads_something_else_is_found_out():
    collector = Collector(Walk(2), Always(2), horizon=5, seed=1)
    collector.collect()
    state = collector.state()
    state["world"]["square"] = (state["world"]["square"] + 1) % 9
    with pytest.raises(ContractError, match="after load_state"):
        Collector(Walk(2), Always(2), horizon=5, seed=1).restore(state)


def test_masks_are_heeded_all_the_way():
    world = Walk(8, masked=True)
    kept = Collector(world, a_learner(world), horizon=64, seed=5).collect()
    assert not kept.action_mask.all()
    assert not kept.terminated.any()  # square 0 is out of reach
    assert kept.action_mask[np.arange(64)[:, None], np.arange(8)[None], kept.columns[RAW_ACTION]].all()


def test_observers_see_what_every_tick_wrote():
    seen = []

    def watch(world, shown, actions):
        seen.append((shown.observations["clock"][0, 0, 0], actions.shape))

    Collector(Walk(2, 3), Always(2), horizon=4, seed=1, observers=[watch]).collect()
    assert seen == [(t, (2, 3)) for t in range(1, 5)]


def test_each_beginning_has_chance_of_its_own_before_and_after_a_restore():
    class Noting(Walk):
        def reset(self, buffers, seed):
            seeds.append(seed)
            super().reset(buffers, seed)

    seeds = []
    collector = Collector(Noting(2), Always(2), horizon=5, seed=3)
    collector.collect_episodes(1)
    collector.collect_episodes(1)
    resumed = Collector(Noting(2), Always(2), horizon=5, seed=3)
    del seeds[-1]  # it began once to be there at all
    resumed.restore(collector.state(), anew=True)
    assert seeds == [3 + 1_000_003 * number for number in range(4)]


def test_an_episode_that_a_quota_broke_off_is_not_counted_in_the_next():
    class Beginning(Walk):
        """Tells its episodes from the start that `begin_episodes` gave them."""

        def begin_episodes(self, buffers):
            self.episode += 1
            self._begin(np.ones_like(self.square, bool))
            self._show(buffers.observations)
            self._allow(buffers)

    for world in (Beginning(2), Walk(2)):  # the second is reset
        collector = Collector(world, Always(2), horizon=7, seed=1)
        collector.collect()
        collector.collect_episodes(1)
        assert [told.steps for told in collector.pop_episodes()] == [LIMIT, LIMIT]


def test_a_world_that_shows_not_a_number_is_restored_all_the_same():
    class Blind(Walk):
        """Sees nothing of its square, as a scene does where a sensor has no answer."""

        def _show(self, named, rows=True):
            super()._show(named, rows)
            named["square"][:] = np.nan

    collector = Collector(Blind(2), Always(2), horizon=5, seed=1)
    collector.collect()
    resumed = Collector(Blind(2), Always(2), horizon=5, seed=1)
    resumed.restore(collector.state())
    assert_array_equal(resumed.collect().observations["clock"], collector.collect().observations["clock"])


# ---- counts, chance, and who is asked --------------------------------------------------------------------------------


class Parked(Walk):
    """Begins episodes where it is asked to, and leaves agents standing; choice 1 goes down, 2 stays."""

    def begin_episodes(self, buffers):
        self.standing = np.zeros_like(self.square, bool)
        self.episode += 1
        self._begin(np.ones_like(self.square, bool))
        self._show(buffers.observations)
        self._allow(buffers)

    def freeze(self, rows):
        self.standing = rows.copy()

    def step(self, actions, buffers):
        super().step(np.where(self.standing, 1, actions - 1), buffers)
        buffers.reward[self.standing], buffers.terminated[self.standing] = 0.0, False
        buffers.truncated[self.standing] = False


def test_who_has_played_its_quota_is_neither_asked_nor_told_nor_counted():
    """Going down from square s takes s ticks; then the agent stands, and its actions and columns are zeros."""
    actor = Always(1)
    collector = Collector(Parked(2, 2), actor, horizon=1, seed=1)
    kept = collector.collect_episodes(1)
    lengths = kept.observations["square"][0].argmax(axis=-1)
    assert len(set(lengths.tolist())) > 1
    assert len(kept.reward) == lengths.max()
    for t, asked in enumerate(actor.asked):
        going = np.flatnonzero(lengths > t)
        assert (asked is None) if len(going) == 4 else asked.tolist() == going.tolist()
        assert np.flatnonzero(kept.active[t]).tolist() == going.tolist()
        assert np.flatnonzero(kept.columns["noted"][t]).tolist() == going.tolist()
        assert np.flatnonzero(kept.actions[t]).tolist() == going.tolist()
    assert collector.steps_taken == lengths.sum()
    assert collector.state()["counts"]["parked_steps"] == lengths.max() * 4 - lengths.sum()
    collector.collect_episodes(1)
    assert actor.asked[len(kept.reward)] is None, "in the next round all are asked again"


def test_a_mask_is_shown_of_those_asked_alone():
    class Masked(Always):
        def act(self, observations, action_mask=None, **others):
            masks.append(None if action_mask is None else action_mask.copy())
            return super().act(observations, action_mask, **others)

    masks = []
    Collector(Walk(2, 2), Masked(2), 1, seed=1).collect()
    assert masks.pop() is None
    world = Parked(2, 2, masked=True)
    kept = Collector(world, Masked(1), 1, seed=1).collect_episodes(1)
    for t, mask in enumerate(masks):
        assert (mask == kept.action_mask[t][kept.active[t]]).all()
    assert {len(mask) for mask in masks} > {4}


def test_what_others_carried_is_taken_over_by_its_counts_alone():
    """Workers took 37 steps in 9 ticks of their own; six agents here would have taken 54."""
    there = Collector(Walk(3, 2), Always(2), horizon=5, seed=1)
    state = {"exploration": there.state()["exploration"], "counts": {"ticks_taken": 9, "resets": 4, "steps_taken": 37}}
    collector = Collector(Walk(3, 2), Always(2), horizon=5, seed=1)
    with pytest.raises(WorkerLayoutError, match="carried by workers"):
        collector.restore(state)
    collector.restore(state, anew=True)
    assert collector.steps_taken == 37
    assert int(collector.state()["counts"]["resets"]) == 5
    collector.collect()
    assert collector.steps_taken == 37 + 6 * 5


def test_a_run_that_was_kept_before_agents_were_parked_goes_on():
    whole, again = (Collector(Walk(2), Always(2), horizon=5, seed=1) for _ in range(2))
    whole.collect()
    state = whole.state()
    del state["counts"]["parked_steps"]
    again.restore(state)
    assert again.steps_taken == whole.steps_taken == 10


def test_the_chance_of_exploration_begins_with_the_seed_and_goes_on_where_it_was_kept():
    one, other = (Collector(Walk(2), Always(2), horizon=5, seed=seed) for seed in (3, 4))
    assert torch.equal(one.generator.get_state(), torch.Generator().manual_seed(3).get_state())
    torch.rand(5, generator=one.generator)
    for anew in (False, True):
        other.restore(one.state(), anew=anew)
        assert torch.equal(other.generator.get_state(), one.generator.get_state())


def test_somebody_may_look_meanwhile_and_break_off():
    collector, looks = Collector(Walk(2), Always(2), horizon=5, seed=1), []

    def look():
        looks.append(collector.ticks_taken)
        if len(looks) == 3:
            raise KeyboardInterrupt

    collector.set_poll_callback(look)
    with pytest.raises(KeyboardInterrupt):
        collector.collect()
    assert looks == [1, 2, 3]
