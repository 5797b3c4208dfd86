"""Objects of S3 and of what speaks like it: folders up, folders down, a training mirrored while it goes on.

Begin with `transfer.py`.

    address.py       s3://bucket/prefix, and which keys may become files here
    access.py        where a bucket is and who asks: endpoint, profile, keys
    object_store.py  objects by boto3; what goes wrong there becomes an error of ours
    etags.py         whether a file is the object already
    transfer.py      whole folders, what names the rest last
    mirror.py        a run folder, kept in a bucket while it trains
"""
