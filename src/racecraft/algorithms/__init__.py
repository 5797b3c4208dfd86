"""How policies improve: one algorithm, one page. Begin in `ppo.py`; `learner.py` says what every one of them promises.

    learner.py        what a learner promises the loop, the collector and the files
    registry.py       algorithms by name, a user's own among them
    policy_spec.py    what a stranger needs to rebuild a policy from its weights
    ppo.py            proximal policy optimisation: act, then learn from what was collected
    ppo_config.py     its settings
    dqn.py            deep Q-learning: learn what each choice is worth from all that is remembered
    apex.py           DQN with many unlike actors and a learner beside them
    multi_policy.py   several learners, each with its own rows
    rollout_batch.py  what was collected, as a learner reads it
    replay_sampler.py what a learner that eats a replay is fed
    returns.py        advantages and value targets; the two endings kept apart
    networks.py       from named observations to the parameters of actions and a value
    convolution.py    a convolution that goes no detours, for a few frames and in bfloat16
    distributions.py  from those parameters to chosen actions and their likelihood
    actor_policy.py   the greedy policy of an actor network
    q_network.py      from named observations to what each choice is worth, and the policy that takes the best
    weights.py        between torch and the files

This package knows no particular world and no file. It is where torch comes in.
"""
