/* One step of the policy gradient, exactly as models/policy_gradient.py has it; nothing here draws. */

export function probabilities(theta) {
  const top = Math.max(...theta), raised = theta.map(one => Math.exp(one - top)), sum = raised.reduce((a, b) => a + b, 0);
  return raised.map(one => one / sum);
}

export function weights(totals, hasBaseline) {
  const mean = hasBaseline ? totals.reduce((a, b) => a + b, 0) / totals.length : 0;
  return totals.map(one => one - mean);
}

export function driveRow(theta, move, weight) {
  const pi = probabilities(theta);
  return [0, 1, 2].map(action => weight * ((action === move ? 1 : 0) - pi[action]));
}

export function gradient(theta, batch, hasBaseline) {
  const counted = weights(batch.map(([, total]) => total), hasBaseline), rows = batch.map(([move], k) => driveRow(theta, move, counted[k]));
  return [0, 1, 2].map(action => rows.reduce((sum, row) => sum + row[action], 0) / rows.length);
}

/* A move drawn by its probability. */
export function drawn(pi, chance) {
  const share = chance.share();
  return share < pi[0] ? 0 : share < pi[0] + pi[1] ? 1 : 2;
}

export const climbed = (theta, slope, step) => theta.map((one, k) => one + step * slope[k]);
export const entropy = pi => -pi.filter(one => one > 0).reduce((sum, one) => sum + one * Math.log(one), 0);
