/* Where in a picture's record the answer behind a patch stands; nothing here draws. sight.py has the same order. */
export function placeOf(rows, columns, [top, left, height, width]) {
  let place = 0;
  for (let row = 0; row < top; row++) place += (rows - row) * columns * (columns + 1) / 2;
  for (let column = 0; column < left; column++) place += (rows - top) * (columns - column);
  return place + (height - 1) * (columns - left) + width - 1;
}
