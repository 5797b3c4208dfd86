/* The lessons' small game, as lessons/game.py plays it. */
export const MOVES = ["up", "down", "left", "right"], SIDE = 7, MOST_TURNS = 100;
const STEPS = [[0, 1], [0, -1], [-1, 0], [1, 0]];
const CIRCLE = [[3, 3], [3, 4], [3, 5], [4, 5], [5, 5], [5, 4], [5, 3], [4, 3]];
const START_HEALTH = 20, MAX_HEALTH = 100, LENGTH_OF_OTHER = 4, FIRST_FOOD = 16, FOOD_STEP = 17;

export const same = (a, b) => a[0] === b[0] && a[1] === b[1];
const alive = board => board.snakes.filter(one => !one.cause);

export function firstBoard() {
  const other = Array.from({ length: LENGTH_OF_OTHER }, (_, k) => CIRCLE[(CIRCLE.length - k) % CIRCLE.length]);
  const board = { turn: 0, food: [], snakes: [{ id: "you", body: [[1, 1], [1, 1], [1, 1]], health: START_HEALTH, cause: "", by: "" }, { id: "other", body: other, health: MAX_HEALTH, cause: "", by: "" }] };
  dropFood(board, FIRST_FOOD);
  return board;
}

export function play(moves) {
  const board = firstBoard();
  for (const move of moves.slice(0, MOST_TURNS)) turn(board, move);
  return board;
}

/* One turn, in place: everybody moves, hungers, eats; then the starved, those off the board and all collisions. */
export function turn(board, move) {
  if (board.snakes[0].cause || board.turn >= MOST_TURNS) return board;
  const before = board.food[0], from = CIRCLE[board.turn % 8], to = CIRCLE[(board.turn + 1) % 8];
  const steps = { you: STEPS[MOVES.indexOf(move)], other: [to[0] - from[0], to[1] - from[1]] };
  for (const snake of alive(board)) {
    const [x, y] = snake.body[0], [dx, dy] = steps[snake.id];
    snake.body = [[x + dx, y + dy], ...snake.body.slice(0, -1)];
    snake.health -= 1;
    if (board.food.some(one => same(one, snake.body[0]))) {
      snake.health = MAX_HEALTH;
      snake.body.push(snake.body.at(-1));
      board.food = [];
    }
  }
  eliminate(board);
  board.turn += 1;
  if (!board.food.length) dropFood(board, before[1] * SIDE + before[0] + FOOD_STEP);
  return board;
}

function eliminate(board) {
  for (const snake of alive(board)) {
    if (snake.health <= 0) snake.cause = "out-of-health";
    else if (snake.body.some(([x, y]) => x < 0 || y < 0 || x >= SIDE || y >= SIDE)) snake.cause = "wall-collision";
  }
  const standing = alive(board), verdicts = standing.map(snake => collision(snake, standing));
  standing.forEach((snake, k) => { [snake.cause, snake.by] = verdicts[k]; });
}

function collision(snake, standing) {
  const head = snake.body[0], others = standing.filter(one => one !== snake);
  if (snake.body.slice(1).some(one => same(one, head))) return ["snake-self-collision", snake.id];
  for (const other of others) if (other.body.slice(1).some(one => same(one, head))) return ["snake-collision", other.id];
  for (const other of others) if (same(other.body[0], head) && snake.body.length <= other.body.length) return ["head-collision", other.id];
  return ["", ""];
}

function dropFood(board, cell) {
  const taken = [...CIRCLE, ...alive(board).flatMap(one => one.body)];
  for (let k = 0; k < SIDE * SIDE; k++) {
    const at = (cell + k) % (SIDE * SIDE), point = [at % SIDE, Math.floor(at / SIDE)];
    if (!taken.some(one => same(one, point))) { board.food = [point]; return; }
  }
}
