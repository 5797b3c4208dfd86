/* A small network, exactly as lessons/network.py has it; nothing here draws. */

/* The values after each layer; those of all but the last are bent by tanh. */
export function forward(observation, layers) {
  const after = [];
  let values = observation;
  layers.forEach(({ weights, bias }, number) => {
    values = weights.map((row, k) => row.reduce((sum, weight, j) => sum + weight * values[j], bias[k]));
    if (number < layers.length - 1) values = values.map(Math.tanh);
    after.push(values);
  });
  return after;
}
