"""Fast driving: what lap is possible on a track, with a car and its action table.

    road_frame.py     the road in arc length: smooth centre line, curvature, half widths
    racing_line.py    a line with a speed at every point
    lines.py          classical lines: centre, shortest, least curvature
    profile.py        the speed a car can hold along a line
    solver.py         minimum-time line and speed (CasADi and IPOPT, optional): an estimate
    guides.py         the lines a plan follows
    planner.py        a lap that is certainly driven: beam search in the compiled car, replayed in the world
    action_tables.py  action tables by a short text
    lap_times.py      all of these for one track, car and table
    line_file.py      a line as .csv, .npy or a Python list
    demand.py         turns, and what a table cannot give them
    action_design.py  the table that loses least time
    log_actions.py    which actions of a table a log chose
    known_laps.py     the best known laps, a table shipped with the package
    smoothness.py     changes of the commanded steering, and how often it changes sides
    reward/           what a reward function pays for, before a training and after it
    pace.py           what a judged drive says: fastest lap, gap, steering, limits beyond the logs

Begin with `planner.plan_best_lap`.
"""
