/* ML-Agents' linear schedules, exactly as files/trainer_config.py and algorithms/ppo.py have them; nothing here draws. */
export const STARTS = { learning_rate: 3e-4, beta: 5e-3, epsilon: 0.2 };
const ENDS = { learning_rate: 1e-10, beta: 1e-5, epsilon: 0.1 };

/* A value when a share of the training, 0 to 1, is done; one that begins below its end stays. */
export function scheduled(name, done, start = STARTS[name]) {
  const end = Math.min(start, ENDS[name]);
  return start + (end - start) * Math.min(done, 1);
}
