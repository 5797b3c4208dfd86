/* What a reel holds at a moment. A reel is T ticks of cars side by side (analysis/watching/playback.py); `head` is the
   moment that is shown, in ticks, with a share of a tick behind the point. Nothing here draws or asks. */

export const TICKS = 15;   // a second
const JUMP = 0.6;          // m: a car that moved further in a tick was set down elsewhere
const KEPT = 75;           // ticks that stay behind the head when a reel grows

/* Whether a car drove from tick i to the next, and was not set down elsewhere. */
export const drove = (car, i) => car.x[i + 1] != null && car.x[i] != null && car.episode[i] === car.episode[i + 1]
  && Math.hypot(car.x[i + 1] - car.x[i], car.y[i + 1] - car.y[i]) < JUMP;

/* Where a car is: x, y in m, yaw in rad; null while it is parked. */
export function pose(car, head) {
  const i = Math.floor(head), f = head - i, x = car.x[i];
  if (x == null) return null;
  const j = f && drove(car, i) ? i + 1 : i;
  const turn = j === i ? 0 : Math.atan2(Math.sin(car.yaw[j] - car.yaw[i]), Math.cos(car.yaw[j] - car.yaw[i]));
  return [x + f * (car.x[j] - x), car.y[i] + f * (car.y[j] - car.y[i]), car.yaw[i] + f * turn];
}

/* Where boxes and bots of a car's world stand; nothing where nobody wrote it down. */
export function standing(reel, car, head) {
  const told = car && reel.objects?.[car.world], now = Math.floor(head);
  return told?.findLast(([tick]) => tick <= now)?.[1] ?? [];
}

/* Let a reel go on with another that follows it; what lies long behind `played` is let go. Returns by how many ticks
   the numbers of its ticks fell. */
export function goOn(old, fresh, played) {
  const gone = Math.max(0, Math.min(old.ticks - 100, Math.floor(played) - KEPT));
  old.cars.forEach((car, c) => {
    for (const key of Object.keys(car)) if (Array.isArray(car[key])) car[key] = car[key].slice(gone).concat(fresh.cars[c][key]);
  });
  old.endings = old.endings.map(end => ({ ...end, tick: end.tick - gone })).filter(end => end.tick >= 0)
    .concat(fresh.endings.map(end => ({ ...end, tick: end.tick + old.ticks - gone })));
  for (const [world, later] of Object.entries(fresh.objects || {})) {   // of what lies behind, only where it stands now
    const all = (old.objects[world] || []).map(([tick, places]) => [tick - gone, places])
      .concat(later.map(([tick, places]) => [tick + old.ticks - gone, places]));
    old.objects[world] = all.slice(Math.max(0, all.findLastIndex(([tick]) => tick <= 0)));
  }
  old.ticks += fresh.ticks - gone;
  old.last = fresh.last;
  return gone;
}

/* Whether a reel follows another without a gap. */
export const follows = (fresh, old) => !!old && fresh.first === old.last + 1 && fresh.cars.length === old.cars.length;
