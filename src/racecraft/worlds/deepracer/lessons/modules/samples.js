/* The source's three sample rewards; nothing here draws. */
const LIMITS = [[0.1, 1], [0.25, 0.5], [0.5, 0.1]], OUTSIDE = 0.001;

/* What the source's three samples pay: inside the borders, near the centre line, always. */
export function samples({ distance, width, onTrack }) {
  const near = LIMITS.find(([share]) => distance <= share * width);
  return [onTrack && 0.5 * width - distance >= 0.05 ? 1 : 0.001, near ? near[1] : OUTSIDE, 1];
}
