"""Boxes in a camera frame: each painted over what lies behind it, with exact area coverage. Begin at `draw_boxes`.

A box is drawn as one: the faces that are seen share their edges, so their coverages are summed, colour by colour, and
only the whole is laid over the picture; no background shines through between two faces of a box. The sums are sheets of
differences as in `kernels/camera.py`. Boxes are painted from back to front.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.worlds.deepracer.env.kernels.camera import LEVEL, add_edge

FIRST_OBJECT = 10
"""Material of the first kind of object (`scene.MATERIALS`)."""
NEAR_M = 0.02
"""What is nearer than this to the image plane is cut off (the original's near clip)."""
FULL = 16384
"""A pixel that is wholly covered, in the sheet of coverage."""
BLOCK = 32
"""Pixels side by side that are laid over together."""
SUN_X, SUN_Y = 0.6, -0.8
"""Where light comes from, over the ground; tops have all of it."""
SIDE_LIGHT, SUN_SHARE = 0.92, 0.12
"""A side has this share of a top's light, more where it faces the sun and less where it is turned away: in the
original a lit wall is as bright as lit ground (`light.py`), and an edge between two sides can be seen."""


@parallel_kernel
def paint_boxes(optics, boxes, kinds, poses, palettes, frames):
    """Paint boxes (R, K, 6) of kinds (R, K) over R frames (R, H, W, C), as `camera.render_frames` has made them."""
    one_each = np.int64(palettes.shape[0] > 1)
    middle = np.zeros(1)
    for place in prange(poses.shape[0]):
        row = np.int64(place)
        palette = palettes[np.int64(row) * one_each]
        for channel in range(palettes.shape[2]):
            draw_boxes(
                optics, boxes[row], kinds[row], poses[row, 0], poses[row, 1], poses[row, 2], middle,
                palette[:, channel], frames[row : row + 1, :, :, channel],
            )  # fmt: skip


@kernel
def draw_boxes(optics, boxes, kinds, x, y, yaw, eyes, palette, frames):
    """Paint a world's boxes (K, 6) over frames (E, H, W), one channel, of a car at (x, y, yaw) with eyes (E,), m left.

    The sheets are empty again when a box is laid over its frame, so that all boxes and eyes share them.
    """
    cosine, sine = math.cos(yaw), math.sin(yaw)
    seen = np.empty(boxes.shape[0], np.int64)
    sheets = np.zeros((2, 0, 0), np.int16)
    for eye in range(eyes.shape[0]):
        eye_x = x - sine * eyes[eye] + cosine * optics.mount_x
        eye_y = y + cosine * eyes[eye] + sine * optics.mount_x
        count = 0
        for k in range(boxes.shape[0]):
            if may_be_seen(optics, boxes[k], eye_x, eye_y, cosine, sine):
                seen[count] = k
                count += 1
        if count == 0:
            continue
        if sheets.shape[1] == 0:
            sheets = np.zeros((2, frames.shape[1] + 1, frames.shape[2]), np.int16)
        sort_back_to_front(boxes, seen[:count], eye_x, eye_y)
        for index in range(count):
            k = seen[index]
            level = palette[FIRST_OBJECT + kinds[k]]
            bounds = add_box(sheets[0], sheets[1], optics, boxes[k], eye_x, eye_y, cosine, sine, level)
            lay_over(frames[eye], sheets[0], sheets[1], *bounds)


@kernel
def may_be_seen(optics, box, eye_x, eye_y, cosine, sine):
    """Tell whether a circle round a box reaches into what the camera sees."""
    dx, dy = box[0] - eye_x, box[1] - eye_y
    radius = math.hypot(box[3], box[4])
    depth = (dx * cosine + dy * sine) * optics.cos_pitch + optics.mount_z * optics.sin_pitch  # of its foot: the deepest
    left = dy * cosine - dx * sine
    return depth + radius > NEAR_M and abs(left) - optics.side * depth <= radius * optics.side_norm


@kernel
def sort_back_to_front(boxes, seen, eye_x, eye_y):
    """Order boxes so that none is painted before one that it hides: of those left, the farthest that hides none."""
    count = seen.shape[0]
    for place in range(count - 1):
        chosen, farthest = place, -1.0
        for index in range(place, count):
            box = boxes[seen[index]]
            distance = math.hypot(box[0] - eye_x, box[1] - eye_y)
            if distance <= farthest:
                continue
            hides_none = True
            for other in range(place, count):
                if other != index and not stands_before(boxes[seen[other]], box, eye_x, eye_y):
                    hides_none = False
                    break
            if hides_none:
                chosen, farthest = index, distance
        seen[place], seen[chosen] = seen[chosen], seen[place]


@kernel
def stands_before(box, other, eye_x, eye_y):
    """Tell whether the other cannot hide a box: a line along a side of one of the two has eye and box on one side."""
    return parts(box, other, eye_x, eye_y, True) or parts(other, box, eye_x, eye_y, False)


@kernel
def parts(box, other, eye_x, eye_y, eye_inside):
    """Tell whether the line along a side of a box has the other wholly beyond it, and the eye on the side asked for."""
    cos, sin = math.cos(box[2]), math.sin(box[2])
    other_cos, other_sin = math.cos(other[2]), math.sin(other[2])
    along = abs(cos * other_cos + sin * other_sin)
    across = abs(cos * other_sin - sin * other_cos)
    dx, dy = other[0] - box[0], other[1] - box[1]
    ex, ey = eye_x - box[0], eye_y - box[1]
    for axis in range(2):
        if axis == 0:
            gap, eye, half = dx * cos + dy * sin, ex * cos + ey * sin, box[3]
            reach = other[3] * along + other[4] * across
        else:
            gap, eye, half = dy * cos - dx * sin, ey * cos - ex * sin, box[4]
            reach = other[3] * across + other[4] * along
        if abs(gap) - reach >= half:
            beyond = eye > half if gap > 0.0 else eye < -half
            if beyond != eye_inside:
                return True
    return False


@kernel
def add_box(coverage, colours, optics, box, eye_x, eye_y, cosine, sine, level):
    """Add the faces of a box that are seen to both sheets; return the rows and columns that they lie in."""
    cos, sin = math.cos(box[2]), math.sin(box[2])
    ex, ey = eye_x - box[0], eye_y - box[1]
    ahead, aside = ex * cos + ey * sin, ey * cos - ex * sin  # the eye, seen from the box
    bounds = np.array([math.inf, -math.inf, math.inf, -math.inf])
    corners = np.empty((4, 3))
    for face in range(4):  # ahead, left, behind, right
        outwards = (
            ahead - box[3]
            if face == 0
            else aside - box[4]
            if face == 1
            else (-ahead - box[3] if face == 2 else -aside - box[4])
        )
        if outwards <= 0.0:
            continue
        turn = box[2] + 0.5 * math.pi * face
        light = SIDE_LIGHT + SUN_SHARE * (SUN_X * math.cos(turn) + SUN_Y * math.sin(turn))
        # Seen from outside the face's left end comes first, clockwise on the picture: up, across, down.
        for corner in range(4):
            at_left_end = corner < 2
            turns = face + 3 if at_left_end else face
            along = box[3] if turns % 4 == 0 or turns % 4 == 3 else -box[3]
            across = box[4] if turns % 4 < 2 else -box[4]
            corners[corner, 0] = box[0] + along * cos - across * sin
            corners[corner, 1] = box[1] + along * sin + across * cos
            corners[corner, 2] = box[5] if corner == 1 or corner == 2 else 0.0
        add_face(coverage, colours, optics, corners, eye_x, eye_y, cosine, sine, level * light, bounds)
    if optics.mount_z > box[5]:
        for corner in range(4):  # clockwise from above
            along = box[3] if corner == 0 or corner == 3 else -box[3]
            across = box[4] if corner == 0 or corner == 1 else -box[4]
            place = 3 - corner
            corners[place, 0] = box[0] + along * cos - across * sin
            corners[place, 1] = box[1] + along * sin + across * cos
            corners[place, 2] = box[5]
        add_face(coverage, colours, optics, corners, eye_x, eye_y, cosine, sine, level, bounds)
    height, width = coverage.shape[0] - 1, coverage.shape[1]
    if bounds[0] > bounds[1]:
        return 0, 0, 0, 0
    top, bottom = int(min(max(bounds[0], 0.0), height)), int(min(max(bounds[1] + 1.0, 0.0), height))
    left, right = int(min(max(bounds[2], 0.0), width)), int(min(max(bounds[3] + 1.0, 0.0), width))
    return top, bottom, left, right


@kernel
def add_face(coverage, colours, optics, corners, eye_x, eye_y, cosine, sine, level, bounds):
    """Add one face (4, 3) to both sheets, cut at the near plane; widen `bounds` (y low, high, x low, high)."""
    weight = int(min(max(level, 0.0), 255.0) * LEVEL + 0.5)
    seen = np.empty((4, 3))
    for corner in range(4):
        dx, dy = corners[corner, 0] - eye_x, corners[corner, 1] - eye_y
        dz = corners[corner, 2] - optics.mount_z
        ahead = dx * cosine + dy * sine
        left = dy * cosine - dx * sine
        down = -ahead * optics.sin_pitch - dz * optics.cos_pitch
        if optics.sin_roll != 0.0:
            left, down = (
                optics.cos_roll * left - optics.sin_roll * down, optics.cos_roll * down + optics.sin_roll * left
            )  # fmt: skip
        seen[corner, 0] = ahead * optics.cos_pitch - dz * optics.sin_pitch
        seen[corner, 1], seen[corner, 2] = left, down
    image = np.empty((6, 2))
    kept = 0
    for corner in range(4):
        after = (corner + 1) % 4
        depth, next_depth = seen[corner, 0], seen[after, 0]
        if depth >= NEAR_M:
            image[kept, 0] = optics.middle_x - optics.focal * seen[corner, 1] / depth
            image[kept, 1] = optics.middle_y + optics.focal * seen[corner, 2] / depth
            kept += 1
        if (depth >= NEAR_M) != (next_depth >= NEAR_M):
            share = (NEAR_M - depth) / (next_depth - depth)
            left = seen[corner, 1] + share * (seen[after, 1] - seen[corner, 1])
            down = seen[corner, 2] + share * (seen[after, 2] - seen[corner, 2])
            image[kept, 0] = optics.middle_x - optics.focal * left / NEAR_M
            image[kept, 1] = optics.middle_y + optics.focal * down / NEAR_M
            kept += 1
    for corner in range(kept):
        px, py = image[corner, 0], image[corner, 1]
        qx, qy = image[(corner + 1) % kept, 0], image[(corner + 1) % kept, 1]
        add_edge((coverage, colours), px, py, qx, qy, (FULL, weight))
        bounds[0], bounds[1] = min(bounds[0], py), max(bounds[1], py)
        bounds[2], bounds[3] = min(bounds[2], px), max(bounds[3], px)


@kernel
def lay_over(frame, coverage, colours, top, bottom, left, right):
    """Sum both sheets down their columns, lay the colours over the frame by their coverage; leave the sheets empty.

    Columns are taken in whole blocks, so that none of a row is left over from those worked on at a time: beside the box
    both sheets are empty, and a pixel there keeps its level.
    """
    left, right = left // BLOCK * BLOCK, min((right + BLOCK - 1) // BLOCK * BLOCK, frame.shape[1])
    covered, coloured = np.zeros(right - left, np.int16), np.zeros(right - left, np.int16)
    for row in range(top, bottom):
        pixels = frame[row, left:right]
        of_coverage, of_colours = coverage[row, left:right], colours[row, left:right]
        for column in range(right - left):
            share = np.int16(covered[column] + of_coverage[column])
            colour = np.int16(coloured[column] + of_colours[column])
            covered[column], coloured[column] = share, colour
            of_coverage[column] = of_colours[column] = 0
            under, over = np.int32(pixels[column]) * np.int32(FULL - share), np.int32(colour) * np.int32(FULL // LEVEL)
            level = (under + over + np.int32(FULL // 2)) >> 14
            pixels[column] = np.uint8(min(max(level, 0), 255))  # type: ignore[arg-type]
    coverage[bottom, left:right] = 0
    colours[bottom, left:right] = 0


@kernel
def is_in_frame(optics, box, x, y, yaw):
    """Tell whether a corner of a box's rectangle or its middle, at half its height, is in what the camera sees."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    cos, sin = math.cos(box[2]), math.sin(box[2])
    dz = 0.5 * box[5] - optics.mount_z
    for corner in range(5):
        along = 0.0 if corner == 4 else box[3] if corner < 2 else -box[3]
        across = 0.0 if corner == 4 else box[4] if corner % 2 == 0 else -box[4]
        dx = box[0] + along * cos - across * sin - x - cosine * optics.mount_x
        dy = box[1] + along * sin + across * cos - y - sine * optics.mount_x
        ahead = dx * cosine + dy * sine
        depth = ahead * optics.cos_pitch - dz * optics.sin_pitch
        down = -ahead * optics.sin_pitch - dz * optics.cos_pitch
        left = dy * cosine - dx * sine
        if optics.sin_roll != 0.0:
            left, down = (
                optics.cos_roll * left - optics.sin_roll * down, optics.cos_roll * down + optics.sin_roll * left
            )  # fmt: skip
        side = optics.middle_x / optics.focal
        if depth > NEAR_M and abs(left) <= depth * side and abs(down) * optics.focal <= depth * optics.middle_y:
            return True
    return False
