"""Files of ML-Agents.

trainer_yaml.py    its trainer configuration, read into the values of `trainer_config.py`
demonstrations.py  what a Unity scene recorded while somebody played: `.demo`
pictures.py        how it packs pictures, in demonstrations and on the wire
protobuf_wire.py   protobuf's bytes, read without protobuf
"""
