"""A circuit: a K-row polyline of centre line and borders, its arc length, and where a point lies along it.

Begin in ``track.py``; `Track` is what every other package asks.

    track.py       a circuit: rows, arc, direction, where points lie, reversed
    kernels/       the same questions as scalar bodies, for other kernels
    style.py        its colours and painted lines
    catalogue/     the circuits that come with racecraft, found by name; `load_track` takes a name or a path
    importer.py    a route file of AWS form, looked at row by row
    picture.py     a circuit drawn, with paths on it

Metres and radians; x east, y north; a positive angle turns left. A row is a waypoint, counted from 0.
This package knows nothing of cars, learning or screens.
"""
