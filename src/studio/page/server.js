// What the page asks the server. An answer that is a refusal is an error with the server's sentence.

async function ask(method, path, body) {
  let response;
  try {
    response = await fetch(path, body === undefined ? { method } : { method, headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  } catch {
    throw Object.assign(new Error("The studio does not answer. Is `teachtree studio` still running?"), { gone: true });
  }
  const answer = await response.json();
  if (!response.ok) throw Object.assign(new Error(answer.error), { status: response.status, answer });
  return answer;
}

export const get = (path) => ask("GET", path);
export const put = (path, body) => ask("PUT", path, body);
export const post = (path, body) => ask("POST", path, body);

const message = document.getElementById("message");

/** Shows a sentence above the recording; nothing takes it away. */
export function tell(text = "") {
  message.textContent = text;
  message.hidden = !text;
}
