/* A temperature and a score of search; nothing here draws. models/family.py has both. */
export function atTemperature(values, temperature) {
  const best = Math.max(...values), weights = values.map(value => Math.exp((value - best) / temperature)), sum = weights.reduce((a, b) => a + b);
  return weights.map(weight => weight / sum);
}

export function searchScores(values, priors, visits, c) {
  const root = Math.sqrt(visits.reduce((a, b) => a + b));
  return values.map((q, k) => q + c * priors[k] * root / (1 + visits[k]));
}
