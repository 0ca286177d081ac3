// Questions to the server about what is stored.

/** A refusal: one sentence of the server. */
export class Refused extends Error {}

/**
 * @template T
 * @param {string} question
 * @param {Record<string, string | string[]>} words a key that is empty is left out
 * @returns {Promise<T>}
 */
export async function ask(question, words) {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(words)) {
    for (const one of Array.isArray(value) ? value : [value]) {
      if (one) query.append(name, one);
    }
  }
  return answered(await fetch(`ask/${question}?${query}`));
}

// Has the server do something.
/**
 * @template T
 * @param {string} action
 * @param {Record<string, string>} body
 * @returns {Promise<T>}
 */
export async function act(action, body) {
  const headers = { "Content-Type": "application/json" };
  const asked = { method: "POST", headers, body: JSON.stringify(body) };
  return answered(await fetch(`do/${action}`, asked));
}

/** @param {Response} response */
async function answered(response) {
  if (!response.ok && response.status !== 400) {
    throw new Error(`the server answers ${response.status}`);
  }
  const answer = await response.json();
  if (response.status === 400) throw new Refused(answer.error);
  return answer;
}
