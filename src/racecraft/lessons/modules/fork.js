/* Now or later, exactly as models/fork.py has it; nothing here draws. */
export const COST = 0.01, LEFT = [3, 0.1], RIGHT = [7, 1];

export function worth(gamma, steps, prize, cost = COST) {
  let costs = 0;
  for (let k = 0; k < steps; k++) costs += gamma ** k;
  return gamma ** (steps - 1) * prize - cost * costs;
}
