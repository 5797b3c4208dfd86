"""Templates, styles and modules of pages about cars; `racecraft.pages` finds them by this package's name.

live_cars.html   `<rc-cars>`: every car on the map, the chosen one's camera and figures, kept iterations
watch.html       the page of `racecraft watch` with it
telemetry_parts.html   a lap's map, traces, corners, laps; telemetry.html   the page of `racecraft telemetry` with them
ghosts.js        `<rc-ghosts>`: cars of several laps on the map
reel.js          what a reel holds at a moment     car_map.js   the map     cars.js   the element
"""
