"""A CloudFormation template's local equivalent.

    stack.py      a template worked out: buckets, notebooks, every resource's fate, outputs
    addresses.py  the cloud's addresses as addresses of this machine
    create.py     the folders and files, and the record by which scripts find them again

Begin with `stack.py`, then `create.py`.
"""
