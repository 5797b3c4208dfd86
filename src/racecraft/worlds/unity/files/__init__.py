"""Files of ML-Agents.

trainer_yaml.py    its trainer configuration, read into the values of `trainer_config.py`
demonstrations.py  what a Unity scene recorded while somebody played: `.demo`
pictures.py        how it packs pictures, in demonstrations and on the wire
messages.py        the messages of its protocol and files, as one table
"""
