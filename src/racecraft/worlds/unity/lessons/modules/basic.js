/* Unity's Basic, exactly as env/basic_scene.py has it; nothing here draws. */
export const PLACES = 20, START = 10, MOST_STEPS = 100, STAY = 0, LEFT = 1, RIGHT = 2;
const MOVES = [0, -1, 1], STEP_REWARD = -0.01, GOALS = { 7: 0.1, 17: 1 };

/* What comes of actions from the start; those behind an end are not carried out. */
export function play(actions) {
  const places = [START];
  let total = 0, ended = false;
  for (const action of actions) {
    const place = places.at(-1) + MOVES[action], goal = GOALS[place];
    places.push(place);
    total += STEP_REWARD + (goal ?? 0);
    ended = goal !== undefined;
    if (ended) break;
  }
  return { places, place: places.at(-1), steps: places.length - 1, total, ended };
}

export const prizeAt = place => GOALS[place];
