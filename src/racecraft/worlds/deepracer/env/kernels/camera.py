"""One camera frame, as a kernel: edges between materials, each with exact area coverage. Begin at `render_frame`.

The ground of a circuit is a partition into plainly coloured polygons, so a pixel is Σ share x colour, and stepping
from one material to its neighbour at an edge changes the sum by (share of the pixel below the edge) x (difference of
the colours). `add_edge` writes these changes into a sheet of differences; one running sum down each column turns the
sheet into the frame. Shares are exact areas (a box filter of one pixel), no texture is sampled, and nothing is
painted twice: the cost is that of the edges in sight and of one pass over the pixels that runs on vector units.

Differences are integers (1/64 grey level) and an edge's steps add up without remainder, so the order of the edges
does not matter and nothing drifts down a column.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import inner_kernel, kernel, parallel_kernel, prange

LEVEL = 64
"""Parts of one grey level in the sheet of differences; int16 holds twice the range of a colour."""

SKY = 9
FIELD = 0
FIRST_WALL = 5
GRASS_CELL_M = 0.012
"""Spots of grass of this size have one shade."""
GRASS_CELLS = 1.0 / GRASS_CELL_M
"""Such spots in a metre."""
GRASS_BLADE_M = 0.35
"""A patch so long on the ground shows the grain by half its variance."""
WALL_NEAR_M = 0.02
"""Walls nearer than this to the image plane are cut off (the original's near clip)."""


@parallel_kernel
def render_frames(scene, optics, poses, palettes, frames):
    """Render R frames (R, H, W, C) uint8 from poses (R, 3), each with its palette (R or 1, M, C) of levels 0 to 255."""
    one_each = np.int64(palettes.shape[0] > 1)
    for place in prange(poses.shape[0]):
        row = np.int64(place)
        palette = palettes[np.int64(row) * one_each]
        for channel in range(palettes.shape[2]):
            render_frame(
                scene, optics, poses[row, 0], poses[row, 1], poses[row, 2], palette[:, channel],
                frames[row, :, :, channel],
            )  # fmt: skip


@parallel_kernel
def render_grey_frames(scene, optics, poses, palettes, frames):
    """Render R grey frames (R, H, W) uint8 from poses (R, 3), each with its palette (R or 1, M)."""
    one_each = np.int64(palettes.shape[0] > 1)
    for place in prange(poses.shape[0]):
        row = np.int64(place)
        palette = palettes[np.int64(row) * one_each]
        render_frame(scene, optics, poses[row, 0], poses[row, 1], poses[row, 2], palette, frames[row])


@kernel
def render_frame(scene, optics, x, y, yaw, palette, frame):
    """Write what a car at (x, y, yaw) sees into frame (H, W), uint8, in one channel.

    Args:
        scene: Scene.
        optics: Optics.
        x: Of base_link, m.
        y: Of base_link, m.
        yaw: rad, left positive.
        palette: (M,) level of each material, 0 to 255.
        frame: (H, W) uint8, written.
    """
    height, width = frame.shape
    differences = np.zeros((1, height + 1, width), np.int16)
    levels = np.empty(palette.shape[0], np.int32)
    for material in range(levels.shape[0]):
        levels[material] = int(palette[material] * LEVEL + 0.5)
    cosine, sine = math.cos(yaw), math.sin(yaw)
    eye_x = x + cosine * optics.mount_x
    eye_y = y + sine * optics.mount_x
    add_ground(differences, scene, optics, eye_x, eye_y, cosine, sine, np.zeros(1), levels)
    add_backdrop(differences[0], scene, optics, eye_x, eye_y, cosine, sine, levels)
    sum_columns(differences[0], levels[SKY], frame)
    if optics.grain > 0.0:
        grow_grass(frame, scene, optics, eye_x, eye_y, cosine, sine, palette[FIELD])


@kernel
def grow_grass(frame, scene, optics, eye_x, eye_y, cosine, sine, level):
    """Give the pixels that are wholly field the grain of grass; what lies on the field keeps its edges.

    For each row it is worked out first where its pixels look, and then what grows there, many pixels at a time.
    """
    height, width = frame.shape
    if optics.sin_roll != 0.0:
        grow_grass_aslant(frame, scene, optics, eye_x, eye_y, cosine, sine, level)
        return
    sides, xs, ys, spreads = np.empty(width), np.empty(width), np.empty(width), np.empty(width)
    for column in range(width):
        sides[column] = (optics.middle_x - column - 0.5) / optics.focal
    for row in range(height):
        slope = (row + 0.5 - optics.middle_y) / optics.focal
        drop = optics.sin_pitch + slope * optics.cos_pitch
        if drop <= 1e-3:
            continue
        depth = optics.mount_z / drop
        ahead = depth * (optics.cos_pitch - slope * optics.sin_pitch)
        # A pixel sees the mean over a patch that is this long on the ground.
        patch = depth / (optics.focal * drop)
        spreads[:] = optics.grain * math.sqrt(12.0 / (1.0 + patch / GRASS_BLADE_M))
        for column in range(width):
            left = sides[column] * depth
            xs[column] = eye_x + cosine * ahead - sine * left
            ys[column] = eye_y + sine * ahead + cosine * left
        grow_row(frame[row], scene.field_corners, level, xs, ys, spreads)


@kernel
def grow_grass_aslant(frame, scene, optics, eye_x, eye_y, cosine, sine, level):
    """The same through a camera that leans to a side: no two pixels of a row are equally far.

    How much of the grain a pixel shows needs fewer digits than where it looks.
    """
    height, width = frame.shape
    rights, xs, ys, spreads = np.empty(width), np.empty(width), np.empty(width), np.empty(width)
    one, blades = np.float32(1.0), np.float32(1.0 / (optics.focal * GRASS_BLADE_M))
    most = np.float32(12.0 * optics.grain * optics.grain)
    for column in range(width):
        rights[column] = (column + 0.5 - optics.middle_x) / optics.focal
    for row in range(height):
        below = (row + 0.5 - optics.middle_y) / optics.focal
        for column in range(width):
            right = rights[column]
            aside = optics.sin_roll * below - optics.cos_roll * right
            slope = optics.cos_roll * below + optics.sin_roll * right
            drop = optics.sin_pitch + slope * optics.cos_pitch
            is_ground = drop > 1e-3
            drop = drop if is_ground else 1.0
            depth = optics.mount_z / drop
            ahead, left = depth * (optics.cos_pitch - slope * optics.sin_pitch), depth * aside
            spreads[column] = np.sqrt(most / (one + blades * np.float32(depth) / np.float32(drop)))
            xs[column] = eye_x + cosine * ahead - sine * left if is_ground else math.inf
            ys[column] = eye_y + sine * ahead + cosine * left
        grow_row(frame[row], scene.field_corners, level, xs, ys, spreads)


@kernel
def grow_row(pixels, corners, level, xs, ys, spreads):
    """Give the pixels of a row (W,) the shade of the spot of field that each sees, if the field reaches there.

    Args:
        pixels: (W,) uint8, changed where they show the field's own level.
        corners: (4, 2) of the field, m.
        level: Of the field, 0 to 255.
        xs: (W,) where each pixel looks at the ground, m.
        ys: (W,) likewise.
        spreads: (W,) how far the shades of spots lie apart there, levels.
    """
    plain = min(max(int(level + 0.5), 0), 255)
    west, south, east, north = corners[0, 0], corners[0, 1], corners[2, 0], corners[2, 1]
    for column in range(pixels.shape[0]):
        x, y, pixel = xs[column], ys[column], pixels[column]
        is_field = (abs(int(pixel) - plain) <= 1) & (west < x) & (x < east) & (south < y) & (y < north)
        shade = level + spreads[column] * grass_shade(math.floor(x * GRASS_CELLS), math.floor(y * GRASS_CELLS))
        grown = np.uint8(min(max(int(shade + 0.5), 0), 255))
        pixels[column] = grown if is_field else pixel


@kernel
def grass_shade(cell_x, cell_y):
    """Return what a spot of the field differs by, -0.5 to 0.5, evenly spread; the same from wherever it is seen."""
    mixed = np.uint32(np.int64(cell_x) * 73856093 ^ np.int64(cell_y) * 19349663)
    mixed = np.uint32((mixed ^ (mixed >> np.uint32(15))) * np.uint32(2246822519))
    mixed = np.uint32((mixed ^ (mixed >> np.uint32(13))) * np.uint32(3266489917))
    return np.float64(mixed ^ (mixed >> np.uint32(16))) / 4294967296.0 - 0.5


@kernel
def sum_columns(differences, start, frame):
    """Turn differences into grey levels: add them up down each column, from `start` above the frame."""
    height, width = frame.shape
    sums = np.full(width, start + LEVEL // 2, np.int16)
    for row in range(height):
        for column in range(width):
            total = np.int16(sums[column] + differences[row, column])
            sums[column] = total
            level = np.int16(total >> 6)
            frame[row, column] = np.uint8(min(max(level, np.int16(0)), np.int16(255)))


@kernel
def add_ground(differences, scene, optics, eye_x, eye_y, cosine, sine, beside, levels):
    """Add the edges of all ground polygons in sight of any eye to its sheet of differences (E, H + 1, W).

    Eyes that lie `beside` (E,) of each other, m to the left, see a point of the ground at one depth and in one row.
    """
    depth_at_foot = optics.mount_z * optics.sin_pitch
    farthest = np.abs(beside).max()
    points = np.empty((scene.vertices.shape[0], 6))  # of which each chunk takes the first few
    for chunk in range(scene.chunks.shape[0]):
        dx, dy = scene.circles[chunk, 0] - eye_x, scene.circles[chunk, 1] - eye_y
        radius = scene.circles[chunk, 2]
        depth = (dx * cosine + dy * sine) * optics.cos_pitch + depth_at_foot
        left = abs(dy * cosine - dx * sine) - farthest
        if depth + radius < optics.ground_near or left - optics.side * depth > radius * optics.side_norm:
            continue
        weight = levels[scene.chunks[chunk, 2]] - levels[scene.chunks[chunk, 3]]
        if weight == 0:
            continue
        first, last = scene.chunks[chunk, 0], scene.chunks[chunk, 1]
        place_points(points, scene.vertices[first : last + 1], optics, eye_x, eye_y, cosine, sine)
        for eye in range(beside.shape[0]):
            add_points((differences[eye],), points[: last + 1 - first], optics, beside[eye], (weight,))


@kernel
def place_points(points, vertices, optics, eye_x, eye_y, cosine, sine):
    """Write depth, left and down (m), column and row, and pixels a metre (P, 6) of points on the ground (P, 2).

    Where depth is less than that of any ground in the frame, the last three mean nothing.
    """
    depth_at_foot, down_at_foot = optics.mount_z * optics.sin_pitch, optics.mount_z * optics.cos_pitch
    for vertex in range(vertices.shape[0]):
        dx, dy = vertices[vertex, 0] - eye_x, vertices[vertex, 1] - eye_y
        ahead = dx * cosine + dy * sine
        left = dy * cosine - dx * sine
        depth = ahead * optics.cos_pitch + depth_at_foot
        down = down_at_foot - ahead * optics.sin_pitch
        if optics.sin_roll != 0.0:
            left, down = (
                optics.cos_roll * left - optics.sin_roll * down, optics.cos_roll * down + optics.sin_roll * left
            )  # fmt: skip
        scale = optics.focal / depth
        points[vertex, 0], points[vertex, 1], points[vertex, 2] = depth, left, down
        points[vertex, 3], points[vertex, 4] = optics.middle_x - left * scale, optics.middle_y + down * scale
        points[vertex, 5] = scale


@kernel
def add_points(sheets, points, optics, beside, weights):
    """Add the edges from point to point (P, 6) as an eye `beside` m further left sees them, cut at the near plane."""
    near = optics.ground_near
    for vertex in range(1, points.shape[0]):
        old_depth, depth = points[vertex - 1, 0], points[vertex, 0]
        if depth < near and old_depth < near:
            continue
        from_x, from_y = points[vertex - 1, 3] + beside * points[vertex - 1, 5], points[vertex - 1, 4]
        to_x, to_y = points[vertex, 3] + beside * points[vertex, 5], points[vertex, 4]
        if depth < near or old_depth < near:  # the edge begins or ends where it meets the near plane
            share = (near - old_depth) / (depth - old_depth)
            scale = optics.focal / near
            left = points[vertex - 1, 1] + share * (points[vertex, 1] - points[vertex - 1, 1])
            down = points[vertex - 1, 2] + share * (points[vertex, 2] - points[vertex - 1, 2])
            cut_x, cut_y = optics.middle_x - left * scale + beside * scale, optics.middle_y + down * scale
            if depth < near:
                to_x, to_y = cut_x, cut_y
            else:
                from_x, from_y = cut_x, cut_y
        add_edge(sheets, from_x, from_y, to_x, to_y, weights)


@kernel
def add_backdrop(differences, scene, optics, eye_x, eye_y, cosine, sine, levels):
    """Add the field's rectangle and the inner faces of its walls, before the sky."""
    corners = scene.field_corners
    height = scene.wall_height
    polygon = np.empty((4, 3))
    for corner in range(4):  # clockwise from above, which is how a filled ring runs
        polygon[corner, 0], polygon[corner, 1], polygon[corner, 2] = corners[3 - corner, 0], corners[3 - corner, 1], 0.0
    add_polygon(
        differences, optics, polygon, eye_x, eye_y, cosine, sine, optics.ground_near, levels[FIELD] - levels[SKY]
    )
    if height <= 0.0:
        return
    for wall in range(4):
        ax, ay = corners[wall, 0], corners[wall, 1]
        bx, by = corners[(wall + 1) % 4, 0], corners[(wall + 1) % 4, 1]
        if (bx - ax) * (eye_y - ay) - (by - ay) * (eye_x - ax) <= 0.0:
            continue  # seen from behind: from outside one looks through
        for corner in range(4):
            at_b = corner == 0 or corner == 1
            polygon[corner, 0] = bx if at_b else ax
            polygon[corner, 1] = by if at_b else ay
            polygon[corner, 2] = height if corner == 1 or corner == 2 else 0.0
        weight = levels[FIRST_WALL + wall] - levels[SKY]
        add_polygon(differences, optics, polygon, eye_x, eye_y, cosine, sine, WALL_NEAR_M, weight)


@kernel
def add_polygon(differences, optics, polygon, eye_x, eye_y, cosine, sine, near, weight):
    """Add a convex polygon (P, 3) of points in the world, cut at the near plane."""
    if weight == 0:
        return
    count = polygon.shape[0]
    image = np.empty((count + 2, 2))
    kept = 0
    for corner in range(count):
        depth, left, down = into_camera(optics, polygon[corner], eye_x, eye_y, cosine, sine)
        next_depth, next_left, next_down = into_camera(
            optics, polygon[(corner + 1) % count], eye_x, eye_y, cosine, sine
        )
        if depth >= near:
            image[kept, 0] = optics.middle_x - optics.focal * left / depth
            image[kept, 1] = optics.middle_y + optics.focal * down / depth
            kept += 1
        if (depth >= near) != (next_depth >= near):
            share = (near - depth) / (next_depth - depth)
            image[kept, 0] = optics.middle_x - optics.focal * (left + share * (next_left - left)) / near
            image[kept, 1] = optics.middle_y + optics.focal * (down + share * (next_down - down)) / near
            kept += 1
    sheets, weights = (differences,), (weight,)
    for corner in range(kept):
        after = (corner + 1) % kept
        add_edge(sheets, image[corner, 0], image[corner, 1], image[after, 0], image[after, 1], weights)


@kernel
def into_camera(optics, point, eye_x, eye_y, cosine, sine):
    """Return depth, left and down of a point of the world in the camera's frame, m."""
    dx, dy, dz = point[0] - eye_x, point[1] - eye_y, point[2] - optics.mount_z
    ahead = dx * cosine + dy * sine
    depth = ahead * optics.cos_pitch - dz * optics.sin_pitch
    down = -ahead * optics.sin_pitch - dz * optics.cos_pitch
    left = dy * cosine - dx * sine
    if optics.sin_roll != 0.0:
        left, down = optics.cos_roll * left - optics.sin_roll * down, optics.cos_roll * down + optics.sin_roll * left
    return depth, left, down


@inner_kernel
def add_edge(sheets, x0, y0, x1, y1, weights):
    """Add a weight x the area below the edge from (x0, y0) to (x1, y1), in pixels, y down, to each sheet.

    An edge that runs right adds, one that runs left subtracts: a ring that is clockwise on the picture fills itself.
    Whatever lies left, right or below of the frame costs nothing; what lies above counts from the first row.

    `sheets` are as many int16 (H + 1, W) as there are `weights`, whole numbers: where the edge runs is worked out once
    for all of them.
    """
    height, width = sheets[0].shape[0] - 1, sheets[0].shape[1]
    if y0 >= height and y1 >= height:
        return
    sign = 1
    if x1 < x0:
        x0, y0, x1, y1 = x1, y1, x0, y0
        sign = -1
    if x1 <= 0.0 or x0 >= width or x1 == x0:
        return
    slope = (y1 - y0) / (x1 - x0)
    if x0 < 0.0:
        y0 -= slope * x0
        x0 = 0.0
    if x1 > width:
        x1 = float(width)
        y1 = y0 + slope * (x1 - x0)
    if y0 > height:
        if y1 >= height:
            return
        x0 += (height - y0) / slope
        y0 = float(height)
    elif y1 > height:
        if y0 >= height:
            return
        x1 = x0 + (height - y0) / slope
        y1 = float(height)
    left_x, left_y = x0, y0
    column = int(x0)
    while left_x < x1 and column < width:
        right_x = float(column + 1)
        if right_x < x1:
            right_y = y0 + slope * (right_x - x0)
        else:
            right_x, right_y = x1, y1
        top, bottom = min(left_y, right_y), max(left_y, right_y)
        row = int(top)
        if top >= 0.0 and bottom < row + 1:
            if row < height:
                change_pixel(sheets, row, column, left_x, right_x, 0.5 * (top + bottom) - row, weights, sign)
        elif bottom <= 0.0:
            change_pixel(sheets, 0, column, left_x, right_x, 0.0, weights, sign)
        elif left_y <= right_y:
            add_steep(sheets, column, left_x, left_y, right_x, right_y, weights, sign)
        else:
            add_steep(sheets, column, right_x, right_y, left_x, left_y, weights, -sign)
        left_x, left_y = right_x, right_y
        column += 1


@kernel
def add_steep(sheets, column, top_x, top_y, bottom_x, bottom_y, weights, sign):
    """Add the part of an edge within one column that crosses rows, from its top to its bottom."""
    height = sheets[0].shape[0] - 1
    drift = (bottom_x - top_x) / (bottom_y - top_y)
    y, x = top_y, top_x
    if top_y < 0.0:
        x = top_x - drift * top_y
        y = 0.0
        change_pixel(sheets, 0, column, top_x, x, 0.0, weights, sign)
    row = int(y)
    while row < height:
        is_last = bottom_y <= row + 1
        next_y = bottom_y if is_last else float(row + 1)
        next_x = bottom_x if is_last else top_x + drift * (next_y - top_y)
        change_pixel(sheets, row, column, x, next_x, 0.5 * (y + next_y) - row, weights, sign)
        if is_last:
            break
        y, x = next_y, next_x
        row += 1


@inner_kernel
def change_pixel(sheets, row, column, left_x, right_x, above, weights, sign):
    """Let what lies below an edge begin in a pixel, between two places across it; so much of it only a row below."""
    at, under, here = np.uint64(row), np.uint64(row + 1), np.uint64(column)
    for sheet, weight in zip(sheets, weights):  # noqa: B905 (Numba knows no strict)
        change = sign * (int(right_x * weight) - int(left_x * weight))
        lower = int(change * above)
        sheet[at, here] += change - lower
        sheet[under, here] += lower
