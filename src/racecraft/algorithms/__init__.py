"""How policies improve: one algorithm, one page. Begin in `ppo.py`; `learner.py` says what every one of them promises.

    learner.py        what a learner promises the loop, the collector and the files
    registry.py       algorithms by name, a user's own among them
    policy_spec.py    what a stranger needs to rebuild a policy from its weights
    ppo.py            proximal policy optimisation: act, then learn from what was collected
    multi_policy.py   several learners, each with its own rows
    rollout_batch.py  what was collected, as a learner reads it
    returns.py        advantages and value targets; the two endings kept apart
    networks.py       from named observations to the parameters of actions and a value
    distributions.py  from those parameters to chosen actions and their likelihood
    actor_policy.py   the greedy policy of an actor network
    weights.py        between torch and the files

This room knows no particular world and no file. It is where torch comes in.
"""
