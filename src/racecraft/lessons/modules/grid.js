/* The grid world of lessons 2 to 6, exactly as models/grid.py and models/chance.py have it; nothing here draws. */

export const MOVES = ["left", "straight", "right"], TURN = [-1, 0, 1], MOST_MOVES = 200;

/* Random numbers: Mulberry32. */
export class Chance {
  constructor(seed) { this.state = seed >>> 0; }
  share() {
    this.state = (this.state + 0x6D2B79F5) >>> 0;
    let mixed = this.state;
    mixed = Math.imul(mixed ^ (mixed >>> 15), mixed | 1) >>> 0;
    mixed = (mixed ^ ((mixed + (Math.imul(mixed ^ (mixed >>> 7), mixed | 61) >>> 0)) >>> 0)) >>> 0;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  }
  below(count) { return Math.floor(this.share() * count); }
}

export function makeGrid({ columns = 7, pays = "centre", goal = 2, moves = "ahead" } = {}) {
  const byRow = pays === "centre" ? [0, 0.1, 2, 0.1, 0] : [0, 0, 0, 0, 0];
  const pay = byRow.map(one => Array(columns).fill(one));
  if (pays !== "centre") pay[2][columns - 1] = goal;
  return { pay, start: [2, 0], goal: [2, columns - 1], moves };
}

const same = ([a, b], [c, d]) => a === c && b === d;

/* How a drive ends on a square: "goal", "beside", "off", or "" where it goes on. */
export function ends(grid, square) {
  const [row, column] = square;
  if (row === 0 || row === grid.pay.length - 1) return "off";
  if (same(square, grid.goal)) return "goal";
  return column === grid.pay[0].length - 1 ? "beside" : "";
}

export function after(grid, [row, column], move) {
  return [row + TURN[move], column + (grid.moves === "free" && move !== 1 ? 0 : 1)];
}

export function drive(grid, moves) {
  let at = 0;
  return driveBy(grid, () => moves[at++]);
}

/* Drive the moves that are decided square by square, until the episode ends, is cut, or there is none. */
export function driveBy(grid, decide) {
  const squares = [grid.start], rewards = [], moves = [];
  let ended = "", move;
  while (!ended && moves.length < MOST_MOVES && (move = decide(squares.at(-1))) !== undefined) {
    const square = after(grid, squares.at(-1), move);
    moves.push(move);
    squares.push(square);
    rewards.push(grid.pay[square[0]][square[1]]);
    ended = ends(grid, square);
  }
  return { squares, rewards, moves, ended, total: rewards.reduce((sum, one) => sum + one, 0) };
}

export function actionValues(grid, values, square, gamma) {
  return [0, 1, 2].map(move => {
    const [row, column] = after(grid, square, move);
    return grid.pay[row][column] + gamma * values[row][column];
  });
}

export const optimalValues = (grid, gamma) => swept(grid, gamma, three => Math.max(...three));
export const randomValues = (grid, gamma) => swept(grid, gamma, three => (three[0] + three[1] + three[2]) / 3);

export function bestDrive(grid, gamma) {
  const values = optimalValues(grid, gamma);
  return driveBy(grid, square => {
    const worth = actionValues(grid, values, square, gamma), best = Math.max(...worth);
    return [1, 0, 2].find(one => worth[one] >= best - 1e-9);
  });
}

function swept(grid, gamma, best) {
  const values = grid.pay.map(row => row.map(() => 0)), decide = [];
  for (let row = grid.pay.length - 1; row >= 0; row--)
    for (let column = grid.pay[0].length - 1; column >= 0; column--) if (!ends(grid, [row, column])) decide.push([row, column]);
  for (let sweep = 0; sweep < 10000; sweep++) {
    let change = 0;
    for (const [row, column] of decide) {
      const value = best(actionValues(grid, values, [row, column], gamma));
      change = Math.max(change, Math.abs(value - values[row][column]));
      values[row][column] = value;
    }
    if (change < 1e-10) break;
  }
  return values;
}

export const newQ = grid => grid.pay.map(row => row.map(() => [0, 0, 0]));

export function update(q, grid, square, move, alpha, gamma) {
  const [row, column] = after(grid, square, move), reward = grid.pay[row][column];
  const ahead = ends(grid, [row, column]) ? 0 : Math.max(...q[row][column]), own = q[square[0]][square[1]];
  own[move] += alpha * (reward + gamma * ahead - own[move]);
}

export function choose(values, epsilon, chance) {
  if (epsilon > 0 && chance.share() < epsilon) return chance.below(3);
  const best = Math.max(...values), among = [0, 1, 2].filter(move => values[move] === best);
  return among.length > 1 ? among[chance.below(among.length)] : among[0];
}

export function learn(grid, { alpha = 0.5, gamma = 0.9, epsilon = 0.3, epsilonLast = null, drives = 300 }, chance, q = newQ(grid)) {
  const totals = [], last = epsilonLast ?? epsilon;
  for (let number = 0; number < drives; number++) {
    const share = number / Math.max(1, drives - 1);
    totals.push(learnDrive(grid, q, alpha, gamma, epsilon + (last - epsilon) * share, chance).total);
  }
  return { q, totals };
}

export function learnDrive(grid, q, alpha, gamma, epsilon, chance) {
  return driveBy(grid, square => {
    const move = choose(q[square[0]][square[1]], epsilon, chance);
    update(q, grid, square, move, alpha, gamma);
    return move;
  });
}

export const greedyDrive = (grid, q, chance) => driveBy(grid, ([row, column]) => choose(q[row][column], 0, chance));
