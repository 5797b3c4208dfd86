"""SageMaker's names for jobs of this machine: estimator, tuner, endpoint, templates. Begin with `estimator.py`.

Old notebooks run unchanged: buckets are folders, instances are processes, a role is a name that is only recorded.
"""
