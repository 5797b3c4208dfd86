"""Fair judgement.

episodes.py       let a policy play whole episodes
laps.py           judge a driver by laps
drive.py          watch one car, tick by tick
bench_world.py    how fast the car world is
replay_report.py  what real logs say of our car and our geometry
"""
