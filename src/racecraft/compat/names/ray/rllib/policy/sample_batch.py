"""`ray.rllib.policy.sample_batch`: a name that files of callbacks import; no batch is in RLlib's shape here."""


class SampleBatch:
    """What was collected; nothing here makes one."""


__all__ = ["SampleBatch"]
