"""Judge a car: by laps, by recorded races told again and driven again, by the speed of the world.

laps.py           judge a driver by laps
drive.py          watch one car, tick by tick
replay_report.py  what real logs say of our car and our geometry
recorded_car.py   which car drove, told from recordings alone
bench_world.py    how fast the car world is
"""
